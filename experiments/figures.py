# SPDX-License-Identifier: Apache-2.0
"""Figures of the runs of an experiment from its CSV files (docs/csv.md).

    figures.py CSVDIR FIGDIR [--format png|pdf|svg] [--dpi N] [--width 1|2]

For each trajectory and configuration named in CSVDIR/summary.csv, five files in FIGDIR, listed on standard output:

    path-TRAJECTORY-CONFIGURATION        path of the tip beside the target, a panel a method (not of files without tips)
    actuation-TRAJECTORY-CONFIGURATION   translations with their moving limits, as in Fig. 2 of Alsaka et al. 2024
    gaps-TRAJECTORY-CONFIGURATION        distance of each translation from its nearer moving limit
    steps-TRAJECTORY-CONFIGURATION       velocities: displacement of each translation in each control period
    errors-TRAJECTORY-CONFIGURATION      errors along the trajectory, of the relative position if it is a task and of the tip

Ends with 1 where a file is missing or is not of this format, with 2 where the command line is wrong.
"""

import argparse
import functools
import multiprocessing
import os
import pathlib
import re
import sys
import time

import numpy as np
from matplotlib.lines import Line2D
from style import (FLOOR, MM, TUBES, WIDTHS, add_options, legend_below, line_style, log_axis, method_order, method_style,
                   plt, read_csv, reason, run, signed_log_axis, wrong_file)

UPPER = {"color": "#E31A1C", "linewidth": 0.7}  # red and cyan, as in the paper
LOWER = {"color": "#40E0F0", "linewidth": 0.7, "dashes": (4, 4)}
GAP = 0.1  # mm; gaps are linear below it and logarithmic above


class Run:
    """One file of rows: all columns as arrays, SI; `last` picks each point's last iteration."""

    def __init__(self, path):
        try:
            self.column = {name: np.array([float(x) if x else np.nan for x in values])
                           for name, values in read_csv(path).items()}
            self.point = self.column["point"].astype(int)
        except (KeyError, TypeError, ValueError) as error:
            raise wrong_file(path, reason(error), "tandem experiment --csv") from error
        self.last = np.append(self.point[1:] != self.point[:-1], True)
        count = np.bincount(self.point)[self.point]
        # Iterations of a point, spread over it: methods with different numbers of them stay side by side.
        self.progress = self.point - 1 + self.column["iteration"] / count

    def places(self, what):
        """Positions of the points' last iterations, n x 3, mm. @param what  target or tip"""
        return MM * np.stack([self.column[f"{what}_{axis}"][self.last] for axis in "xyz"], axis=1)

    def tubes(self):
        """Names of the translations by arm: {"a": ["a1", "a2", "a3"], ...}."""
        arms = {}
        for name in self.column:
            match = re.fullmatch(r"beta_(.*?)(\d+)", name)
            if match:
                arms.setdefault(match.group(1).rstrip("_"), []).append(match.group(1) + match.group(2))
        return arms

    def errors(self):
        """Labels of the tasks' errors by column; the paper's where the arms are a and b. Without a relative position its error is 0."""
        paper = set(self.tubes()) == {"a", "b"}
        labels = {"err_ab": r"relative position, $\epsilon_{AB}$ (mm)" if paper else "relative position (mm)",
                  "err_a": r"tip of arm A, $\epsilon_A$ (mm)" if paper else "tip (mm)"}
        return labels if self.column["err_ab"].any() else {"err_a": labels["err_a"]}


