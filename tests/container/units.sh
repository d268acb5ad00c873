#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Runs in the booted machine: properties of every unit according to its systemd, and of a running process of each according to the kernel.
# Writes KEY=VALUE lines and files, which units_test.py checks.
# shellcheck source=guest_common.sh
source /trial/guest_common.sh
show() { systemctl show --value -p "$2" "$1"; }
# ask NAME UNIT: properties of a unit that has been started; before that, systemd does not show its watchdog.
ask() { systemctl show -p "$(</trial/properties)" "$2" >"/trial/show-$1"; }
# look NAME UNIT: properties of a running service.
look() {
  local pid group
  pid=$(show "$2" MainPID)
  group=/sys/fs/cgroup$(show "$2" ControlGroup)
  note "$1_active" "$(show "$2" ActiveState)"
  note "$1_program" "$(readlink "/proc/$pid/exe")"
  note "$1_user" "$(stat -c %U "/proc/$pid")"
  note "$1_oom" "$(<"/proc/$pid/oom_score_adj")"
  note "$1_nice" "$(awk '{print $19}' "/proc/$pid/stat")"
  note "$1_threads" "$(threads "$pid")"
  note "$1_memory" "$(<"$group/memory.max")"
  note "$1_swap" "$(<"$group/memory.swap.max")"
  note "$1_peak" "$(<"$group/memory.peak")"
}

can_interfaces vcan0 vcan1
while read -r name deployment; do
  unit=tandem-$name@$deployment.service
  systemctl start "$unit"
  ask "$name" "$unit"
  look "$name" "$unit"
  [[ $name == console ]] || systemctl stop "$unit"
done </trial/units

# Killed: it restarts.
console=tandem-console@units.service
back() { [[ $(show $console NRestarts) == 1 && $(show $console ActiveState) == active ]]; }
kill -KILL "$(show $console MainPID)"
until_true 240 back
note killed "$(show $console NRestarts) $(show $console ActiveState)"
survivor=$(show $console MainPID)

# An invalid file ends the start, without a restart.
systemctl start tandem-recorder@wrong.service
note wrong_file "$(show tandem-recorder@wrong.service ExecMainStatus) $(show tandem-recorder@wrong.service NRestarts)"

# A process that needs more memory than its unit grants ends each time, five times, and no other process ends.
greedy=tandem-recorder@greedy.service
dead() { [[ $(show $greedy ActiveState) == failed ]]; }
systemctl start --no-block $greedy
until_true 400 dead
note greedy_limit "$(show $greedy MemoryMax)"
note greedy "$(show $greedy Result) $(show $greedy ActiveState)"
note greedy_started "$(journalctl -u $greedy -o cat | grep -c '^Starting ')"
[[ $(show $console MainPID) == "$survivor" ]] && note survivor "$(show $console ActiveState)"

# Packet filter of a service: it receives from everywhere, and after `tandem units --restrict` only from the deployment's hosts.
insmod /trial/veth.ko
ip netns add stranger
ip link add wire type veth peer name wire netns stranger
ip address add 10.66.0.1/24 dev wire
ip -n stranger address add 10.66.0.2/24 dev wire
ip link set wire up
ip -n stranger link set wire up
ip -n stranger link set lo up
guarded=tandem-sim@guarded.service
# receives DEPLOYMENT COMMAND...: whether a client started by COMMAND receives the service.
receives() { "${@:2}" tandem status "$1" --check >/dev/null 2>&1 && echo yes || echo no; }
elsewhere() { receives stranger ip netns exec stranger; }
systemctl start $guarded
note open_guarded "$(receives guarded)"
note open_stranger "$(elsewhere)"
tandem units guarded --restrict
systemctl daemon-reload
systemctl restart $guarded
note shut_guarded "$(receives guarded)"
note shut_stranger "$(elsewhere)"
note shut_deny "$(show $guarded IPAddressDeny)"
note shut_allow "$(show $guarded IPAddressAllow)"
note end yes
