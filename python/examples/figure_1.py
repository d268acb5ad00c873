# SPDX-License-Identifier: Apache-2.0
"""Fig. 1 of Alsaka et al. 2024, with numbers: both arms in the three start configurations of Table 2, their tubes, and the paths of tip A
that the text describes.

    PYTHONPATH=build/release/python python3 python/examples/figure_1.py [FIGURE.png]"""
import pathlib
import sys

import numpy as np

import tandem

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "experiments"))
from style import ARMS, INCH, MM, WIDTHS, equal_space, legend_below, plt  # noqa: E402

# Table 2: beta_1..3 in mm and alpha_1..3 in degrees, of arms a and b.
TABLE_2 = (((-100, -80, -50, 45, 45, 45), (-80, -60, -30, 45, 45, 45)),
           ((-150, -100, -50, 180, 90, 45), (-130, -120, -100, 90, -60, -270)),
           ((-250, -200, -120, 0, 0, 0), (-250, -200, -120, 0, 0, 0)))

robot = tandem.Robot.load("ark2024")
figure = plt.figure(figsize=(WIDTHS[2] / INCH, 105 / INCH), layout="constrained")
for place, configuration in enumerate(TABLE_2):
    axis = figure.add_subplot(1, 3, place + 1, projection="3d")
    tips, drawn = [], []
    for name, colour, row in zip(robot.arms, ARMS, configuration):
        arm = robot.arm(name)
        q = np.concatenate([1e-3 * np.array(row[:3]), np.deg2rad(row[3:])])
        points = arm.shape(q, 200)
        along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        ends = along[-1] - (q[0] - arm.lower[0]) + (q[:3] - arm.lower[:3])  # arc lengths: the length of a tube is its greatest retraction
        for tube, (end, width) in enumerate(zip(ends, (0.8, 1.8, 3.0))):
            axis.plot(*(MM * points[along <= end + 1e-9].T), color=colour, linewidth=width, alpha=0.5, label=f"{name}, tube {tube + 1}")
        tips.append(arm.forward(q)[:3, 3])
        drawn.append(points)
    for path in "rectangle", "lissajous":
        drawn.append(tandem.Trajectory.load(path).points(tips[0], tips[0] - tips[1])[0])
        axis.plot(*(MM * drawn[-1].T), color="black", linewidth=0.8, linestyle="-" if path == "lissajous" else "--", label=path)
    equal_space(axis, MM * np.concatenate(drawn))
    axis.set_title(f"configuration {place + 1}")
legend_below(figure, figure.axes[0].get_legend_handles_labels()[0], 4)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "figure_1.png", dpi=200)