def draw_path(sheet, runs):
    """The path of the tip beside the target, a panel a method."""
    first = next(iter(runs.values()))
    origin = first.places("target")[0]
    spread = np.ptp(first.places("target"), axis=0)
    horizontal, vertical = sorted(np.argsort(spread)[-2:])
    across = sheet.beside(len(runs), 4)
    down = -(-len(runs) // across)
    width, height = WIDTHS[sheet.columns], 12 + 52 * down  # mm
    figure, axes = plt.subplots(down, across, figsize=sheet.size(height), squeeze=False, sharex=True, sharey=True,
                                gridspec_kw={"left": 12 / width, "right": 1 - 3 / width, "bottom": 19 / height, "top": 1 - 6 / height,
                                             "wspace": 0.12, "hspace": 0.42})
    target = {"color": "#FF00FF", "linewidth": 0.6, "marker": ".", "markersize": 1.6}
    for ax, (method, record) in zip(axes.ravel(), runs.items()):
        for what, style in (("target", target), ("tip", {"color": method_style(method)["color"], "linewidth": 1.1})):
            path = record.places(what) - origin
            ax.plot(path[:, horizontal], path[:, vertical], **style)
        ax.set_aspect("equal", adjustable="box")
        ax.set_title(f"{method}, {len(record.point)} iterations")
        ax.xaxis.set_major_locator(plt.MaxNLocator(4))
        ax.yaxis.set_major_locator(plt.MaxNLocator(6))
    for unused in axes.ravel()[len(runs):]:
        unused.set_visible(False)
    for column in range(across):
        lowest = axes[(len(runs) - 1 - column) // across, column]
        lowest.set_xlabel(f"{'xyz'[horizontal]} from first target (mm)")
        lowest.tick_params(labelbottom=True)
    for ax in axes[:, 0]:
        ax.set_ylabel(f"{'xyz'[vertical]} (mm)")
    figure.legend(handles=[Line2D([], [], label="targets", **target),
                           Line2D([], [], color="#8C8C8C", linewidth=1.1, label="tip where each point was left")],
                  loc="lower center", ncol=2, borderaxespad=0.2)
    return figure


def tube_grid(sheet, runs, height, sharey):
    """A panel for each method (row) and arm (column). @return figure, [(axes, run, names of the tubes)]"""
    arms = next(iter(runs.values())).tubes()
    figure, axes = plt.subplots(len(runs), len(arms), figsize=sheet.size(height * len(runs) + 14), squeeze=False, sharex=True,
                                sharey=sharey, layout="constrained")
    panels = []
    for row, (method, record) in zip(axes, runs.items()):
        for ax, (arm, tubes) in zip(row, arms.items()):
            panels.append((ax, record, tubes))
            ax.set_title(f"{method}, arm {arm.upper() if len(arm) == 1 else arm}")
            ax.set_xlim(0, max(record.point[-1] for record in runs.values()))
            ax.xaxis.set_major_locator(plt.MaxNLocator(5))
    for ax in axes[-1]:
        ax.set_xlabel("trajectory point")
    return figure, panels


def tube_handles(panels, width):
    count = max(len(tubes) for _, _, tubes in panels)
    return [Line2D([], [], color=color, linewidth=width, label=f"tube {i + 1}") for i, color in enumerate(TUBES[:count])]


def draw_actuation(sheet, runs):
    """Translations of all arms over the points, with their moving limits."""
    figure, panels = tube_grid(sheet, runs, 27, "col")
    for ax, record, tubes in panels:
        point = record.point[record.last]
        for tube, color in zip(tubes, TUBES):
            at = {kind: MM * record.column[f"{kind}_{tube}"][record.last] for kind in ("beta", "lower", "upper")}
            ax.plot(point, at["beta"], color=color, linewidth=2.2, zorder=2)
            # Thin and on top: a tube is the upper limit of the next inner one and the lower one of the next outer.
            ax.plot(point, at["upper"], zorder=3, **UPPER)
            ax.plot(point, at["lower"], zorder=4, **LOWER)
        ax.set_ylabel(r"$\beta$ (mm)")
        ax.yaxis.set_major_locator(plt.MaxNLocator(4))
    handles = tube_handles(panels, 2.2)
    handles += [Line2D([], [], label="upper limit", **UPPER), Line2D([], [], label="lower limit", **LOWER)]
    legend_below(figure, handles, 5 if sheet.columns == 2 else 3)
    return figure


def gap(record, tube):
    """Distance of a translation from its nearer moving limit after every iteration, mm; below zero outside."""
    beta, lower, upper = (record.column[f"{kind}_{tube}"] for kind in ("beta", "lower", "upper"))
    return MM * np.minimum(beta - lower, upper - beta)


def step(record, tube):
    """Displacement of a translation in every period but the first, mm."""
    return np.append(np.nan, MM * np.diff(record.column[f"beta_{tube}"]))


def draw_tubes(sheet, runs, values, label, threshold=None):
    """Numbers of every translation in every iteration.

    @param values     of a run and a tube; below a millionth of a millimetre is rounding
    @param threshold  of an axis that is logarithmic beyond; none: a linear axis
    """
    figure, panels = tube_grid(sheet, runs, 25, True)
    everything = []
    for ax, record, tubes in panels:
        for tube, color in zip(tubes, TUBES):
            numbers = values(record, tube)
            numbers = np.where(np.abs(numbers) < 1e-6, 0.0, numbers)
            everything.append(numbers)
            ax.plot(record.progress, numbers, color=color, linewidth=0.8)
    for ax, _, _ in panels:
        if threshold:
            signed_log_axis(ax, threshold, np.concatenate(everything))
        else:
            ax.yaxis.set_major_locator(plt.MaxNLocator(4))
        ax.axhline(0.0, color="#E31A1C", linewidth=0.6, zorder=1)
        if ax.get_subplotspec().is_first_col():
            ax.set_ylabel(label)
    legend_below(figure, tube_handles(panels, 1.1), 4)
    return figure


def draw_errors(sheet, runs):
    """Errors of all methods: pale at every iteration, strong where each point was left."""
    labels = next(iter(runs.values())).errors()
    figure, axes = plt.subplots(len(labels), 1, figsize=sheet.size(14 + 48 * len(labels)), sharex=True, squeeze=False, layout="constrained")
    axes = axes[:, 0]
    for ax, (name, label) in zip(axes, labels.items()):
        ax.set_ylabel(label)
        for method, record in runs.items():
            error = np.maximum(MM * record.column[name], FLOOR)
            ax.plot(record.progress, error, color=method_style(method)["color"], linewidth=0.4, alpha=0.35)
            ax.plot(record.point[record.last], error[record.last], label=method, **line_style(method))
    if "err_ab" in labels:
        largest = max(MM * record.column["err_ab"].max() for record in runs.values())
        axes[0].set_yscale("log")
        log_axis(axes[0].yaxis, FLOOR, max(largest, 10 * FLOOR))
    axes[-1].set_ylim(bottom=0)
    axes[-1].set_xlabel("trajectory point")
    axes[-1].set_xlim(0, max(record.point[-1] for record in runs.values()))
    figure.align_ylabels(axes)
    legend_below(figure, axes[0].get_legend_handles_labels()[0], 4 if sheet.columns == 2 else 2)
    return figure


KINDS = {
    "path": draw_path,
    "actuation": draw_actuation,
    "gaps": functools.partial(draw_tubes, values=gap, label="gap (mm)", threshold=GAP),
    "steps": functools.partial(draw_tubes, values=step, label="mm/period"),
    "errors": draw_errors,
}


def groups(folder):
    """{(trajectory, configuration): {method: file}} of summary.csv, in its order."""
    summary = read_csv(folder / "summary.csv")
    found = {}
    try:
        for key in zip(summary["trajectory"], summary["configuration"], summary["method"]):
            found.setdefault(key[:2], {})[key[2]] = folder / ("-".join(key) + ".csv")
    except KeyError as error:
        raise wrong_file(folder / "summary.csv", f"no column {error}", "tandem experiment --csv") from error
    return found


def draw_group(job):
    """All figures of one trajectory and configuration; the files written."""
    (trajectory, configuration), files, target, sheet = job
    runs = {method: Run(files[method]) for method in sorted(files, key=method_order)}
    written = []
    for kind, draw in KINDS.items():
        if kind == "path" and any("tip_x" not in record.column for record in runs.values()):
            continue  # written by an earlier version
        figure = draw(sheet, runs)
        written.append(sheet.save(figure, target / f"{kind}-{trajectory}-{configuration}.{sheet.format}"))
    return written


def progress(start, done, total):
    """One line, rewritten in place; only on a terminal, and only once it has taken longer than 2 s."""
    if sys.stderr.isatty() and time.monotonic() - start > 2.0:
        print(f"\rfigures: {done} of {total} ", end="\n" if done == total else "", file=sys.stderr, flush=True)


def draw(arguments, sheet):
    start, written = time.monotonic(), []
    jobs = [(key, files, arguments.target, sheet) for key, files in groups(arguments.source).items()]
    arguments.target.mkdir(parents=True, exist_ok=True)
    with multiprocessing.Pool(min(len(jobs), len(os.sched_getaffinity(0)))) as pool:
        for done, files in enumerate(pool.imap(draw_group, jobs), 1):
            written += files
            progress(start, done, len(jobs))
    return written


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", type=pathlib.Path, metavar="CSVDIR")
    parser.add_argument("target", type=pathlib.Path, metavar="FIGDIR")
    add_options(parser, folder=True)
    return run("figures.py", draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
