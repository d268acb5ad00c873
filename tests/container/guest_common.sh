# SPDX-License-Identifier: Apache-2.0
# Functions shared by the scripts of booted machines (uml.py), which source this file.
# shellcheck shell=bash
results=/trial/results
# Trace for failure analysis, with the time in s.
exec {BASH_XTRACEFD}>/trial/trace
PS4='$SECONDS '
set -x
# note KEY VALUE: one line for the host, which checks it.
note() { printf '%s=%s\n' "$1" "$2" >>$results; }
# until_true SECONDS COMMAND...
until_true() {
  local end=$((SECONDS + $1))
  shift
  until "$@"; do
    ((SECONDS < end)) || return 1
    sleep 0.2
  done
}
# Policy and priority of each thread of a process.
threads() {
  for task in /proc/"$1"/task/*; do chrt -p "${task##*/}"; done |
    awk '/policy/ {policy = $NF} /priority/ {print policy, $NF}' | sort -u | tr '\n' ','
}
# Virtual CAN interfaces.
can_interfaces() {
  local module interface
  for module in can-dev can can-raw vcan; do [[ ! -e /trial/$module.ko ]] || insmod /trial/$module.ko; done
  for interface in "$@"; do ip link add dev "$interface" type vcan && ip link set "$interface" up; done
}
