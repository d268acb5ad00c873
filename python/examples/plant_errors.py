# SPDX-License-Identifier: Apache-2.0
"""What each error of the simulated plant does to a tip: an arm turns its innermost tube forth and back twice, and its tip is
compared with that of a plant without errors. Prints a table: largest error, and width of the loop: the largest distance between the
errors at equal angles on the way forth and back.

    PYTHONPATH=build/release/python python3 python/examples/plant_errors.py [FIGURE.png]"""
import pathlib
import sys

import numpy as np

import tandem

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "experiments"))
from style import ARMS, INCH, MM, WIDTHS, plt  # noqa: E402

ANGLE, QUARTER, PERIOD = np.pi / 2, 100, 0.1  # rad, steps of a quarter of the motion, s: at most 0.25 rad/s
LINES = ("-", (0, (4, 1.5)), (0, (1, 1)))
ERRORS = {  # panel: lines: keys of `plant`
    "bending and torsional stiffness": {"10 %": {"tube_deviation": {"bending_stiffness": 0.1, "torsional_stiffness": 0.1}}},
    "precurvature": {"5 %": {"tube_deviation": {"curvature": 0.05}}, "10 %": {"tube_deviation": {"curvature": 0.1}}},
    "length": {"0.3 %": {"tube_deviation": {"length": 0.003}}},
    "precurvature of straight sections": {"0.2/m": {"tube_deviation": {"residual_curvature_per_m": 0.2}},
                                          "1/m": {"tube_deviation": {"residual_curvature_per_m": 1}}},
    "friction between tubes": {"µ = 0.02": {"tube_friction": 0.02}, "µ = 0.05": {"tube_friction": 0.05}, "µ = 0.1": {"tube_friction": 0.1}},
    "clearance": {"0.05 mm": {"tube_clearance_mm": 0.05}, "0.2 mm": {"tube_clearance_mm": 0.2}},
    "ovality": {"0.05 mm": {"tube_ovality_mm": 0.05}},
    "backlash": {"1.7°": {"motors": {"backlash_rotation_deg": 1.7}}, "5°": {"motors": {"backlash_rotation_deg": 5}}},
    "delay and lag of motors": {"0.1 s": {"motors": {"delay_ms": 100, "lag_rotation_ms": 100}}},
    "encoders": {"noise 0.57°": {"encoders": {"noise_rotation_deg": 0.57}}},
    "force on the tip": {"50 mN": {"tip_forces": [{"arm": "arm_a", "force_N": [0.05, 0, 0]}]}},
    "tracker": {"noise 0.1 mm, bias 0.2 mm": {"tracker": {"rate_Hz": 1 / PERIOD, "position_noise_mm": 0.1, "bias_mm": [0.2, 0, 0]}},
                "distortion 1 mm": {"tracker": {"rate_Hz": 1 / PERIOD, "distortion_mm": 1}}},
}

robot = tandem.Robot.load("ark2024")
arm = robot.arm("a", model="compliant")
start = robot.home.copy()
start[:3] = -0.200, -0.100, -0.050  # curved parts of 50 mm, one behind the other: an arm of 0.24 m
turn = arm.tube_count  # rotation of the innermost tube
# A quarter to reach the first end, then forth and back twice.
angles = ANGLE * np.concatenate([np.linspace(0, 1, QUARTER), *[np.linspace(1, -1, 2 * QUARTER), np.linspace(-1, 1, 2 * QUARTER)] * 2])
speeds = np.diff(angles, prepend=0.0) / PERIOD


def tips(name, plant):
    """Positions of tip A over the motion, mm: true; with encoders, of the model at their readings; with a tracker, as measured."""
    simulator, positions = tandem.Simulator(robot, start, model="compliant", period=PERIOD, plant=plant), []
    velocity = np.zeros(robot.joint_count)
    for speed in speeds:
        velocity[turn] = speed
        simulator.step(velocity)
        if name == "tracker":
            positions.append(simulator.measured_tips["arm_a"][:3, 3])
        elif name == "encoders":
            positions.append(arm.forward(simulator.joints[:2 * arm.tube_count])[:3, 3])
        else:
            positions.append(simulator.tips["arm_a"][:3, 3])
    return MM * np.array(positions)


exact = tips("", {})
figure, panels = plt.subplots(4, 3, figsize=(WIDTHS[2] / INCH, 190 / INCH), sharex=True, layout="constrained")
print("| error | size | largest, mm | loop, mm |\n|---|---|---|---|")
for (name, lines), axis in zip(ERRORS.items(), panels.flat):
    for (size, plant), colour, dashes in zip(lines.items(), (ARMS[0], ARMS[1], ARMS[2]), LINES):
        error = tips(name, plant) - exact
        distance = np.linalg.norm(error, axis=1)
        last = error[-4 * QUARTER:]  # the second round: the first one starts without wind-up
        forth, back = last[:2 * QUARTER], last[2 * QUARTER:][::-1]
        loop = np.linalg.norm(forth - back, axis=1).max()
        axis.plot(np.degrees(angles[QUARTER:]), distance[QUARTER:], color=colour, linestyle=dashes, label=size)
        print(f"| {name} | {size} | {distance.max():.2f} | {loop:.2f} |")
    axis.set_title(name)
    axis.set_ylim(0, 1.25 * axis.get_ylim()[1])
    axis.legend(loc="best", handlelength=2)
for axis in panels[-1]:
    axis.set_xlabel("rotation of tube 1 (°)")
    axis.set_xticks([-90, -45, 0, 45, 90])
for axis in panels[:, 0]:
    axis.set_ylabel("error of the tip (mm)")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "plant_errors.png", dpi=200)
