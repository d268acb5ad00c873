#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Test of a new installation: the README's commands in an empty Debian 12, with their cost in time and packages.
set -euo pipefail
# shellcheck source=deploy/lib.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/lib.sh"

usage() {
  cat <<'TEXT'
Usage: deploy/fresh.sh [--log FILE] [--keep FOLDER]

As root: makes the smallest Debian 12 (mmdebstrap, from this machine's package sources) in a temporary folder, copies the
committed sources into it, and runs there, without ccache,

  deploy/run.sh                            packages, build, Table 3
  deploy/run.sh --no-install               twice more: offline, nothing to build; then after `git clean -xfd`
  the build of deploy/test.sh              what the tests add

Prints for each its processor and wall time, and the size of the packages that it installed. Takes half an hour on two cores.

  --log FILE     file for the output of the commands (default: build/fresh.log)
  --keep FOLDER  keep the file system in this folder
  --help         this text
TEXT
}

log=$root/build/fresh.log keep=''
while (($# > 0)); do
  case $1 in
    --log | --keep)
      (($# > 1)) || die "$1: expected a name"
      if [[ $1 == --log ]]; then log=$2; else keep=$2; fi
      shift
      ;;
    -h | --help) usage && exit 0 ;;
    *) usage >&2 && printf '\n' >&2 && die "unknown option: $1" ;;
  esac
  shift
done
((EUID == 0)) || die "creates a root file system of its own: run it as root"
command -v mmdebstrap >/dev/null || die "mmdebstrap: not found; deploy/test.sh installs it, or: apt-get install mmdebstrap"
command -v git >/dev/null || die "git: not found; apt-get install git"

house=${keep:-$(mktemp -d --tmpdir tandem-fresh-XXXXXX)}
[[ -z $keep || ! -e $keep ]] || die "--keep $keep: already exists; name a new folder"
trap '[[ -n $keep ]] || rm -rf --one-file-system "$house"' EXIT
mkdir -p "$(dirname -- "$log")"
log=$(realpath -- "$log")
: >"$log"

say "making a Debian 12 in $house"
sources=()
[[ ! -e /etc/apt/sources.list.d/debian.sources ]] || sources=(/etc/apt/sources.list.d/debian.sources)
mmdebstrap --quiet --variant=minbase --include=ca-certificates bookworm "$house" ${sources[@]+"${sources[@]}"} >>"$log" 2>&1 ||
  die "mmdebstrap failed; see $log"
cp /etc/resolv.conf "$house/etc/resolv.conf"
printf '#!/bin/sh\nexit 101\n' >"$house/usr/sbin/policy-rc.d"
chmod 755 "$house/usr/sbin/policy-rc.d"
mkdir "$house/root/tandem"
git -C "$root" archive HEAD | tar -x -C "$house/root/tandem"

# inside COMMAND...: runs a command in the new system, with separate processes and mounts.
inside() {
  # shellcheck disable=SC2016
  unshare --mount --pid --fork --kill-child bash -c '
    mount -t proc proc "$0/proc" && mount -t tmpfs tmpfs "$0/run" && mount -t tmpfs tmpfs "$0/dev/shm" &&
    exec chroot "$0" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 CCACHE_DISABLE=1 "$@"' \
    "$house" "$@"
}

# Total size of the installed packages according to dpkg, MB.
# shellcheck disable=SC2016
installed() { inside dpkg-query -W -f='${Installed-Size}\n' | awk '{ sum += $1 } END { printf "%d", sum / 1024 }'; }

rows=()
# step NAME COMMAND: one row of the table.
step() {
  local name=$1 before after times status=0
  shift
  before=$(installed)
  say "$name"
  printf '\n### %s\n' "$name" >>"$log"
  TIMEFORMAT='%R %U %S'
  times=$({ time inside bash -c "cd /root/tandem && $*" >>"$log" 2>&1 </dev/null; } 2>&1) || status=$?
  after=$(installed)
  rows+=("$(printf '%s\n' "$times" | tail -n 1 |
    awk -v name="$name" -v more=$((after - before)) -v status="$status" \
      '{ printf "%-42s %8.1f min %10.1f min %8d MB   %s", name, $1 / 60, ($2 + $3) / 60, more, status == 0 ? "ok" : "failed (" status ")" }')")
  printf '%s\n' "${rows[-1]}" | tee -a "$log"
  ((status == 0)) || die "$name failed; see $log"
}

step "packages of deploy/run.sh" 'bash -c "source deploy/lib.sh && install_packages run"'
step "deploy/run.sh: build, Table 3" deploy/run.sh
step "deploy/run.sh --no-install, again" deploy/run.sh --no-install
step "the same in a clean tree" 'rm -rf build results && deploy/run.sh --no-install'
# shellcheck disable=SC2016
step "packages of deploy/test.sh" 'bash -c "source deploy/lib.sh && install_packages \$(purposes)"'
step "build of deploy/test.sh" 'bash -c "source deploy/lib.sh && configure release -DTANDEM_TESTS=ON -DTANDEM_PYTHON=ON -DTANDEM_PAGE=ON && build release"'

printf '\n%-42s %12s %14s %11s\n' step wall processor packages
printf '%s\n' "${rows[@]}"
say "what the commands printed: $log"
