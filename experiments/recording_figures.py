#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Standard figures of a recording from the CSV files of `tandem export --indices`.

    recording_figures.py CSV_FOLDER FIGURE_FOLDER [--arms a,b] [--joints 6,6] [--format png|pdf|svg] [--dpi N] [--width 1|2]

Figures whose topics are not in the recording are left out. Prints the files that it writes.
"""

import argparse
import csv
import pathlib
import sys

import numpy as np
from style import ARMS, TUBES, add_options, equal_space, legend_below, log_axis, plt, run

JOINTS_PER_ARM = 8  # in arrays over all joints
STATES = ["DISABLED", "ENABLED", "PAUSED", "FAULT"]


class Table:
    """One CSV file; columns by name, as floats."""

    def __init__(self, path):
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
        self.names = {name: i for i, name in enumerate(rows[0])}
        self.rows = rows[1:]

    def __getitem__(self, name):
        i = self.names[name]
        return np.array([float(row[i]) if row[i] else np.nan for row in self.rows])

    def array(self, name):
        """All columns name[0], name[1], ..."""
        count = sum(1 for other in self.names if other.startswith(name + "["))
        return np.array([self[f"{name}[{i}]"] for i in range(count)])


def load(folder, name):
    path = folder / f"{name}.csv"
    table = Table(path) if path.exists() else None
    return table if table and table.rows else None


def joint_name(joint, count):
    """Of an arm with so many joints: tubes have two each, the three of a catheter have names."""
    return ["insertion", "roll", "bend"][joint] if count == 3 else f"tube {joint % (count // 2) + 1}"


def panes(sheet, rows, height=34):
    """Panels below one another over time; heights in mm."""
    figure, found = plt.subplots(rows, 1, figsize=sheet.size(height * rows + 18), sharex=True, squeeze=False,
                                 layout="constrained")
    found[-1, 0].set_xlabel("time (s)")
    return figure, found[:, 0]


def below(sheet, figure, handles):
    legend_below(figure, handles, 4 if sheet.columns == 2 else 2)


def joints(folder, arms, counts, sheet):
    """Measured joints and setpoints of every arm: translations, then rotations."""
    state = load(folder, "actuation_state")
    if not state or not arms:
        return None
    figure, found = panes(sheet, 2 * len(arms), 30)
    time, position, setpoint = state["time_s"], state.array("position"), state.array("setpoint")
    handles = {}
    for k, (arm, count) in enumerate(zip(arms, counts)):
        translations = 1 if count == 3 else count // 2
        for j in range(count):
            rotation, i = j >= translations, JOINTS_PER_ARM * k + j
            pane, scale = found[2 * k + rotation], 180 / np.pi if rotation else 1e3
            name = joint_name(j, count)
            color = TUBES[j if count == 3 else j % translations]
            handles[name], = pane.plot(time, scale * position[i], color=color, label=name)
            pane.plot(time, scale * setpoint[i], color=color, linestyle=(0, (1, 1.5)), linewidth=2.2, alpha=0.5)
            quantity = ("angles" if rotation else "insertion") if count == 3 else (r"$\alpha$" if rotation else r"$\beta$")
            pane.set_ylabel(f"{arm}\n{quantity} ({'deg' if rotation else 'mm'})")
    for pane in found:
        pane.yaxis.set_major_locator(plt.MaxNLocator(4))
    figure.align_ylabels(found)
    setpoints = plt.Line2D([], [], color="#8C8C8C", linestyle=(0, (1, 1.5)), linewidth=2.2, label="setpoints")
    below(sheet, figure, [*handles.values(), setpoints])
    return figure


def tracking(folder, arms, counts, sheet):
    """Errors and scales of control's tasks, and the number of active limits."""
    status = load(folder, "control_status")
    if not status:
        return None
    figure, (error, scale, limits) = panes(sheet, 3)
    time = status["time_s"]
    for i in range(int(np.nanmax(status["task_count"]))):
        style = {"color": ARMS[i % len(ARMS)], "linestyle": ("-", (0, (4, 1.5)), (0, (1, 1)))[i % 3], "label": f"task {i + 1}"}
        error.plot(time, 1e3 * status[f"task_error[{i}]"], **style)
        scale.plot(time, status[f"task_scale[{i}]"], **style)
    limits.step(time, status["active_limits"], where="post", color="#000000")
    limits.set_ylim(0, 1.05 * max(1, np.nanmax(status["active_limits"])))
    limits.yaxis.set_major_locator(plt.MaxNLocator(4, integer=True))
    error.set_ylabel("error (mm)")
    scale.set_ylabel("scale (-)")
    scale.set_ylim(-0.05, 1.05)
    limits.set_ylabel("active limits (-)")
    figure.align_ylabels([error, scale, limits])
    if error.lines:
        below(sheet, figure, error.lines)
    return figure


