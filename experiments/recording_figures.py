#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the standard figures of a recording from the CSV files of `tandem export`.

    recording_figures.py CSV_FOLDER FIGURE_FOLDER [--arms a,b] [--joints 6,6] [--title TEXT]

Figures whose topics are not in the recording are left out. Prints the files that it writes.
"""

import argparse
import csv
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

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


def axes(rows, title, height=2.2, **more):
    figure, found = plt.subplots(rows, 1, figsize=(9, 1 + height * rows), sharex=True, squeeze=False, **more)
    figure.suptitle(title)
    found[-1, 0].set_xlabel("time [s]")
    return figure, found[:, 0]


def joints(folder, arms, counts, title):
    state = load(folder, "actuation_state")
    if not state or not arms:
        return None
    figure, panes = axes(2 * len(arms), f"{title}: joints (dashed: setpoints)")
    time, position, setpoint = state["time_s"], state.array("position"), state.array("setpoint")
    for k, (arm, count) in enumerate(zip(arms, counts)):
        for j in range(count):
            rotation, i = j >= count // 2, JOINTS_PER_ARM * k + j
            pane, scale = panes[2 * k + rotation], 180 / np.pi if rotation else 1e3
            line, = pane.plot(time, scale * position[i], label=joint_name(j, count))
            pane.plot(time, scale * setpoint[i], "--", color=line.get_color(), linewidth=0.8)
            pane.set_ylabel(f"{arm}\n" + ("α [deg]" if rotation else "β [mm]") if count != 3 else
                            f"{arm}\n" + ("angles [deg]" if rotation else "insertion [mm]"))
    for pane in panes:
        pane.legend(fontsize="x-small", ncol=4, loc="best")
    return figure


def tracking(folder, arms, counts, title):
    status = load(folder, "control_status")
    if not status:
        return None
    figure, (error, scale, limits) = axes(3, f"{title}: tasks")
    tasks = int(np.nanmax(status["task_count"])) if status.rows else 0
    for i in range(tasks):
        error.plot(status["time_s"], 1e3 * status[f"task_error[{i}]"], label=f"task {i + 1}")
        scale.plot(status["time_s"], status[f"task_scale[{i}]"], label=f"task {i + 1}")
    limits.step(status["time_s"], status["active_limits"], where="post")
    error.set_ylabel("error [mm]")
    scale.set_ylabel("scale")
    limits.set_ylabel("active limits")
    if tasks:
        error.legend(fontsize="x-small")
    return figure


def timing(folder, arms, counts, title):
    status, state = load(folder, "control_status"), load(folder, "actuation_state")
    if not status or not state:
        return None
    figure, (loop, interval) = axes(2, f"{title}: timing")
    for name in ("solve_time", "cycle_time", "jitter_max"):
        loop.semilogy(status["time_s"], np.maximum(1e6 * status[name], 1e-1), label=name.replace("_", " "))
    loop.set_ylabel("control [µs]")
    loop.legend(fontsize="x-small")
    published = np.array([int(row[state.names["publish_time_ns"]]) for row in state.rows])
    interval.plot(state["time_s"][1:], 1e-6 * np.diff(published), linewidth=0.5)
    interval.set_ylabel("between states [ms]")
    return figure


def tips(folder, arms, counts, title):
    tables = {arm: load(folder, f"{arm}_measured_cp") for arm in arms}
    if not any(tables.values()):
        return None
    figure = plt.figure(figsize=(7, 7))
    figure.suptitle(f"{title}: tips, robot base frame")
    pane = figure.add_subplot(projection="3d")
    for arm, table in tables.items():
        if table:
            pane.plot(*(1e3 * table[f"pose.position.{axis}"] for axis in "xyz"), label=arm)
    for axis in "xyz":
        getattr(pane, f"set_{axis}label")(f"{axis} [mm]")
    pane.legend()
    return figure


def states(folder, arms, counts, title):
    state, status = load(folder, "actuation_state"), load(folder, "control_status")
    if not state or not arms:
        return None
    figure, panes = axes(len(arms), f"{title}: operating states", height=1.5)
    for k, (pane, arm) in enumerate(zip(panes, arms)):
        for table, name in ((state, "drives"), (status, "control")):
            if table:
                pane.step(table["time_s"], table[f"operating_state[{k}]"], where="post", label=name)
        faults = state[f"faults[{k}]"] > 0
        pane.fill_between(state["time_s"], 0, 3, where=faults, alpha=0.2, color="tab:red", step="post",
                          label="latched fault")
        pane.set_yticks(range(len(STATES)), STATES)
        pane.set_ylim(-0.3, 3.3)
        pane.set_title(arm, fontsize="small")
        pane.legend(fontsize="x-small")
    return figure


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("csv", type=pathlib.Path)
    options.add_argument("figures", type=pathlib.Path)
    options.add_argument("--arms", default="")
    options.add_argument("--joints", default="")
    options.add_argument("--title", default="recording")
    arguments = options.parse_args()
    arms = [name for name in arguments.arms.split(",") if name]
    counts = [int(number) for number in arguments.joints.split(",") if number]
    arguments.figures.mkdir(parents=True, exist_ok=True)
    for draw in (joints, tracking, timing, tips, states):
        figure = draw(arguments.csv, arms, counts, arguments.title)
        if figure:
            path = arguments.figures / f"{draw.__name__}.png"
            figure.tight_layout()
            figure.savefig(path, dpi=120)
            plt.close(figure)
            print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
