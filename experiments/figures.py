# SPDX-License-Identifier: Apache-2.0
"""Draws the runs of an experiment from its CSV files (docs/csv.md).

    figures.py CSVDIR FIGDIR

For each trajectory and configuration named in CSVDIR/summary.csv, three PNG files in FIGDIR, listed on standard output:

    path-TRAJECTORY-CONFIGURATION.png        the target path, coloured by the error with which each point was left
    actuation-TRAJECTORY-CONFIGURATION.png   translations with their moving limits, as in Fig. 2 of Alsaka et al. 2024
    errors-TRAJECTORY-CONFIGURATION.png      both errors along the trajectory

Ends with 1 where a file is missing or is not of this format, with 2 where the command line is wrong.
"""

import csv
import multiprocessing
import os
import pathlib
import re
import sys
import time

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.lines import Line2D

matplotlib.use("Agg")

# distinguished by colour-blind readers too (after Okabe and Ito): colour, style and width of each method. What often
# coincides, nspqp and snsqp, is a broad line under a narrow one.
METHOD_STYLE = {
    "nsp": ("#999999", ":", 1.6),
    "nspwln": ("#D55E00", "-", 1.6),
    "nspwln-joint": ("#009E73", "-.", 1.6),
    "nspqp": ("#56B4E9", "-", 3.4),
    "snsqp": ("#000000", "--", 1.2),
    "sns": ("#009E73", "-.", 1.2),
    "hqp": ("#D55E00", "--", 2.0),
}
OTHER_METHOD = ("#CC79A7", "-", 1.6)
TUBES = ["#000000", "#0072B2", "#E69F00", "#999999"]
UPPER = {"color": "#E31A1C", "linewidth": 1.0}  # red and cyan, as in the paper
LOWER = {"color": "#40E0F0", "linewidth": 1.0, "dashes": (4, 4)}
SMALLEST = 1e-4  # mm; errors below are drawn here
MM = 1e3

