# SPDX-License-Identifier: Apache-2.0
"""Figures and tables from the CSV file of `tandem montecarlo` (docs/csv.md).

    montecarlo.py CSV FILE [--dpi N] [--width 1|2]

FILE (.png, .pdf or .svg) has box plots of errors and iterations of all methods in the first case: quartiles, whiskers from
the 5th to the 95th percentile, every feasible task as a point, and a bar for the 95 % confidence interval of the median. Where sources of
error were swept, it has the share of feasible tasks that succeeded over the size of each. The same statistics are in the
tables FILE.stats.csv and FILE.stats.tex (FILE without its ending). Files written are listed on standard output. Ends with 1
where a file is missing or is not of this format, with 2 where the command line is wrong.
"""

import argparse
import csv
import pathlib
import sys
import typing

import numpy as np
from matplotlib.lines import Line2D
from style import (FLOOR, MM, Failure, add_options, figure_file, legend_below, log_axis, method_order, method_style, plt,
                   read_csv, reason, run, wrong_file)

# Columns of conditions, in the units of their axes.
SOURCES = {
    "stiffness_error": (100, "error of stiffnesses (%)"),
    "curvature_error": (100, "error of curvatures (%)"),
    "length_error": (100, "error of lengths (%)"),
    "tip_noise_mm": (MM, "noise of measured tips (mm)"),
    "encoder_counts": (1, "encoder counts per turn and mm (0: exact)"),
    "encoder_noise_mm": (MM, "noise of encoders (mm)"),
    "play_mm": (MM, "backlash of actuators (mm)"),
    "delay_steps": (1, "delay (control periods)"),
    "tube_friction": (1, "friction between tubes, coefficient"),
    "tube_clearance_mm": (MM, "clearance between tubes (mm)"),
    "tube_ovality_mm": (MM, "ovality of bores (mm)"),
    "residual_curvature_per_m": (1, "curvature of straight sections (1/m)"),
    "tip_bias_mm": (MM, "bias of measured tips (mm)"),
    "tip_distortion_mm": (MM, "distortion of measured tips (mm)"),
    "tip_delay_steps": (1, "delay of tips, up to (periods)"),
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
        raise wrong_file(path, reason(error), "tandem montecarlo --csv") from error


def median_interval(values):
    """95 % interval of the median from order statistics (binomial, no assumption on the distribution)."""
    n = len(values)
    chance, k = 0.5 ** n, 0  # of at most k values below the median
    if n < 6:
        return values.min(), values.max()  # fewer cannot give 95 %
    below, term = chance, chance
    while below + term * (n - k) / (k + 1) <= 0.025:
        term *= (n - k) / (k + 1)
        below += term
        k += 1
    ordered = np.sort(values)
    return ordered[k], ordered[n - 1 - k]


def draw_boxes(ax, values, label):
    """A box, its points and the interval of its median for each method, on a logarithmic axis."""
    random = np.random.default_rng(1)  # spreads the points
    for row, (method, numbers) in enumerate(values.items()):
        color = method_style(method)["color"]
        ax.scatter(numbers, row + random.uniform(-0.32, 0.32, len(numbers)), s=3, color=color, alpha=0.6, linewidths=0,
                   rasterized=True)
        low, first, middle, third, high = np.percentile(numbers, [5, 25, 50, 75, 95])
        ax.bxp([{"whislo": low, "q1": first, "med": middle, "q3": third, "whishi": high}], positions=[row], vert=False,
               widths=0.5, showfliers=False, boxprops={"linewidth": 0.8}, whiskerprops={"linewidth": 0.8},
               capprops={"linewidth": 0.8}, medianprops={"color": color, "linewidth": 1.4}, manage_ticks=False)
        ax.plot(median_interval(numbers), [row + 0.4] * 2, color="#E31A1C", linewidth=1.4, solid_capstyle="butt")
    everything = np.concatenate(list(values.values()))
    ax.set_xscale("log")
    lower, upper = everything.min() / 1.15, everything.max() * 1.15
    ax.set_xlim(lower, upper)
    log_axis(ax.xaxis, lower, upper)
    ax.set_xlabel(label)
    ax.set_yticks(range(len(values)), list(values))
    ax.set_ylim(len(values) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)


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
        style = method_style(method)
        mine = alike & (table["feasible"] == 1) & (table["method"] == method)
        runs = [table["succeeded"][mine & (table[source] == size)] for size in sizes]
        ends = 100 * np.array([wilson(np.sum(run), len(run)) for run in runs])
        ax.fill_between(unit * sizes, ends[:, 0], ends[:, 1], color=style["color"], alpha=0.12, linewidth=0)
        ax.plot(unit * sizes, [100 * np.mean(run) for run in runs], markersize=3, **style)
    ax.set_xlabel(label)
    ax.set_ylabel("succeeded (%)")
    ax.set_ylim(-2, 102)


def first_case(table):
    """Rows of feasible tasks of the first case, and that case."""
    base = {source: table[source][0] for source in SOURCES}
    rows = np.all([table[source] == size for source, size in base.items()], axis=0) & (table["feasible"] == 1)
    if not rows.any():
        raise Failure("found no feasible task in the first combination of errors, expected at least one; run more tasks, or another seed")
    return rows, base


class Quantity(typing.NamedTuple):
    """A number of each run, and how it is shown."""

    label: str    # of the figure
    header: str   # of the LaTeX table
    column: str   # of the CSV table
    digits: int
    values: np.ndarray


def quantities(table):
    """What box plots and tables show of each run."""
    relative = Quantity(r"$\epsilon_{AB}$, RMS of a run (mm)", r"$\epsilon_{AB}$ (mm)", "rms_ab_mm", 4,
                        np.maximum(MM * table["rms_ab"], FLOOR))
    others = [Quantity(r"$\epsilon_A$, RMS of a run (mm)", r"$\epsilon_A$ (mm)", "rms_a_mm", 3, np.maximum(MM * table["rms_a"], FLOOR)),
              Quantity("iterations per point", "iterations per point", "iterations_per_point", 2,
                       table["iterations"] / np.maximum(table["points"], 1))]
    return [relative, *others] if table["rms_ab"].any() else others  # without a relative position its error is 0


def statistics(table):
    """A row for each method: text and numbers by column name."""
    first, _ = first_case(table)
    rows = []
    for method in sorted(set(table["method"]), key=method_order):
        mine = first & (table["method"] == method)
        lower, upper = wilson(table["succeeded"][mine].sum(), mine.sum())
        row = {"method": method, "tasks": int(mine.sum()), "succeeded": int(table["succeeded"][mine].sum()),
               "succeeded_lower_95": lower, "succeeded_upper_95": upper}
        for quantity in quantities(table):
            name, values = quantity.column, quantity.values[mine]
            ends = median_interval(values)
            row |= dict(zip((f"{name}_q1", f"{name}_median", f"{name}_q3"), np.percentile(values, [25, 50, 75])))
            row |= {f"{name}_median_lower_95": ends[0], f"{name}_median_upper_95": ends[1]}
        rows.append(row)
    return rows


def write_tables(table, target):
    """Statistics as a CSV and a LaTeX (booktabs) table; the files."""
    rows, shown = statistics(table), quantities(table)
    files = [target.with_suffix(".stats.csv"), target.with_suffix(".stats.tex")]
    with open(files[0], "w", newline="", encoding="utf-8") as out:
        writer = csv.DictWriter(out, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    lines = ["% medians [95 % intervals]; share of tasks that succeeded [95 % interval, Wilson]",
             rf"\begin{{tabular}}{{lrr{'r' * len(shown)}}}", r"\toprule",
             " & ".join(["method", "tasks", r"succeeded (\%)", *(quantity.header for quantity in shown)]) + r" \\", r"\midrule"]
    for row in rows:
        cells = [row["method"], str(row["tasks"]),
                 f"{100 * row['succeeded'] / row['tasks']:.1f} [{100 * row['succeeded_lower_95']:.1f}, "
                 f"{100 * row['succeeded_upper_95']:.1f}]"]
        for quantity in shown:
            numbers = (row[f"{quantity.column}_median{end}"] for end in ("", "_lower_95", "_upper_95"))
            middle, lower, upper = (f"{number:.{quantity.digits}f}" for number in numbers)
            cells.append(f"{middle} [{lower}, {upper}]")
        lines.append(" & ".join(cells) + r" \\")
    files[1].write_text("\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""]), encoding="utf-8")
    return files


def draw_all(table, sheet):
    first, base = first_case(table)
    methods = [method for method in sorted(set(table["method"]), key=method_order) if (first & (table["method"] == method)).any()]
    swept = [source for source in SOURCES if len(np.unique(table[source])) > 1]
    shown = quantities(table)
    across = sheet.beside(3, 3)
    down = [-(-len(shown) // across), -(-len(swept) // across)]
    heights = [14 + 5 * len(methods)] * down[0] + [42] * down[1]
    figure = plt.figure(figsize=sheet.size(sum(heights) + 14), layout="constrained")
    grid = figure.add_gridspec(sum(down), across, height_ratios=heights)
    for k, quantity in enumerate(shown):
        ax = figure.add_subplot(grid[k // across, k % across])
        draw_boxes(ax, {m: quantity.values[first & (table["method"] == m)] for m in methods}, quantity.label)
        if k % across:
            ax.tick_params(labelleft=False)
    for k, source in enumerate(swept):
        draw_sweep(figure.add_subplot(grid[down[0] + k // across, k % across]), table, methods, source, base)
    handles = [Line2D([], [], color="#E31A1C", label="95 % interval of median")]
    if swept:
        handles += [Line2D([], [], markersize=3, label=method, **method_style(method)) for method in methods]
    legend_below(figure, handles, 4 if sheet.columns == 2 else 2)
    return figure


def draw(arguments, sheet):
    table = load(arguments.source)
    return [sheet.save(draw_all(table, sheet), arguments.target), *write_tables(table, arguments.target)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", type=pathlib.Path, metavar="CSV")
    parser.add_argument("target", type=figure_file, metavar="FILE")
    add_options(parser, folder=False)
    return run("montecarlo.py", draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
