# SPDX-License-Identifier: Apache-2.0
"""Figures from the CSV files of `tandem cooperative` (docs/csv.md).

    cooperative.py track CSV SHAPES FILE    arms, object, path, errors and forces of co-manipulate and target-assist
    cooperative.py payload CSV FILE NAME... stiffness and payload by direction, of all arms and of each one alone
    cooperative.py reach CSV FILE           tips reached with assistance, and which of them lie beyond the target's own

FILE ends in .png, .pdf or .svg; all take --dpi N and --width 1|2. Files written are listed on standard output. Ends with 1
where a file is missing or is not of this format, with 2 where the command line is wrong.
"""

import argparse
import pathlib
import sys

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from mechanics import columns, rotation
from style import (ARMS, INCH, MM, Failure, add_options, equal_space, figure_file, legend_below, log_axis, plt, run,
                   wrong_file, zoom_from_zero)

OBJECT = "#6A3D9A"
NOTHING = 1e-9  # N, N m, mm: smaller numbers are rounding and drawn as zero
# Groups of columns by the end of their names or before the arm's: label of the axis, smallest range drawn.
FORCES = {"_N": ("force (N)", 1e-3), "_Nm": ("moment (N m)", 1e-6), "friction_used": ("friction used (-)", 0.1)}


def draw_object(ax, contacts, pose, strong):
    """A grasped object: the span of its contacts, and its frame.

    @param contacts  tips of the arms, n x 3, mm
    @param pose      x, y, z (mm) and quaternion
    """
    centre, axes = np.array(pose[:3]), rotation(*pose[3:])
    alpha = 1.0 if strong else 0.35
    ring = np.vstack([contacts, contacts[:1]])
    ax.plot(*ring.T, color=OBJECT, linewidth=4.0, alpha=0.6 * alpha, solid_capstyle="round")
    for contact in contacts:
        ax.plot(*np.stack([centre, contact]).T, color=OBJECT, linewidth=1.0, alpha=alpha)
    length = 0.5 * np.linalg.norm(contacts - centre, axis=1).max()
    for axis in axes.T:
        ax.plot(*np.stack([centre, centre + length * axis]).T, color=OBJECT, linewidth=0.8, alpha=alpha)


def draw_arms(ax, shapes, table, grasped):
    """Arms, and the object that they grasp, before and after the path in space; the path of what is moved."""
    moving = np.flatnonzero(table["time"] >= 0)
    arms = np.unique(shapes["arm"]).astype(int)
    for end, row, style in ((0, moving[0], {"alpha": 0.35}), (1, moving[-1], {})):
        tips = []
        for arm in arms:
            chosen = (shapes["end"] == end) & (shapes["arm"] == arm)
            points = MM * np.stack([shapes[axis][chosen] for axis in "xyz"], axis=1)
            ax.plot(*points.T, color=ARMS[arm % len(ARMS)], linewidth=1.8, **style)
            tips.append(points[-1])
        if grasped:
            pose = [MM * table[axis][row] for axis in "xyz"] + [table[part][row] for part in ("qx", "qy", "qz", "qw")]
            draw_object(ax, np.array(tips), pose, end == 1)
    path = MM * np.stack([table[axis][moving] for axis in "xyz"], axis=1)
    ax.plot(*path.T, color="#000000", linewidth=0.9)
    everything = MM * np.stack([shapes[axis] for axis in "xyz"], axis=1)
    equal_space(ax, np.vstack([everything, path]))
    ax.view_init(elev=18, azim=-60)


def without_rounding(values):
    return np.where(np.abs(values) < NOTHING, 0.0, values)


def force_groups(table):
    """{(label, smallest range): [column]} of forces, moments and parts of friction."""
    found = {}
    for name in table:
        for key, about in FORCES.items():
            if name.endswith(key) or f"{key}_" in name or name.startswith(key):
                found.setdefault(about, []).append(name)
                break
    return {about: found[about] for about in FORCES.values() if about in found}