plt.rcParams.update({"figure.dpi": 110, "font.size": 9, "axes.grid": True, "grid.color": "#E0E0E0",
                     "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False})


class Failure(Exception):
    """A file that is missing or not of the format."""


def read_csv(path):
    """Columns of a CSV file by name, as lists of text."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise Failure(f"{path}: {error.strerror}") from error
    if not rows:
        raise Failure(f"{path}: has no rows")
    return {name: [row[name] for row in rows] for name in rows[0]}


class Run:
    """One file of rows: all columns as arrays, SI; `last` picks each point's last iteration."""

    def __init__(self, path):
        try:
            self.column = {name: np.array([float(x) if x else np.nan for x in values])
                           for name, values in read_csv(path).items()}
            self.point = self.column["point"].astype(int)
        except (KeyError, TypeError, ValueError) as error:
            raise Failure(f"{path}: not a run's CSV file: {error}") from error
        self.last = np.append(self.point[1:] != self.point[:-1], True)
        count = np.bincount(self.point)[self.point]
        # Iterations of a point, spread over it: methods with different numbers of them stay side by side.
        self.progress = self.point - 1 + self.column["iteration"] / count

    def target(self):
        """Targets of the points relative to the first one, n x 3, mm."""
        points = np.stack([self.column[f"target_{axis}"][self.last] for axis in "xyz"], axis=1)
        return MM * (points - points[0])

    def tubes(self):
        """Names of the translations by arm: {"a": ["a1", "a2", "a3"], ...}."""
        arms = {}
        for name in self.column:
            match = re.fullmatch(r"beta_(.*?)(\d+)", name)
            if match:
                arms.setdefault(match.group(1), []).append(match.group(1) + match.group(2))
        return arms


def method_order(method):
    names = list(METHOD_STYLE)
    return names.index(method) if method in names else len(names)


def legend_below(figure, handles):
    """One row of legend under all axes."""
    height = 0.3 / figure.get_figheight()
    figure.get_layout_engine().set(rect=(0, height, 1, 1 - height))
    figure.legend(handles=handles, loc="lower center", ncol=len(handles), frameon=False)


def draw_path(title, runs):
    """The target path per method, coloured by epsilon_A (top) and epsilon_AB (bottom)."""
    first = next(iter(runs.values()))
    spread = np.ptp(first.target(), axis=0)
    horizontal, vertical = sorted(np.argsort(spread)[-2:])
    figure, axes = plt.subplots(2, len(runs), figsize=(2.9 * len(runs) + 1.4, 6.2), squeeze=False, sharex=True,
                                sharey=True, layout="constrained")
    figure.suptitle(f"{title}: target path of robot A's tip, coloured by the error with which each point was left")
    for row, (column, label, norm) in enumerate([("err_a", r"$\epsilon_A$ (mm)", Normalize),
                                                 ("err_ab", r"$\epsilon_{AB}$ (mm)", LogNorm)]):
        values = {m: np.maximum(MM * run.column[column][run.last], SMALLEST) for m, run in runs.items()}
        smallest = min(v.min() for v in values.values())
        largest = max(v.max() for v in values.values())
        scale = norm(vmin=smallest, vmax=max(largest, 1.01 * smallest))
        for ax, (method, run) in zip(axes[row], runs.items()):
            path = run.target()
            ax.plot(path[:, horizontal], path[:, vertical], color="#B0B0B0", linewidth=0.8, zorder=1)
            dots = ax.scatter(path[:, horizontal], path[:, vertical], c=values[method], norm=scale, cmap="viridis",
                              s=18, zorder=2)
            ax.scatter(*path[0, [horizontal, vertical]], marker="s", s=55, facecolor="none", edgecolor="black",
                       zorder=3)
            ax.set_aspect("equal", adjustable="box")
            if row == 0:
                ax.set_title(f"{method}, {len(run.point)} iterations")
            else:
                ax.set_xlabel(f"{'xyz'[horizontal]} from the first point (mm)")
        axes[row, 0].set_ylabel(f"{'xyz'[vertical]} (mm)")
        figure.colorbar(dots, ax=axes[row], label=label, pad=0.01)
    return figure


def draw_actuation(title, runs):
    """Translations of all arms over the points, with their moving limits; a row a method."""
    arms = next(iter(runs.values())).tubes()
    figure, axes = plt.subplots(len(runs), len(arms), figsize=(5.6 * len(arms), 2.3 * len(runs) + 1.1), squeeze=False,
                                sharex=True, sharey="col", layout="constrained")
    figure.suptitle(f"{title}: translations and their moving limits, equation (1)")
    for row, (method, run) in zip(axes, runs.items()):
        point = run.point[run.last]
        for ax, (arm, tubes) in zip(row, arms.items()):
            for tube, color in zip(tubes, TUBES):
                at = {kind: MM * run.column[f"{kind}_{tube}"][run.last] for kind in ("beta", "lower", "upper")}
                ax.plot(point, at["beta"], color=color, linewidth=3.4, zorder=2)
                # Thin and on top: a tube is the upper limit of the next inner one and the lower one of the next outer.
                ax.plot(point, at["upper"], zorder=3, **UPPER)
                ax.plot(point, at["lower"], zorder=4, **LOWER)
            ax.set_title(f"{method}, robot {arm.upper()}", fontsize=9)
            ax.set_xlim(point[0], point[-1])
        row[0].set_ylabel(r"$\beta$ (mm)")
    for ax in axes[-1]:
        ax.set_xlabel("trajectory point")
    tube_count = max(len(tubes) for tubes in arms.values())
    handles = [Line2D([], [], color=color, linewidth=3.4, label=rf"$\beta_{i + 1}$, tube {i + 1}")
               for i, color in enumerate(TUBES[:tube_count])]
    handles += [Line2D([], [], label="upper limit of a tube", **UPPER), Line2D([], [], label="lower limit", **LOWER)]
    legend_below(figure, handles)
    return figure


def draw_errors(title, runs):
    """Both errors of all methods: thin at every iteration, thick where each point was left."""
    figure, axes = plt.subplots(2, 1, figsize=(10, 6.4), sharex=True, layout="constrained")
    figure.suptitle(f"{title}: errors; thin: every iteration, thick: each point's last one, which the table counts")
    for method, run in runs.items():
        color, style, width = METHOD_STYLE.get(method, OTHER_METHOD)
        for ax, name in zip(axes, ("err_ab", "err_a")):
            error = np.maximum(MM * run.column[name], SMALLEST)
            ax.plot(run.progress, error, color=color, linewidth=0.5, alpha=0.4)
            ax.plot(run.point[run.last], error[run.last], color=color, linestyle=style, linewidth=width, label=method)
    axes[0].set_yscale("log")
    axes[0].set_ylabel(rf"relative position $\epsilon_{{AB}}$ (mm, from {SMALLEST:g} up)")
    axes[1].set_ylabel(r"tip of robot A $\epsilon_A$ (mm)")
    axes[1].set_ylim(bottom=0)
    axes[1].set_xlabel("trajectory point")
    axes[1].set_xlim(0, max(run.point[-1] for run in runs.values()))
    legend_below(figure, axes[0].get_legend_handles_labels()[0])
    return figure


def groups(folder):
    """{(trajectory, configuration): {method: file}} of summary.csv, in its order."""
    summary = read_csv(folder / "summary.csv")
    found = {}
    try:
        for key in zip(summary["trajectory"], summary["configuration"], summary["method"]):
            found.setdefault(key[:2], {})[key[2]] = folder / ("-".join(key) + ".csv")
    except KeyError as error:
        raise Failure(f"{folder / 'summary.csv'}: has no column {error}") from error
    return found


def draw_group(job):
    """All figures of one trajectory and configuration; the files written."""
    (trajectory, configuration), files, target = job
    runs = {method: Run(files[method]) for method in sorted(files, key=method_order)}
    written = []
    for kind, draw in (("path", draw_path), ("actuation", draw_actuation), ("errors", draw_errors)):
        figure = draw(f"{trajectory}, configuration {configuration}", runs)
        written.append(target / f"{kind}-{trajectory}-{configuration}.png")
        figure.savefig(written[-1])
        plt.close(figure)
    return written


def progress(start, done, total):
    """One line, rewritten in place; only on a terminal, and only once it has taken longer than 2 s."""
    if sys.stderr.isatty() and time.monotonic() - start > 2.0:
        print(f"\rfigures: {done} of {total} ", end="\n" if done == total else "", file=sys.stderr, flush=True)


def main():
    if len(sys.argv) != 3 or sys.argv[1].startswith("-"):
        print(__doc__.strip(), file=sys.stderr)
        return 0 if sys.argv[1:] in (["--help"], ["-h"]) else 2
    source, target = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    start, written = time.monotonic(), []
    try:
        jobs = [(key, files, target) for key, files in groups(source).items()]
        target.mkdir(parents=True, exist_ok=True)
        with multiprocessing.Pool(min(len(jobs), len(os.sched_getaffinity(0)))) as pool:
            for files in pool.imap(draw_group, jobs):
                written += files
                progress(start, len(written), 3 * len(jobs))
    except Failure as failure:
        print(f"figures.py: {failure}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"figures.py: {error.filename or target}: {error.strerror}", file=sys.stderr)
        return 1
    for path in written:
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
