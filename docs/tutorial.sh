#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# tutorial.sh FOLDER: the way from a robot of one's own to the figures of a paper. Runs each command in the new folder FOLDER and prints the
# page docs/tutorial.md: the commands with what they print. tests/docs/walk_test.py compares the page with a new run.
# Needs the programs in PATH, and the parts `figures` and `python` of deploy/run.sh.
# The texts in single quotes are Markdown, and commands for the shell of the page.
# shellcheck disable=SC2016
set -euo pipefail
# shellcheck source=docs/walk.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/walk.sh" tutorial "${1:-}"

cat <<'END'
<!-- Made by docs/tutorial.sh, which runs every command of this page; tests/docs/walk_test.py compares it with a new run. -->
# From your robot to your figure

Half an hour, no hardware: a robot file with your tubes, a task, a run in real time, its recording and figures, a comparison of the methods, and
tables for a paper. After `deploy/run.sh --with figures,python` and with the programs in `PATH`, type the commands one by one in a new folder, or run
`docs/tutorial.sh FOLDER`. Numbers of real-time runs differ a little from run to run; all others are the same on every run.
END

say <<'END'
## 1. The robot

`tandem new` writes a file that is valid as it is. This one has a single arm of three tubes:
END
run 'tandem new robot bench --arms 1'
say <<'END'
Write the data of your tubes into it with an editor. Here the arm gets the name `left`, and its first tube a curved part that is longer and more curved, with
a decimal comma by mistake:
END
run "sed -i 's/arm_a/left/; s/straight_length_mm: 413, curved_length_mm: 50, curvature_per_m: 10/straight_length_mm: 400, curved_length_mm: 60, curvature_per_m: 12,5/' bench.yaml"
run -x 2 'tandem validate bench.yaml'
run "sed -i 's/12,5/12.5/' bench.yaml && tandem validate bench.yaml"
say <<'END'
`tandem fk` computes the tip's pose from three translations (m) and three rotations (rad). `tandem workspace` computes the volume that the tip reaches. The rotations
of this arm have no limits, so the volume is a solid of revolution. Its two percentages estimate the error of the volume: its change with half of the samples, and with
voxels of twice the size:
END
run 'echo -0.16,-0.11,-0.06,3.1416,1.5708,0.7854 | tandem fk --robot bench.yaml'
run 'tandem workspace --robot bench.yaml --samples 32768 --figures workspace --width 1 2>/dev/null'
cp workspace/workspace-section.png workspace.png
picture workspace 'Workspace of the tip: distance from the axis over depth'

say <<'END'
## 2. The task

A trajectory is a shape and a list of tasks. The only task here is that the tip of `left` follows a figure of eight:
END
run 'tandem new trajectory eight --arms 1'
run "sed -i 's/tip: a/tip: left/; s/circle: .*/lissajous: {amplitude_mm: [10, 5, 0], cycles: [1, 2, 0]}/; s/^speed_mm_per_s: 2/speed_mm_per_s: 4/' eight.yaml"
run 'tandem validate eight.yaml'
say <<'END'
`tandem plan check` computes whether the robot reaches every point. Then it simulates the control method on the trajectory (a *rehearsal*), with and without the joints of
the check as a posture, i.e. as preferred joints of the lowest priority. An iteration is one control period. The command needs no running system:
END
run 'tandem plan check eight.yaml --robot bench.yaml 2>/dev/null'
say <<'END'
`tandem show` describes and draws any of these files:
END
run 'tandem show eight.yaml --robot bench.yaml --figure show.png --width 1 2>/dev/null'
picture show 'The arm at home, what its tip reaches, and the path'

say <<'END'
## 3. The run