def draw_track(arguments, sheet):
    """The figure of one run: arms in space; errors and contact forces over time."""
    table, shapes = columns(arguments.source), columns(arguments.shapes)
    if "residual" not in table:
        raise wrong_file(arguments.source, "no column 'residual'", "tandem cooperative track --csv")
    groups = force_groups(table)
    grasped = any(name.startswith("normal_N") for name in table)
    rows = 1 + len(groups)
    wide = sheet.columns == 2
    figure = plt.figure(figsize=sheet.size(max(74, 26 * rows + 24) if wide else 78 + 28 * rows + 24))
    height = INCH * figure.get_figheight()  # mm
    top = 1 - 3 / height
    legend_columns = 4 if wide else 2
    entries = 4 + sum(map(len, groups.values()))
    foot = 10 + 4.6 * -(-entries // legend_columns)  # mm: label of the time axis and rows of the legend
    low = foot / height
    if wide:
        space = figure.add_axes((0.0, low, 0.5, top - low), projection="3d")
        grid = figure.add_gridspec(rows, 1, left=0.6, right=0.985, bottom=low, top=top, hspace=0.25)
    else:
        space = figure.add_axes((0.02, 1 - 74 / height, 0.96, 70 / height), projection="3d")
        grid = figure.add_gridspec(rows, 1, left=0.2, right=0.97, bottom=low, top=1 - 82 / height, hspace=0.25)
    draw_arms(space, shapes, table, grasped)
    panels = [figure.add_subplot(grid[0])]
    floor = 1e-6  # mm; errors of an exact model are rounding
    lines = (("error", "#0072B2", "-"), ("residual", "#D55E00", (0, (4, 1.5))))
    largest = floor
    for name, color, dashes in lines:
        values = np.maximum(MM * table[name], floor)
        largest = max(largest, float(np.nanmax(values)))
        panels[0].semilogy(table["time"], values, color=color, linestyle=dashes)
    log_axis(panels[0].yaxis, floor, 10 * largest)
    panels[0].set_ylim(0.7 * floor, 2 * largest)
    panels[0].set_ylabel("error (mm)")
    names = []
    for k, ((label, least), found) in enumerate(groups.items(), 1):
        ax = figure.add_subplot(grid[k], sharex=panels[0])
        values = [without_rounding(np.where(np.isfinite(table[name]), table[name], np.nan)) for name in found]
        for name, value in zip(found, values):
            color = ARMS[len(names) % len(ARMS)]
            dashes = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)))[len(names) % 4]
            ax.plot(table["time"], value, color=color, linestyle=dashes)
            names.append(Line2D([], [], color=color, linestyle=dashes, label=readable(name)))
        zoom_from_zero(ax, np.concatenate(values), least)
        ax.yaxis.set_major_locator(MaxNLocator(4))
        ax.set_ylabel(label)
        panels.append(ax)
    for ax in panels[:-1]:
        ax.tick_params(labelbottom=False)
    panels[-1].set_xlabel("time on the path (s)")
    figure.align_ylabels(panels)
    handles = [Line2D([], [], color=color, linestyle=dashes, label=text)
               for (_, color, dashes), text in zip(lines, ("tracking error", "contact residual"))] + names
    handles += [Line2D([], [], color="#000000", linewidth=0.9, label="path")]
    if grasped:
        handles.append(Line2D([], [], color=OBJECT, linewidth=4.0, alpha=0.6, label="object between contacts"))
    figure.legend(handles=handles, loc="lower center", ncol=legend_columns, borderaxespad=0.2, columnspacing=1.2)
    return [sheet.save(figure, arguments.target)]


def readable(name):
    """normal_N_arm_a -> normal, arm a."""
    quantity, _, arm = name.partition("_arm_")
    for unit in ("_Nm", "_N"):
        quantity = quantity.removesuffix(unit)
    return quantity.replace("_", " ") + (f", arm {arm}" if arm else "")


