# SPDX-License-Identifier: Apache-2.0
"""Workspace of both arms of Alsaka et al. 2024 inside equation (1), and the margin to elastic instability in it, which the paper does
not cover: tips of random joints by the compliant model.

    PYTHONPATH=build/release/python python3 python/examples/workspace.py [FIGURE.png [SAMPLES]]"""
import pathlib
import sys

import numpy as np

import tandem

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "experiments"))
from style import INCH, MM, WIDTHS, legend_below, plt  # noqa: E402

robot = tandem.Robot.load("ark2024")
samples = int(sys.argv[2]) if len(sys.argv) > 2 else 5000
figure, axes = plt.subplots(1, 3, figsize=(WIDTHS[2] / INCH, 75 / INCH), layout="constrained", width_ratios=(1, 1, 2))
for name, marker in zip(robot.arms, ("o", "^")):
    arm = robot.arm(name, model="compliant")
    q = arm.sample(samples, seed=3)
    tips, least = MM * arm.forward(q, errors="nan")[:, :3, 3], arm.stability(q, errors="nan")
    for axis, (across, up) in zip(axes, ((0, 2), (1, 2), (0, 1))):
        dots = axis.scatter(tips[:, across], tips[:, up], c=least, s=2, marker=marker, cmap="viridis", vmin=0, vmax=1, label=name)
        axis.set(xlabel=f"{'xyz'[across]} (mm)", ylabel=f"{'xyz'[up]} (mm)", aspect="equal")
    print(f"{name}: tips from {np.nanmin(tips, axis=0).round()} to {np.nanmax(tips, axis=0).round()} mm; "
          f"least stability {np.nanmin(least):.3f}")
legend_below(figure, axes[0].get_legend_handles_labels()[0], 2)
figure.colorbar(dots, ax=axes, label="stability: 0 where the arm snaps")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "workspace.png", dpi=200)