A deployment names the robot, the processes and the network:
END
run 'tandem new deployment lab --arms 1 --robot bench.yaml'
say <<'END'
`tandem up` starts simulator, control, planning, recorder and the operator's page. Leave it running, and type the other commands in a second terminal.
END
up lab.yaml
run -v 'tandem record lab.yaml --output eight.mcap --for 20 >record.log & tandem robot -d lab.yaml run eight.yaml; code=$?; wait; exit $code'
say <<'END'
`finished` means that every point was reached within the tolerance. A run that misses points reports them and exits with 1. Here the trajectory requires 100 mm/s of stages
whose limit is 5 mm/s:
END
run "sed 's/^name: .*/name: hasty/; s/^speed_mm_per_s: 4/speed_mm_per_s: 100/; s/^acceleration_mm_per_s2: 5/acceleration_mm_per_s2: 500/' eight.yaml >hasty.yaml"
run -v -x 1 'tandem robot -d lab.yaml run hasty.yaml'
say <<'END'
`tandem status` shows states, errors, loop statistics, and the result of the last run; `--follow` repeats it. Ctrl-C in the first terminal ends the system.
END
run -v 'tandem status lab.yaml | grep -v pid'
end

say <<'END'
## 4. The recording

`tandem info` lists the recorded topics. `tandem plot` draws the standard figures; `tandem export` writes tables for other programs, with the names of the robot file:
END
run 'tandem plot eight.mcap --figures recording --width 1'
cp recording/joints.png joints.png
picture joints 'Joints during the recording; the setpoints are dotted'
run 'tandem export eight.mcap --csv tables --topics control/status left/measured_js >/dev/null && ls tables && head -n 1 tables/left_measured_js.csv'

say <<'END'
## 5. The methods

An experiment runs trajectories with several methods; `--offline` computes it in one process, with the same digits in every run. In the table, `eps_AB` is the error of the
relative position (none with one arm), `eps_A` that of the tip, `converged` the points reached, `outside` the iterations after which a joint was outside a limit, and `gate`
the interventions of the setpoint gate, the last check before the drives:
END
run 'tandem new experiment study --arms 1 --robot bench.yaml'
run "sed -i 's/tip: a/tip: left/' study.yaml && tandem experiment study.yaml -d lab.yaml --offline --figures study --width 1 | sed '/^[0-9]* runs in /d'"
say <<'END'
One path proves little. `tandem montecarlo` runs random tasks, here with errors of the tubes' curvature that control's model does not have, and writes tables for a paper
(`methods.stats.csv`, `methods.stats.tex`). `no reach` are tasks out of reach that were refused or reported as not reached. The last lines compare the methods in pairs ([Monte Carlo](montecarlo.md)):
END
run "tandem montecarlo -d lab.yaml --tasks 40 --methods nspwln,nspqp,snsqp,hqp --curvature-error 5% --figure methods.png --width 1 2>/dev/null"
picture methods 'The methods on forty random tasks'

say <<'END'
## 6. Two arms

With two arms the relative position of the tips is the first task, and tasks name the arms as the robot file does:
END
run "tandem new robot pair && sed -i 's/arm_a/left/; s/arm_b/right/' pair.yaml && tandem validate pair.yaml | head -n 1"
run "tandem new trajectory side --from line && sed -i 's/^arm: a/tasks: [{relative: [right, left]}, {tip: right}]/; /^other_arm/d; /^# arm\|^# other_arm/d' side.yaml && tandem plan check side.yaml --robot pair.yaml 2>/dev/null"

say <<'END'
## 7. The same in Python

The plant (the simulated robot) of this run has compliant tubes with friction, which control's model does not have:
END
cat >friction.py <<'END'
import matplotlib.pyplot as plt
import tandem

robot, eight = tandem.Robot.load("bench.yaml"), tandem.Trajectory.load("eight.yaml")
figure, axes = plt.subplots(figsize=(3.4, 2.4), layout="constrained")
for friction in (0.0, 0.02, 0.05):
    run = tandem.run(robot, eight, "nspqp", period=0.025, plant={"model": "compliant", "tube_friction": friction})
    x, y, _ = 1e3 * run["tips"][:, 0].T
    axes.plot(x, y, label=f"$\\mu$ = {friction}")
    print(f"mu = {friction}: {run['iterations']} iterations, y from {y.min():.1f} to {y.max():.1f} mm")
axes.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False, fontsize=7)
figure.savefig("friction.png", dpi=200)
END
printf '\n```python\n%s\n```\n' "$(cat friction.py)"
run 'python3 friction.py'
picture friction 'Path of the tip for three coefficients of friction'

say <<'END'
Next: [hardware](hardware.md) for real drives, [planning](planning.md), [methods](methods.md), [Python](python.md), [all files and keys](configuration.md).
END
