# SPDX-License-Identifier: Apache-2.0
"""Fig. 7 of Norouzi-Ghazbi et al.: target-assist and co-manipulative catheters before and after a motion, computed by the program
`tandem` (docs/cooperative.md), which must be in PATH.

    PATH=build/release/bin:$PATH python3 python/examples/figure_7.py [FIGURE.png]"""
import pathlib
import subprocess
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

RUNS = {"target-assist": ("--shape", "circle", "--along", "x,y"), "co-manipulate": ()}

figure = plt.figure(figsize=(11, 5), layout="constrained")
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
            axis.plot(1e3 * one["x"], 1e3 * one["y"], 1e3 * one["z"], color=f"C{int(arm)}", linewidth=2, alpha=alpha,
                      label=f"arm {int(arm) + 1}, {'after' if end else 'before'}")
        if robot == "co-manipulate":  # the object spans its contacts, at the tips
            tips = [shapes[(shapes["end"] == end) & (shapes["arm"] == arm)][-1] for arm in np.unique(shapes["arm"])]
            axis.plot(*(1e3 * np.array([tip[name] for tip in tips]) for name in "xyz"), color="tab:purple", linewidth=5, alpha=0.6 * alpha,
                      label="object, after" if end else "object, before")
    moved = path[path["time"] >= 0]
    axis.plot(1e3 * moved["x"], 1e3 * moved["y"], 1e3 * moved["z"], color="k", linewidth=1, label="path")
    extent = np.array([np.ptp(shapes[name]) for name in "xyz"])
    axis.set_box_aspect(np.maximum(extent, 0.2 * extent.max()), zoom=0.8)
    axis.locator_params(axis="y", nbins=2)
    axis.set(title=robot, xlabel="x, mm", ylabel="y, mm", zlabel="z, mm")
    axis.legend(fontsize=7)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "figure_7.png", dpi=150)
