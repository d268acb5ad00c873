# SPDX-License-Identifier: Apache-2.0
"""Fig. 7 of Norouzi-Ghazbi et al.: target-assist and co-manipulative catheters before and after a motion, computed by the program
`tandem` (docs/cooperative.md), which must be in PATH.

    PATH=build/release/bin:$PATH python3 python/examples/figure_7.py [FIGURE.png]"""
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "experiments"))
from style import ARMS, INCH, MM, WIDTHS, equal_space, legend_below, plt  # noqa: E402

RUNS = {"target-assist": ("--shape", "circle", "--along", "x,y"), "co-manipulate": ()}

figure = plt.figure(figsize=(WIDTHS[2] / INCH, 95 / INCH), layout="constrained")
for place, (robot, options) in enumerate(RUNS.items()):
    with tempfile.TemporaryDirectory() as folder:
        drawn = pathlib.Path(folder, "run.png")
        subprocess.run(["tandem", "cooperative", robot, "--offline", *options, "--figure", drawn], check=True,
                       stdout=subprocess.DEVNULL)
        shapes = np.genfromtxt(drawn.with_suffix(".shapes.csv"), delimiter=",", names=True)
        path = np.genfromtxt(drawn.with_suffix(".csv"), delimiter=",", names=True)
    axis = figure.add_subplot(1, 2, place + 1, projection="3d")
    for end, alpha in ((0, 0.35), (1, 1.0)):
        for arm in np.unique(shapes["arm"]):
            one = shapes[(shapes["end"] == end) & (shapes["arm"] == arm)]
            axis.plot(MM * one["x"], MM * one["y"], MM * one["z"], color=ARMS[int(arm)], linewidth=1.2, alpha=alpha,
                      label=f"arm {int(arm) + 1}, {'after' if end else 'before'}")
        if robot == "co-manipulate":  # the object spans its contacts, at the tips
            tips = [shapes[(shapes["end"] == end) & (shapes["arm"] == arm)][-1] for arm in np.unique(shapes["arm"])]
            axis.plot(*(MM * np.array([tip[name] for tip in tips]) for name in "xyz"), color=ARMS[3], linewidth=3, alpha=0.6 * alpha,
                      label="object, after" if end else "object, before")
    moved = path[path["time"] >= 0]
    axis.plot(MM * moved["x"], MM * moved["y"], MM * moved["z"], color="k", linewidth=1, label="path")
    equal_space(axis, MM * np.column_stack([np.concatenate([shapes[name], moved[name]]) for name in "xyz"]))
    axis.set_title(robot)
legend_below(figure, figure.axes[-1].get_legend_handles_labels()[0], 4)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "figure_7.png", dpi=200)
