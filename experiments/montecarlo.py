# SPDX-License-Identifier: Apache-2.0
"""Draws what `tandem montecarlo` leaves as a CSV file (docs/csv.md).

    montecarlo.py CSV PNG

Distributions of errors and iterations of all methods in the first case and, where sources of error were swept, the
share of feasible tasks that succeeded over the size of each. The file written is listed on standard output. Ends with 1
where a file is missing or is not of this format, with 2 where the command line is wrong.
"""

import pathlib
import sys

import numpy as np

from figures import METHOD_STYLE, MM, OTHER_METHOD, SMALLEST, Failure, legend_below, method_order, plt, read_csv

# Columns of conditions, in the units of their axes.
SOURCES = {
    "stiffness_error": (100, "error of stiffnesses (%)"),
    "curvature_error": (100, "error of curvatures (%)"),
    "length_error": (100, "error of lengths (%)"),
    "tip_noise_mm": (MM, "noise of measured tips (mm)"),
    "encoder_counts": (1, "encoder counts per turn and mm (0: exact)"),
    "encoder_noise_mm": (MM, "noise of encoders (mm)"),
    "backlash_mm": (MM, "backlash of actuators (mm)"),
    "delay_steps": (1, "delay (control periods)"),
    "stop_within_mm": (MM, "tolerance of the run (mm; 0: threshold)"),
    "speed_mm_per_s": (MM, "speed of references (mm/s; 0: point by point)"),
}


def load(path):
    """Columns by name: text of methods, numbers of what is drawn."""
    table = {name: np.array(values) for name, values in read_csv(path).items()}
    if "method" in table:  # files of before have fewer sources of error
        table |= {name: np.zeros(len(table["method"])) for name in SOURCES if name not in table}
    try:
        numbers = [*SOURCES, "task", "feasible", "points", "iterations", "rms_ab", "rms_a", "succeeded"]
        return {"method": table["method"]} | {name: table[name].astype(float) for name in numbers}
    except (KeyError, ValueError) as error:
        raise Failure(f"{path}: not of `tandem montecarlo`: {error}") from error


def draw_distribution(ax, values, label, log):
    """Share of tasks below each value, a line a method."""
    for method, numbers in values.items():
        color, style, width = METHOD_STYLE.get(method, OTHER_METHOD)
        numbers = np.sort(numbers)
        share = np.arange(1, len(numbers) + 1) / len(numbers)
        ax.step(numbers, 100 * share, where="post", color=color, linestyle=style, linewidth=width, label=method)
    if log:
        ax.set_xscale("log")
    ax.set_xlabel(label)
    ax.set_ylabel("tasks (%)")
    ax.set_ylim(0, 102)


def wilson(succeeded, trials):
    """95 % interval of a proportion, as experiments/proportions.h."""
    z, n = 1.959963984540054, max(trials, 1)
    share, spread = succeeded / n, 1 + z * z / n
    centre = (share + z * z / (2 * n)) / spread
    half = z / spread * np.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    return centre - half, centre + half


def draw_sweep(ax, table, methods, source, base):
    """Share that succeeded over one condition, with its interval, the others as in the first case."""
    unit, label = SOURCES[source]
    alike = np.all([table[other] == base[other] for other in SOURCES if other != source], axis=0)
    sizes = np.unique(table[source][alike])
    for method in methods:
        color, style, width = METHOD_STYLE.get(method, OTHER_METHOD)
        mine = alike & (table["feasible"] == 1) & (table["method"] == method)
        runs = [table["succeeded"][mine & (table[source] == size)] for size in sizes]
        ends = 100 * np.array([wilson(np.sum(run), len(run)) for run in runs])
        ax.fill_between(unit * sizes, ends[:, 0], ends[:, 1], color=color, alpha=0.12, linewidth=0)
        ax.plot(unit * sizes, [100 * np.mean(run) for run in runs], color=color, linestyle=style, linewidth=width, marker="o", markersize=3)
    ax.set_xlabel(label)
    ax.set_ylabel("succeeded (%)")
    ax.set_ylim(-2, 102)


def draw(table):
    base = {source: table[source][0] for source in SOURCES}
    methods = sorted(set(table["method"]), key=method_order)
    swept = [source for source in SOURCES if len(np.unique(table[source])) > 1]
    first = np.all([table[source] == size for source, size in base.items()], axis=0) & (table["feasible"] == 1)
    if not first.any():
        raise Failure("there is no feasible task in the first case")
    rows = 1 + (len(swept) + 2) // 3
    figure, axes = plt.subplots(rows, 3, figsize=(12, 3.4 * rows + 0.4), squeeze=False, layout="constrained")
    figure.suptitle(f"{len(np.unique(table['task'][first]))} feasible tasks a method")

    def of(column):
        return {m: column[first & (table["method"] == m)] for m in methods}

    draw_distribution(axes[0, 0], of(np.maximum(MM * table["rms_ab"], SMALLEST)), r"$\epsilon_{AB}$, RMS of a run (mm)",
                      True)
    draw_distribution(axes[0, 1], of(np.maximum(MM * table["rms_a"], SMALLEST)), r"$\epsilon_A$, RMS of a run (mm)",
                      True)
    draw_distribution(axes[0, 2], of(table["iterations"] / np.maximum(table["points"], 1)), "iterations a point", True)
    flat = axes[1:].ravel()
    for ax, source in zip(flat, swept):
        draw_sweep(ax, table, methods, source, base)
    for ax in flat[len(swept):]:
        ax.set_visible(False)
    legend_below(figure, axes[0, 0].get_legend_handles_labels()[0])
    return figure


def main():
    if len(sys.argv) != 3 or sys.argv[1].startswith("-"):
        print(__doc__.strip(), file=sys.stderr)
        return 0 if sys.argv[1:] in (["--help"], ["-h"]) else 2
    source, target = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    try:
        figure = draw(load(source))
        target.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(target)
    except Failure as failure:
        print(f"montecarlo.py: {failure}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"montecarlo.py: {error.filename or target}: {error.strerror}", file=sys.stderr)
        return 1
    print(target)
    return 0


if __name__ == "__main__":
    sys.exit(main())
