# SPDX-License-Identifier: Apache-2.0
"""Fig. 2 of Alsaka et al. 2024: translations of both arms between their moving limits, here over the Lissajous of configuration 2.

    PYTHONPATH=build/release/python python3 python/examples/figure_2.py [FIGURE.png]"""
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

import tandem  # noqa: E402

METHODS = ("nspwln", "nspqp", "snsqp")

robot = tandem.Robot.load("ark2024")
tubes = robot.arm("a").tube_count
figure, rows = plt.subplots(2 * tubes, len(METHODS), figsize=(11, 12), sharex="col", sharey="row", layout="constrained")
for column, method in enumerate(METHODS):
    run = tandem.run(robot, tandem.Trajectory.load("lissajous"), method)
    for row in range(2 * tubes):
        arm, tube = divmod(row, tubes)
        joint, axis = 2 * tubes * arm + tube, rows[row, column]
        axis.plot(1e3 * run["joints"][:, joint], label="translation")
        axis.plot(1e3 * run["moving_lower"][:, joint], "c:", label="lower limit")
        axis.plot(1e3 * run["moving_upper"][:, joint], "r:", label="upper limit")
        axis.set_ylabel(f"β{tube + 1} of {robot.arms[arm]}, mm" if column == 0 else "")
    rows[0, column].set_title(f"{method}: {run['iterations']} iterations")
    rows[-1, column].set_xlabel("iteration")
rows[0, 0].legend()
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "figure_2.png", dpi=150)
