# SPDX-License-Identifier: Apache-2.0
"""Draws what `tandem cooperative` leaves as CSV files (docs/csv.md).

    cooperative.py track CSV SHAPES PNG    arms, path, errors and forces of co-manipulate and target-assist
    cooperative.py payload CSV PNG NAME... stiffness and payload by direction, of all arms and of each one alone
    cooperative.py reach CSV PNG           tips reached with assistance, and which of them lie beyond the target's own

Files written are listed on standard output. Ends with 1 where a file is missing or is not of this format, with 2 where
the command line is wrong.
"""

import pathlib
import sys

import numpy as np
from matplotlib.ticker import MaxNLocator

from figures import MM, Failure, plt
from mechanics import ARMS, columns


def draw_arms(ax, shapes, table):
    """Arms before and after the path in space, and the way of what is moved."""
    for end, style in ((0, {"alpha": 0.35}), (1, {})):
        for arm in np.unique(shapes["arm"]).astype(int):
            chosen = (shapes["end"] == end) & (shapes["arm"] == arm)
            ax.plot(*(MM * shapes[axis][chosen] for axis in "xyz"), color=ARMS[arm], linewidth=2.2, **style)
    moving = table["time"] >= 0
    ax.plot(*(MM * table[axis][moving] for axis in "xyz"), color="#000000", linewidth=1.2)
    extent = np.array([np.ptp(MM * shapes[axis]) for axis in "xyz"])
    ax.set_box_aspect(np.maximum(extent, 0.15 * extent.max()))
    for axis in "xyz":
        getattr(ax, f"set_{axis}label")(f"{axis} (mm)")
    ax.set_title("arms before (pale) and after; the path")


def draw_track(source, shapes, target):
    """The figure of one run."""
    table, shapes = columns(source), columns(shapes)
    if "residual" not in table:
        raise Failure(f"{source}: not of `tandem cooperative`")
    forces = [name for name in table if "_N" in name or name.startswith("friction_used")]
    figure = plt.figure(figsize=(11, 5.4), layout="constrained")
    grid = figure.add_gridspec(2, 2)
    draw_arms(figure.add_subplot(grid[:, 0], projection="3d"), shapes, table)
    ax = figure.add_subplot(grid[0, 1])
    for name, color in (("error", "#0072B2"), ("residual", "#D55E00")):
        ax.semilogy(table["time"], np.maximum(MM * table[name], 1e-9), color=color, label=name)
    ax.set_ylabel("mm")
    ax.legend()
    ax.set_title("tracking error and contact residual; the path begins at 0 s")
    ax = figure.add_subplot(grid[1, 1], sharex=ax)
    for name, color in zip(forces, ARMS):
        ax.plot(table["time"], np.where(np.isfinite(table[name]), table[name], np.nan), color=color, label=name)
    ax.set_xlabel("time (s)")
    ax.legend(fontsize=7)
    ax.set_title("contact forces (N), used part of friction")
    target.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(target)
    return [target]


def draw_reach(source, target):
    """Tips that the samples of an assisted target have shown."""
    table = columns(source)
    if "beyond" not in table:
        raise Failure(f"{source}: not of `tandem cooperative reach`")
    ok = table["status"] == "ok"
    if not ok.any():
        raise Failure(f"{source}: no joint vector has a contact")
    beyond = ok & (table["beyond"] > 0)
    figure, axes = plt.subplots(1, 2, figsize=(10, 5), layout="constrained")
    for ax, (one, other) in zip(axes, (("x", "z"), ("y", "z"))):
        ax.scatter(MM * table[one][ok & ~beyond], MM * table[other][ok & ~beyond], s=2, color="#999999",
                   label="reached alone, too", rasterized=True)
        points = ax.scatter(MM * table[one][beyond], MM * table[other][beyond], s=4, c=MM * table["beyond"][beyond],
                            cmap="viridis", label="only with assistance", rasterized=True)
        ax.set_xlabel(f"{one} (mm)")
        ax.set_ylabel(f"{other} (mm)")
        ax.set_aspect("equal")
    axes[0].legend(loc="upper left")
    figure.colorbar(points, ax=axes, label="beyond the target's own reach (mm)")
    figure.suptitle(f"{beyond.sum()} of {ok.sum()} assisted tips lie beyond what the target reaches alone")
    target.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(target)
    return [target]


def draw_payload(source, target, *carriers):
    """What carriers carry in the planes of the robot's axes: a row of stiffness, a row of payload."""
    table = columns(source)
    if "payload" not in table or len(carriers) <= np.max(table["carrier"]):
        raise Failure(f"{source}: not of `tandem cooperative payload` with {len(carriers)} carriers")
    figure, axes = plt.subplots(2, 3, figsize=(11, 7.2), layout="constrained", subplot_kw={"projection": "polar"})
    for row, (name, label) in enumerate((("stiffness", "stiffness (N/m)"), ("payload", "payload (N)"))):
        for plane, ax in enumerate(axes[row]):
            for carrier, text in enumerate(carriers):
                chosen = (table["carrier"] == carrier) & (table["plane"] == plane) & (table["stiffness"] > 0)
                if chosen.any():
                    closed = np.append(np.flatnonzero(chosen), np.flatnonzero(chosen)[0])
                    ax.plot(table["angle"][closed], table[name][closed], color=ARMS[carrier], linewidth=1.6,
                            label="all arms" if carrier == 0 else f"{text} alone")
            first, second = "xyz"[plane], "xyz"[(plane + 1) % 3]
            ax.set_xticks([0, np.pi / 2, np.pi, 3 * np.pi / 2], [f"+{first}", f"+{second}", f"-{first}", f"-{second}"])
            ax.yaxis.set_major_locator(MaxNLocator(3))
            ax.set_title(label)
    axes[0, 0].legend(loc="lower left", bbox_to_anchor=(-0.25, -0.25))
    target.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(target)
    return [target]


def main():
    kinds = {"track": (draw_track, [3]), "reach": (draw_reach, [2]), "payload": (draw_payload, range(3, 12))}
    if len(sys.argv) < 2 or sys.argv[1] not in kinds or len(sys.argv) - 2 not in kinds[sys.argv[1]][1]:
        print(__doc__.strip(), file=sys.stderr)
        return 0 if sys.argv[1:] in (["--help"], ["-h"]) else 2
    try:
        for path in kinds[sys.argv[1]][0](*map(pathlib.Path, sys.argv[2:])):
            print(path)
    except Failure as failure:
        print(f"cooperative.py: {failure}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"cooperative.py: {error.filename}: {error.strerror}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
