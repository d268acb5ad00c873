# SPDX-License-Identifier: Apache-2.0
"""Fig. 2 of Alsaka et al. 2024: translations of both arms between their moving limits, here over the Lissajous of configuration 2.

    PYTHONPATH=build/release/python python3 python/examples/figure_2.py [FIGURE.png]"""
import pathlib
import sys

import tandem

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "experiments"))
from style import INCH, MM, WIDTHS, legend_below, plt  # noqa: E402

METHODS = ("nspwln", "nspqp", "snsqp")

robot = tandem.Robot.load("ark2024")
tubes = robot.arm("a").tube_count
size = (WIDTHS[2] / INCH, 170 / INCH)
figure, rows = plt.subplots(2 * tubes, len(METHODS), figsize=size, sharex="col", sharey="row", layout="constrained")
for column, method in enumerate(METHODS):
    run = tandem.run(robot, tandem.Trajectory.load("lissajous"), method)
    for row in range(2 * tubes):
        arm, tube = divmod(row, tubes)
        joint, axis = 2 * tubes * arm + tube, rows[row, column]
        axis.plot(MM * run["joints"][:, joint], color="black", label="translation")
        axis.plot(MM * run["moving_lower"][:, joint], ":", color="#0072B2", label="lower limit")
        axis.plot(MM * run["moving_upper"][:, joint], ":", color="#D55E00", label="upper limit")
        axis.set_ylabel(f"β{tube + 1} of {robot.arms[arm]} (mm)" if column == 0 else "")
    rows[0, column].set_title(f"{method}: {run['iterations']} iterations")
    rows[-1, column].set_xlabel("iteration")
legend_below(figure, rows[0, 0].get_legend_handles_labels()[0], 3)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "figure_2.png", dpi=200)
