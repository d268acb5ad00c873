#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# From a new Debian 12 to the table of the paper. May be repeated at any time.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"

usage() {
  cat <<'TEXT'
Usage: deploy/run.sh [--with figures,page,python] [--no-install] [--build-only]

Installs the Debian packages that are missing (deploy/packages.txt; as root or through sudo), builds preset release in
build/release, runs `tandem experiment table3`, and leaves rows in results/csv.

  --with WHAT    additional parts to install and build, separated by commas; may be repeated:
                   figures   drawing with --figure and --figures of the command line (matplotlib; 260 MB)
                   page      the operator's page in a browser (npm; 330 MB unless node is installed)
                   python    the Python module (60 MB), in build/release/python
                   all       all three
  --no-install   install no packages; neither apt nor root is needed
  --build-only   do not run the experiment
  --help         this text

Later calls without --with build the same additional parts again.
TEXT
}

install=true experiment=true
more=()
while (($# > 0)); do
  case $1 in
    --no-install) install=false ;;
    --build-only) experiment=false ;;
    --with | --with=*)
      [[ $1 == --with=* || $# -gt 1 ]] || die "--with: expected figures, page, python or all"
      list=${1#--with=}
      [[ $1 == --with=* ]] || { list=$2 && shift; }
      for what in ${list//,/ }; do
        case $what in
          figures | page | python) more+=("$what") ;;
          all) more+=(figures page python) ;;
          *) die "--with: found '$what', expected figures, page, python or all" ;;
        esac
      done
      ;;
    -h | --help) usage && exit 0 ;;
    *) usage >&2 && printf '\n' >&2 && die "unknown option: $1" ;;
  esac
  shift
done
with() { [[ " ${more[*]-} " == *" $1 "* ]]; }

prepare "$install" run ${more[@]+"${more[@]}"}
options=() targets=(services/all)
! with page || options+=(-DTANDEM_PAGE=ON)
! with python || options+=(-DTANDEM_PYTHON=ON)
configure release ${options[@]+"${options[@]}"}
on() { grep -qx "$1:BOOL=ON" "$root/build/release/CMakeCache.txt"; }
! on TANDEM_PAGE || targets+=(console_page)
! on TANDEM_PYTHON || targets+=(_tandem)
build release "${targets[@]}"
bin=$root/build/release/bin
figures=false
! /usr/bin/python3 -c 'import matplotlib' 2>/dev/null || figures=true

status=0
if $experiment; then
  say "running experiment table3 over DDS in lock-step"
  drawn=()
  ! $figures || drawn=(--figures results/figures)
  (cd "$root" && "$bin/tandem" experiment table3 --csv results/csv ${drawn[@]+"${drawn[@]}"}) || status=$?
fi

echo
say "programs: $bin"
if $experiment && ((status == 0)); then
  say "rows and summary: $root/results/csv"
  if $figures; then say "figures: $root/results/figures"; else say "no figures: deploy/run.sh --with figures draws them"; fi
fi
cat <<TEXT
Next:
  export PATH=$bin:\$PATH
  tandem up laptop               simulator, control and planning in real time; Ctrl-C stops them
  tandem robot run rectangle     in a second terminal: move
  tandem status                  in a third one: watch
  tandem console                 operator's page; built by deploy/run.sh --with page
  $root/deploy/test.sh   the tests
TEXT
((status == 0)) || die "the experiment ended with exit code $status"
