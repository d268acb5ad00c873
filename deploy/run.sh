#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# From a bare Debian 12 to the table of the paper. May be run again at any time.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"

usage() {
  cat <<'TEXT'
Usage: deploy/run.sh [--no-install] [--build-only]

Installs the Debian packages that are missing (deploy/packages.txt; as root or through sudo), builds preset release in
build/release, runs `tandem experiment table3`, and leaves rows in results/csv and figures in results/figures.

  --no-install   use what is installed; neither apt nor root is needed
  --build-only   do not run the experiment
  --help         this text
TEXT
}

install=true experiment=true
while (($# > 0)); do
  case $1 in
    --no-install) install=false ;;
    --build-only) experiment=false ;;
    -h | --help) usage && exit 0 ;;
    *) usage >&2 && printf '\n' >&2 && die "unknown option: $1" ;;
  esac
  shift
done

if $install; then install_packages; else report_packages; fi
build release services/all
bin=$root/build/release/bin

status=0
if $experiment; then
  say "running experiment table3 over DDS in lock-step"
  (cd "$root" && "$bin/tandem" experiment table3 --csv results/csv --figures results/figures) || status=$?
fi

echo
say "programs: $bin"
if $experiment && ((status == 0)); then
  say "rows and summary: $root/results/csv"
  say "figures: $root/results/figures"
fi
cat <<TEXT
Next:
  export PATH=$bin:\$PATH
  tandem up laptop               simulator, control and planning in real time; Ctrl-C stops them
  tandem robot run rectangle     in a second terminal: move
  tandem status                  in a third one: watch
  $root/deploy/test.sh   the tests
TEXT
((status == 0)) || die "the experiment ended with exit code $status"
