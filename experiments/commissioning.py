#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Figures of the measurements of `tandem commission`: following error and encoder minus drive over the position of each axis.

    commissioning.py FOLDER FIGURE [--dpi N] [--width 1|2]

FOLDER has a CSV file for each axis. The encoder's line is a loop whose height is the free travel between motor and encoder;
its slope is a wrong gearing. Prints the file that it writes.
"""

import argparse
import pathlib
import sys

import numpy as np
from style import ARMS, Failure, add_options, figure_file, plt, read_csv, run


def columns(path):
    """Unit, position, following error and encoder minus drive of one axis."""
    table = read_csv(path)
    unit = next(name for name in table if name.startswith("position_")).removeprefix("position_")
    return unit, *(np.array(table[f"{name}_{unit}"], dtype=float) for name in ("position", "following_error", "encoder_difference"))


def draw(arguments, sheet):
    files = sorted(arguments.csv.glob("*.csv"))
    if not files:
        raise Failure(f"{arguments.csv}: has no CSV file of an axis")
    across = sheet.beside(len(files), 3)
    down = -(-len(files) // across)
    figure, panels = plt.subplots(down, across, figsize=sheet.size(42 * down + 8), squeeze=False, layout="constrained")
    for panel, path in zip(panels.flat, files):
        unit, position, following, difference = columns(path)
        panel.plot(position, following, color=ARMS[0], linewidth=0.8, label="following error")
        if np.isfinite(difference).all() and np.any(difference != 0):
            panel.plot(position, difference - difference.mean(), color=ARMS[1], linewidth=1.2, label="encoder minus drive")
        panel.set_title(path.stem.replace("_", " "))
        panel.set_xlabel(f"position ({unit})")
        panel.set_ylabel(unit)
        panel.legend(loc="best", fontsize=6)
    for panel in list(panels.flat)[len(files):]:
        panel.set_visible(False)
    yield sheet.save(figure, arguments.figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv", type=pathlib.Path)
    parser.add_argument("figure", type=figure_file)
    add_options(parser, folder=False)
    return run("commissioning.py", draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