def draw_reach(arguments, sheet):
    """Tip positions of the sampled target arm, with those that need assistance in another colour."""
    table = columns(arguments.source)
    if "beyond" not in table:
        raise wrong_file(arguments.source, "no column 'beyond'", "tandem cooperative reach --csv")
    ok = table["status"] == "ok"
    if not ok.any():
        raise Failure(f"{arguments.source}: found no joint vector with status ok, expected at least one whose arms are in contact")
    beyond = ok & (table["beyond"] > 0)
    down = 1 if sheet.columns == 2 else 2
    figure, axes = plt.subplots(down, 2 // down, figsize=sheet.size(86 * down), squeeze=False, layout="constrained")
    points = None
    for ax, (one, other) in zip(axes.ravel(), (("x", "z"), ("y", "z"))):
        ax.scatter(MM * table[one][ok & ~beyond], MM * table[other][ok & ~beyond], s=1, color="#A0A0A0", rasterized=True)
        points = ax.scatter(MM * table[one][beyond], MM * table[other][beyond], s=2.5, c=MM * table["beyond"][beyond],
                            cmap="viridis", rasterized=True)
        ax.set_xlabel(f"{one} (mm)")
        ax.set_ylabel(f"{other} (mm)")
        ax.set_aspect("equal")
    figure.colorbar(points, ax=axes, label="beyond the target's own reach (mm)")
    dot = {"linestyle": "", "marker": "o", "markersize": 3}
    legend_below(figure, [Line2D([], [], color="#A0A0A0", label=f"reached alone, too ({(ok & ~beyond).sum()})", **dot),
                          Line2D([], [], color="#21918C", label=f"only with assistance ({beyond.sum()})", **dot)],
                 2 if sheet.columns == 2 else 1)
    return [sheet.save(figure, arguments.target)]


def draw_payload(arguments, sheet):
    """Stiffness (upper row) and payload (lower row) of each carrier in the planes of the robot's axes."""
    table, carriers = columns(arguments.source), arguments.carriers
    if "payload" not in table:
        raise wrong_file(arguments.source, "no column 'payload'", "tandem cooperative payload --csv")
    if len(carriers) <= np.max(table["carrier"]):
        raise Failure(f"{arguments.source}: found {int(np.max(table['carrier'])) + 1} carriers, expected the {len(carriers)} "
                      f"that are named: {', '.join(carriers)}")
    quantities = (("stiffness", "stiffness (N/m)"), ("payload", "payload (N)"))
    wide = sheet.columns == 2
    shape = (2, 3) if wide else (3, 2)
    figure, axes = plt.subplots(*shape, figsize=sheet.size(shape[0] * (58 if wide else 48) + 10), layout="constrained",
                                subplot_kw={"projection": "polar"})
    for row, (name, label) in enumerate(quantities):
        for plane in range(3):
            ax = axes[row, plane] if wide else axes[plane, row]
            for carrier in range(len(carriers)):
                chosen = (table["carrier"] == carrier) & (table["plane"] == plane) & (table["stiffness"] > 0)
                if chosen.any():
                    closed = np.append(np.flatnonzero(chosen), np.flatnonzero(chosen)[0])
                    ax.plot(table["angle"][closed], table[name][closed], color=ARMS[carrier % len(ARMS)],
                            linestyle=("-", (0, (4, 1.5)), (0, (1, 1)))[carrier % 3])
            first, second = "xyz"[plane], "xyz"[(plane + 1) % 3]
            ax.set_xticks([0, np.pi / 2, np.pi, 3 * np.pi / 2], [f"+{first}", f"+{second}", f"-{first}", f"-{second}"])
            ax.tick_params(pad=0)
            ax.yaxis.set_major_locator(MaxNLocator(3, prune="lower"))
            ax.set_rmin(0)
            ax.set_rlabel_position(45)
            ax.set_title(label, pad=7)
    handles = [Line2D([], [], color=ARMS[k % len(ARMS)], linestyle=("-", (0, (4, 1.5)), (0, (1, 1)))[k % 3],
                      label="all arms" if k == 0 else f"{name} alone") for k, name in enumerate(carriers)]
    legend_below(figure, handles, 4 if wide else 2)
    return [sheet.save(figure, arguments.target)]


def draw(arguments, sheet):
    return {"track": draw_track, "reach": draw_reach, "payload": draw_payload}[arguments.kind](arguments, sheet)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(dest="kind", required=True)
    for kind in ("track", "payload", "reach"):
        one = kinds.add_parser(kind)
        one.add_argument("source", type=pathlib.Path, metavar="CSV")
        if kind == "track":
            one.add_argument("shapes", type=pathlib.Path, metavar="SHAPES")
        one.add_argument("target", type=figure_file, metavar="FILE")
        if kind == "payload":
            one.add_argument("carriers", nargs="+", metavar="NAME")
        add_options(one, folder=False)
    return run("cooperative.py", draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