def timing(folder, arms, counts, sheet):
    """Durations of control's cycle, and intervals between states."""
    status, state = load(folder, "control_status"), load(folder, "actuation_state")
    if not status or not state:
        return None
    figure, (loop, interval) = panes(sheet, 2, 42)
    lowest, highest = np.inf, 1.0
    for name, color in zip(("solve_time", "cycle_time", "jitter_max"), ARMS):
        numbers = np.maximum(1e6 * status[name], 0.1)  # shorter: not measured
        lowest, highest = min(lowest, np.nanmin(numbers)), max(highest, np.nanmax(numbers))
        loop.semilogy(status["time_s"], numbers, color=color, label=name.replace("_", " "))
    log_axis(loop.yaxis, lowest, highest)
    loop.set_ylabel("control (µs)")
    published = np.array([int(row[state.names["publish_time_ns"]]) for row in state.rows])
    interval.plot(state["time_s"][1:], 1e-6 * np.diff(published), linewidth=0.5, color="#000000")
    interval.set_ylim(0, 1.1 * max(1e-6 * np.diff(published), default=1.0))
    interval.set_ylabel("between states (ms)")
    figure.align_ylabels([loop, interval])
    below(sheet, figure, loop.lines)
    return figure


def tips(folder, arms, counts, sheet):
    """Measured tips in the robot's base frame."""
    tables = {arm: load(folder, f"{arm}_measured_cp") for arm in arms}
    if not any(tables.values()):
        return None
    figure = plt.figure(figsize=sheet.size(90 if sheet.columns == 1 else 120))
    # The label of z stands to the right of the axes: on a narrow sheet there is room for it only if they stand to the left.
    pane = figure.add_axes((-0.06 if sheet.columns == 1 else 0.02, 0.17, 0.8, 0.8), projection="3d")
    places = []
    for (arm, table), color in zip(tables.items(), ARMS):
        if table:
            places.append(1e3 * np.stack([table[f"pose.position.{axis}"] for axis in "xyz"], axis=1))
            pane.plot(*places[-1].T, color=color, label=arm)
            pane.plot(*places[-1][-1:].T, color=color, marker="o", markersize=3)
    everything = np.concatenate(places)
    everything = everything[np.isfinite(everything).all(axis=1)]
    if len(everything):
        equal_space(pane, everything)
    figure.legend(handles=pane.lines[::2], loc="lower center", ncol=4)
    return figure


def states(folder, arms, counts, sheet):
    """Operating states of drives and control, and latched faults."""
    state, status = load(folder, "actuation_state"), load(folder, "control_status")
    if not state or not arms:
        return None
    figure, found = panes(sheet, len(arms), 28)
    for k, (pane, arm) in enumerate(zip(found, arms)):
        for table, name, style in ((state, "drives", {"color": "#56B4E9", "linewidth": 2.4}), (status, "control", {"color": "#000000"})):
            if table:
                pane.step(table["time_s"], table[f"operating_state[{k}]"], where="post", label=name, **style)
        faults = state[f"faults[{k}]"] > 0
        pane.fill_between(state["time_s"], 0, 3, where=faults, alpha=0.25, color="#D55E00", step="post", linewidth=0,
                          label="latched fault")
        pane.set_yticks(range(len(STATES)), STATES)
        pane.set_ylim(-0.3, 3.3)
        pane.set_title(arm)
    below(sheet, figure, found[0].get_legend_handles_labels()[0])
    return figure


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv", type=pathlib.Path)
    parser.add_argument("figures", type=pathlib.Path)
    parser.add_argument("--arms", default="")
    parser.add_argument("--joints", default="")
    add_options(parser, folder=True)
    return run("recording_figures.py", draw, parser.parse_args())


def draw(arguments, sheet):
    """The standard figures; the files written."""
    arms = [name for name in arguments.arms.split(",") if name]
    counts = [int(number) for number in arguments.joints.split(",") if number]
    for each in (joints, tracking, timing, tips, states):
        figure = each(arguments.csv, arms, counts, sheet)
        if figure:
            yield sheet.save(figure, arguments.figures / f"{each.__name__}.{sheet.format}")


if __name__ == "__main__":
    sys.exit(main())
