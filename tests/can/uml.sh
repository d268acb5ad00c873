#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs a command in an environment with CAN: user-mode Linux, on this host's file system, with virtual CAN interfaces.
set -euo pipefail

usage() {
  cat <<'TEXT'
Usage: uml.sh [OPTION]... [--] COMMAND [ARGUMENT]...

Boots user-mode Linux (Debian package user-mode-linux) on the file system of this host, brings virtual CAN interfaces
up, and runs COMMAND as root in the present folder. Ends with its exit code. Where this kernel has CAN itself and the
interfaces exist, --native runs the command without booting anything.

  --can NAMES     interfaces, comma-separated (default vcan0,vcan1)
  --memory SIZE   of the guest (default 1G)
  --timeout S     ends the guest after so many seconds, with exit code 124 (default 300)
  --native        use this kernel if it has the interfaces
  --help          this text
TEXT
}

die() {
  printf 'uml.sh: %s\n' "$*" >&2
  exit 2
}

names=vcan0,vcan1 memory=1G limit=300 native=false
while (($# > 0)); do
  case $1 in
    --can) names=$2 && shift ;;
    --memory) memory=$2 && shift ;;
    --timeout) limit=$2 && shift ;;
    --native) native=true ;;
    -h | --help) usage && exit 0 ;;
    --) shift && break ;;
    -*) usage >&2 && die "unknown option: $1" ;;
    *) break ;;
  esac
  shift
done
(($# > 0)) || die "expected a command"
IFS=, read -ra interfaces <<<"$names"

if $native; then
  present=true
  for name in "${interfaces[@]}"; do [[ -e /sys/class/net/$name ]] || present=false; done
  if $present; then exec "$@"; fi
fi

command -v linux.uml >/dev/null || die "linux.uml: not found; install user-mode-linux"
kernel=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P)/linux_uml.sh
modules=$(find /usr/lib/uml/modules -mindepth 1 -maxdepth 1 -type d | sort -V | tail -1)
[[ -n $modules ]] || die "no modules below /usr/lib/uml/modules"

# All files of the guest are in one folder, with the same path in the guest.
work=$(mktemp -d "${TMPDIR:-/tmp}/tandem-uml.XXXXXX")
trap 'rm -rf "$work"' EXIT
{
  printf '#!/bin/bash\n'
  # The environment of the caller, except for variables that are read-only in the guest's shell.
  export -p | grep -v -E '^declare -[a-z]*r' || true
  printf 'work=%q modules=%q memory=%q\n' "$work" "$modules" "$memory"
  printf 'interfaces=(%s)\n' "$(printf '%q ' "${interfaces[@]}")"
  printf 'command=(%s)\n' "$(printf '%q ' "$@")"
  printf 'folder=%q\n' "$PWD"
  cat <<'GUEST'
export PATH=$PATH:/usr/local/sbin:/usr/sbin:/sbin
exec </dev/null >"$work/guest" 2>&1
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t tmpfs tmpfs /dev/shm 2>/dev/null || { mkdir -p /dev/shm && mount -t tmpfs tmpfs /dev/shm; }
mkdir -p /dev/pts && mount -t devpts devpts /dev/pts 2>/dev/null
[[ -e /dev/fd ]] || ln -s /proc/self/fd /dev/fd
off() {
  echo "$1" >"$work/code"
  sync
  echo o >/proc/sysrq-trigger
  while :; do sleep 1; done
}
load() { grep -q "^${1//-/_} " /proc/modules || insmod "$(find "$modules" -name "$1.ko*" | head -1)" || off 125; }
ip link set lo up
for module in can-dev can can-raw can-gw vcan vxcan sch_netem; do
  if [[ -n $(find "$modules" -name "$module.ko*") ]]; then load "$module"; fi
done
for interface in "${interfaces[@]}"; do
  ip link add dev "$interface" type vcan && ip link set "$interface" mtu 72 up || off 125
done
cd "$folder" || off 125
"${command[@]}" </dev/null >"$work/output" 2>&1
off $?
GUEST
} >"$work/init"
chmod +x "$work/init"
: >"$work/code"
# A guest cannot open the host's pipes: its output goes through a file that is read here.
: >"$work/output"

# In the background, so that a signal reaches this shell, which then ends the guest.
timeout --kill-after=10 "$limit" "$kernel" "$work" mem="$memory" rootfstype=hostfs rootflags=/ rw init="$work/init" \
  con=null con0=null,null quiet umid="tandem$$" uml_dir="$work/" </dev/null >"$work/console" 2>&1 &
guest=$!
# Gives the guest, whose programs have deadlines, priority over compilers and other tests, if this user may set priorities. Sessions share
# the processor before processes do; the kernel starts a session of its own.
favour() {
  local end=$((SECONDS + 5)) child
  while ((SECONDS < end)); do
    if child=$(pgrep -P "$1") && [[ $(ps -o sid= -p "$child") -eq $child ]]; then
      renice -n -15 -p "$child" && echo -15 >"/proc/$child/autogroup"
      return
    fi
    sleep 0.05
  done
}
favour "$guest" >/dev/null 2>&1 || true
trap 'kill "$guest" 2>/dev/null || true; rm -rf "$work"' EXIT
trap 'exit 130' INT TERM
tail -c +1 -s 0.1 -f --pid="$guest" "$work/output"
code=0
wait "$guest" || code=$?
trap 'rm -rf "$work"' EXIT
if [[ -s $work/code && $(<"$work/code") == 125 ]]; then
  cat "$work/guest" >&2
  die "the guest could not be set up"
fi
if [[ -s $work/code ]]; then
  exit "$(<"$work/code")"
fi
((code == 124 || code == 137)) && { echo "uml.sh: ended after $limit s" >&2; exit 124; }
tail -n 30 "$work/console" >&2
die "the guest did not come up"
