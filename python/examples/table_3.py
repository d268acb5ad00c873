# SPDX-License-Identifier: Apache-2.0
"""Data summarised in Table 3 of Alsaka et al. 2024: errors of both tasks over the points of a path, for every method, from start
configuration 2 of Table 2. As numbers: `tandem experiment table3`.

    PYTHONPATH=build/release/python python3 python/examples/table_3.py [FIGURE.png]"""
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

import tandem  # noqa: E402

METHODS = ("nspwln", "nspwln-joint", "nspqp", "snsqp", "hqp")

robot = tandem.Robot.load("ark2024")
figure, rows = plt.subplots(2, 2, figsize=(11, 6), sharex="col", sharey="row", layout="constrained")
for column, path in enumerate(("rectangle", "lissajous")):
    trajectory = tandem.Trajectory.load(path)
    for method in METHODS:
        run = tandem.run(robot, trajectory, method)
        for axis, error in zip(rows[:, column], ("relative_error", "tip_error")):
            axis.semilogy(1e3 * run[error], linewidth=1, label=f"{method}: {run['iterations']}")
    rows[1, column].axhline(1e3 * trajectory.tolerance, color="k", linestyle=":", label="tolerance")
    rows[0, column].set_title(path)
    rows[0, column].legend(title="iterations", fontsize=8)
    rows[1, column].set_xlabel("iteration")
rows[0, 0].set(ylabel="error of the relative position, mm", ylim=(1e-4, 2))
rows[1, 0].set(ylabel="error of tip A, mm", ylim=(1e-2, 2))
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "table_3.png", dpi=150)
