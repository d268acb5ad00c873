# SPDX-License-Identifier: Apache-2.0
"""Both arms passing a needle: shafts, tip positions and tip axes over the path of the preset needle-passing, and below it the distance
of the tips and the errors of the three tasks.

    PYTHONPATH=build/release/python python3 python/examples/needle_passing.py [FIGURE.png]"""
import pathlib
import sys

import numpy as np

import tandem

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "experiments"))
from style import ARMS, INCH, MM, WIDTHS, legend_below, plt  # noqa: E402

# Start of the experiment needle-passing: mm and degrees of each arm.
START = ((-248.2, -142.6, -72.1, -173.5, 85.7, 117.1), (-245.8, -195.5, -104.8, 70.8, -42.6, 170.8))
STEPS = 7  # drawn arms
ARROW = 3.5  # mm

robot = tandem.Robot.load("ark2024")
start = np.concatenate([np.r_[np.array(q[:3]) / MM, np.radians(q[3:])] for q in START])
run = tandem.run(robot, tandem.Trajectory.load("needle-passing"), "nspqp", start=start)
joints = np.vstack([start, run["joints"]])
arms = [(robot.arm(name), joints[:, 6 * k:6 * k + 6]) for k, name in enumerate(robot.arms)]
poses = [np.asarray(arm.forward(q)) for arm, q in arms]
distance = MM * np.linalg.norm(poses[0][:, :3, 3] - poses[1][:, :3, 3], axis=1)
between = np.swapaxes(poses[1][:, :3, :3], 1, 2) @ poses[0][:, :3, :3]
cosine = (np.einsum("nij,ij->n", between, between[0]) - 1) / 2
turned = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
clearance = tandem.Planner(robot).clearance
near = MM * np.array([next(iter(clearance(q).values()))[0] for q in joints])

figure = plt.figure(figsize=(WIDTHS[2] / INCH, 150 / INCH), layout="constrained")
rows = figure.add_gridspec(2, 2, height_ratios=(2.2, 1))
shown = np.linspace(0, len(joints) - 1, STEPS).astype(int)
passing = int(np.argmin(distance))
for column, (x, y) in enumerate(((1, 2), (0, 2))):
    axis = figure.add_subplot(rows[0, column], aspect="equal", adjustable="datalim")
    for (arm, q), pose, color, name in zip(arms, poses, ARMS, robot.arms):
        for step in shown:
            shape = MM * np.asarray(arm.shape(q[step], 60))[..., :3]
            axis.plot(shape[:, x], shape[:, y], color=color, linewidth=0.7, alpha=0.3)
        tips = MM * pose[:, :3, 3]
        axis.plot(tips[:, x], tips[:, y], color=color, label=f"tip of {name}")
        axis.quiver(tips[shown, x], tips[shown, y], ARROW * pose[shown, x, 2], ARROW * pose[shown, y, 2], color=color, angles="xy",
                    scale_units="xy", scale=1, width=0.006, zorder=3)
    ends = np.array([MM * pose[passing, :3, 3] for pose in poses])
    axis.plot(ends[:, x], ends[:, y], color="black", linewidth=2, zorder=4, label="needle where it is passed")
    low = min((MM * pose[:, 2, 3]).min() for pose in poses)
    axis.set(xlabel=f"{'xyz'[x]} (mm)", ylabel="z (mm)", ylim=(low - 14, low + 16))
    if column == 0:
        handles = axis.get_legend_handles_labels()[0]
axis = figure.add_subplot(rows[1, 0])
axis.plot(distance, color="black", label="distance of the tips")
axis.plot(near, "--", color="#009E73", label="clearance of the arms")
axis.set(xlabel="control period", ylabel="mm", ylim=(0, 28))
axis.legend()
axis = figure.add_subplot(rows[1, 1])
axis.plot(MM * run["relative_error"], color=ARMS[2], label="relative position, mm")
axis.plot(MM * run["tip_error"], color=ARMS[0], label=f"tip of {robot.arms[0]}, mm")
axis.plot(turned, color=ARMS[1], label="relative orientation, degrees")
axis.set(xlabel="control period", ylabel="error", ylim=(0, 0.6))
axis.legend()
legend_below(figure, handles, 3)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "needle_passing.png", dpi=200)
print(f"tips {distance.min():.2f} mm apart where the needle is passed, clearance {near.min():.2f} mm; errors at most "
      f"{MM * run['relative_error'].max():.3f} mm, {MM * run['tip_error'].max():.3f} mm, {turned.max():.2f} degrees")
