#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# lab-day.sh FOLDER: the first day with a handheld arm and four drives in profile velocity, on simulated drives. Runs each command in the new
# folder FOLDER and prints the page docs/lab-day.md. tests/docs/walk_test.py compares the page with a new run. Needs the programs in PATH.
# shellcheck disable=SC2016
set -euo pipefail
# shellcheck source=docs/walk.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/walk.sh" lab-day "${1:-}"

cat <<'END'
<!-- Made by docs/lab-day.sh, which runs every command of this page; tests/docs/walk_test.py compares it with a new run. -->
# A lab day with simulated drives

From four drives on a bench to a tip on a circle: a handheld arm of two tubes, each with a motor for its translation and one for its rotation. The
drives have the objects and units of the Faulhaber MC3 family: profile velocity (mode 3), velocities in rpm, accelerations in 1/s^2, no deadline of the
command PDO (1400:05), no interpolation period (60C2). The drives are simulated here, so that you can try every line before you buy a drive. With real drives
the commands are the same; only the name of the bus changes. `docs/lab-day.sh FOLDER` runs the page.

## 1. The files

Three files describe the arm, and `tandem presets` has all three as `handheld`: the robot (tubes, limits, home), the hardware (bus, drives, gears) and the
deployment (which processes run). Replace these values by your own:

| key | source of its value |
|---|---|
| `counts_per_revolution: 4096` | encoder on the motor, four counts for each of 1024 lines (object 608F of the drive) |
| `gear_ratio`, `lead_mm` | data sheets of gear and lead screw |
| `profile: mc3` | the drive's model: its units (rpm, 1/s^2) and what it lacks; [profiles](hardware.md#drive-profiles) of others, or one of your own |
| `homing: {method: 17, ...}` | negative limit switch; 18 is the positive one, 37 takes the present position |
| `lower_mm`, `upper_mm` | ruler: the range of the carriage |
| `quick_stop_deceleration_mm_per_s2: 200` | a fraction of the deceleration that motor and gear permit; 1400 revolutions/s^2 at the motor, below 32767, the maximum of object 6085 |
END
run 'tandem can budget handheld'

say <<'END'
The bus has room: four drives at 400 Hz use 54 % of 1 Mbit/s, and the calculation includes one parameter access per cycle.

## 2. The bus without the HAL

Without Tandem's HAL nothing moves the drives. Here `tandem-drive-sim` simulates the bus and its drives; on a bench the bus is `can:can0` after
`ip link set can0 type can bitrate 1000000 restart-ms 0 && ip link set can0 txqueuelen 64 up`.
END
printf '\n```console\n$ tandem-drive-sim --hardware handheld --hardware-bus bus &\n```\n'
tandem-drive-sim --hardware handheld --hardware-bus bus --log warn >drives.log 2>&1 &
background=$!
for ((k = 0; k < 100; ++k)); do
  [[ -S /tmp/tandem-handheld ]] && break
  sleep 0.1
done
run 'tandem can scan --bus unix:/tmp/tandem-handheld'
run 'tandem can od --bus unix:/tmp/tandem-handheld 1 6502'

say <<'END'
Mode 3 (profile velocity) is bit 2 of the supported modes (6502); 421 = 0x1A5 has it. Copy the serial numbers of the scan into the hardware file (`serial:` of each
axis), then the boot fails if two connectors are swapped.
END
end

say <<'END'
## 3. The system

The HAL resets and configures the drives, and reads back every value:
END
up handheld
# The drives boot meanwhile.
for ((k = 0; k < 300; ++k)); do
  tandem can monitor handheld --once | grep -q booting || break
  sleep 0.2
done
run -v 'tandem can monitor handheld --once'

say <<'END'
`NOT HOMED`: after power on these drives have no reference of their position. Turn the tubes to their marks by hand; the carriages then search for their switches:
END
run 'tandem home -d handheld'
run -v 'tandem can monitor handheld --once'

say <<'END'
## 4. Direction and scale, at about one percent of the speed

One joint after the other, at 0.05 mm/s and 0.6 deg/s. The carriage must move towards positive beta, out of the handle, by what the ruler says; otherwise
`reversed` or `gear_ratio` is wrong:
END
run -v 'tandem robot -d handheld enable'
run -v 'tandem jog -d handheld arm beta_2 0.05 --for 2'
run -v 'tandem jog -d handheld arm alpha_2 0.6 --for 2'

say <<'END'
## 5. Every stop

Try each stop once before you insert the tubes. The soft stop latches, and only `disable` clears it:
END
run -v 'tandem robot -d handheld stop'
run -v -x 1 'tandem robot -d handheld enable'
run -v 'tandem robot -d handheld disable'

say <<'END'
[hardware.md](hardware.md#commissioning-of-an-arm) has the table of all stops: emergency stop, connectors, processes.

## 6. The tip on a circle
END
run 'tandem new trajectory ring --arms 1 | head -n 1 && sed -i "s/center_offset_mm: .*normal/center_offset_mm: [0, 4, 0], normal/; s/^tasks:.*/tasks: [{tip: arm}]/; /^  - tip: a$/d" ring.yaml'
run -v 'tandem plan check ring.yaml --robot handheld 2>/dev/null'

say <<'END'
From the switches to the home of the robot file, where the tip can move in every direction, and once around:
END
run -v 'tandem robot -d handheld enable && tandem robot -d handheld home'
run -v 'tandem robot -d handheld run ring.yaml'
end

say <<'END'
Profile velocity needs the position loop in the HAL (`velocity_gain_per_s`): the joint lags by the speed divided by the gain, and the tip with it. A higher
gain makes the lag smaller until the drive's own loop begins to oscillate; `follow` in `tandem can monitor` shows both.

The interventions of the gate are those of its guard `slew` (`tandem status` counts them by guard): [`slew_limit`](hardware.md#the-hardware-file) spreads a jump of the
commanded velocity over several periods. They need no action.

Next: [hardware](hardware.md) for everything about drives, [safety](safety.md) for budgets and stops.
END
