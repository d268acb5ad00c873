#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Runs in the booted machine; writes KEY=VALUE lines, which machine.py checks.
# shellcheck source=guest_common.sh
source /trial/guest_common.sh
deployment=boot
show() { systemctl show --value -p "$2" "tandem-$1@$deployment.service"; }
# Properties and permissions of running services.
look() {
  local name pid folder answer
  for name in "$@"; do
    pid=$(show "$name" MainPID)
    note "${name}_active" "$(show "$name" ActiveState)"
    note "${name}_status" "$(show "$name" StatusText)"
    note "${name}_user" "$(stat -c %U "/proc/$pid")"
    note "${name}_capabilities" "$(awk '/^CapPrm/ {print $2}' "/proc/$pid/status")"
    note "${name}_no_new_privileges" "$(awk '/^NoNewPrivs/ {print $2}' "/proc/$pid/status")"
    note "${name}_locked" "$(awk '/^VmLck/ {print $2}' "/proc/$pid/status")"
    note "${name}_threads" "$(threads "$pid")"
    for folder in usr etc; do
      nsenter -t "$pid" -m touch /$folder/written 2>&1 | grep -q 'Read-only file system' && answer=read-only || answer=writable
      note "${name}_$folder" $answer
    done
  done
}

mapfile -t units < <(tandem units boot)
systemctl enable --now tandem@boot.target "${units[@]}"
note target "$(systemctl is-active tandem@boot.target)"
# Both report how many cycles they have run.
periodic() { [[ $(show sim StatusText) == *cycles* && $(show control StatusText) == *cycles* ]]; }
until_true 300 periodic && note periodic yes
look sim control planning

# Control hangs.
kill -STOP "$(show control MainPID)"
restarted() { [[ $(show control NRestarts) == 1 && $(show control ActiveState) == active ]]; }
until_true 300 restarted
for name in sim control planning; do note ${name}_restarts "$(show $name NRestarts)"; done
journalctl -u tandem-control@boot.service | grep -q 'Watchdog timeout' && note watchdog_said yes

# An invalid file ends the start, without a restart.
systemctl start tandem-control@wrong.service
note wrong_file "$(systemctl show --value -p ExecMainStatus tandem-control@wrong.service) $(
  systemctl show --value -p NRestarts tandem-control@wrong.service)"

# The target stops at once, its services in the order of their dependencies.
systemctl stop tandem@boot.target
gone() { [[ $(systemctl list-units --no-legend --state=active,deactivating 'tandem-*@boot.service') == '' ]]; }
until_true 80 gone
for name in sim control planning; do
  note ${name}_stopped "$(show $name ActiveState)"
  note ${name}_result "$(show $name Result)"
done

# The HAL, with simulated drives on CAN.
can_interfaces vcan0 vcan1
for bus in a b; do
  systemd-run --quiet --unit=drives-$bus -p User=tandem -p Nice=-5 tandem-drive-sim --hardware bench --hardware-bus bus_$bus --log warn
done
deployment=bench
systemctl start tandem-hal@bench.service
frames() { cat /sys/class/net/vcan0/statistics/rx_packets /sys/class/net/vcan1/statistics/rx_packets | sort -n | head -1; }
enough() { (($(frames) > 500)); }
until_true 240 enough
look hal
note frames "$(frames)"
systemctl stop tandem-hal@bench.service
note hal_end "$(show hal Result) $(show hal ActiveState)"
note end yes
