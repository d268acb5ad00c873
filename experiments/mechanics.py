# SPDX-License-Identifier: Apache-2.0
"""Figures from the CSV files of `tandem stability --map` and `tandem workspace` (docs/csv.md), and from `tandem show --json`.

    mechanics.py map CSV FILE             stability over rotations relative to tube 1
    mechanics.py workspace CSVDIR FIGDIR  reachable cells: FIGDIR/workspace-section and FIGDIR/workspace-volume
    mechanics.py show JSON FILE           arms, reach and paths, from the front and from the side

FILE ends in .png, .pdf or .svg, `workspace` takes --format instead; both take --dpi N and --width 1|2. Files
written are listed on standard output. Ends with 1 where a file is missing or is not of this format, with 2 where
the command line is wrong.
"""

import argparse
import json
import pathlib
import sys

import numpy as np
from matplotlib.colors import LogNorm, Normalize, TwoSlopeNorm
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator, MultipleLocator
from style import ARMS, INCH, MM, Failure, add_options, equal_space, figure_file, legend_below, plt, read_csv, reason, run, wrong_file

DEGREES = 180 / np.pi
POINTS = 12000  # of the 3-D figure, over all arms


def columns(path):
    """Numbers of a CSV file by column name, NaN for empty fields; `status` stays text."""
    try:
        return {name: np.array(values) if name == "status" else np.array([float(x) if x else np.nan for x in values])
                for name, values in read_csv(path).items()}
    except (TypeError, ValueError) as error:
        raise Failure(f"{path}: found a field that is not a number ({error}), expected numbers in all columns but status") from error


def draw_line(ax, table, axis):
    """Stability over one relative rotation."""
    ax.plot(DEGREES * table[axis], table["stability"], color="#0072B2")
    ax.axhline(0.0, color="#E31A1C", linewidth=0.8)
    ax.set_ylabel("stability: least determinant (-)")


def draw_plane(figure, ax, table, axes):
    """Stability over two relative rotations, with the line where it is zero and where there is more than one answer."""
    places = [np.unique(table[axis]) for axis in axes]
    shape = [len(place) for place in places][::-1]  # the first axis runs fastest
    if shape[0] * shape[1] != len(table["stability"]):
        raise Failure(f"found {len(table['stability'])} rows, expected {shape[0]} x {shape[1]}: one for each pair of "
                      f"{axes[0]} and {axes[1]}")
    value = table["stability"].reshape(shape)
    x, y = (DEGREES * place for place in places)
    lowest = np.nanmin(value)
    if lowest < 0.0:
        style = {"cmap": "RdYlBu", "norm": TwoSlopeNorm(vmin=max(lowest, -1.0), vcenter=0.0, vmax=1.0)}
    else:
        style = {"cmap": "viridis", "norm": Normalize(vmin=0.0, vmax=1.0)}
    mesh = ax.pcolormesh(x, y, np.maximum(value, -1.0), shading="nearest", **style)
    figure.colorbar(mesh, ax=ax, label="stability: least determinant (-)",
                    extend="min" if lowest < -1.0 else "neither")
    handles = []
    if lowest < 0.0:
        points = table["conjugate_points"].reshape(shape)
        ax.contour(x, y, points, levels=[0.5], colors="black", linewidths=0.9)
        handles.append(Line2D([], [], color="black", linewidth=0.9, label="stability lost"))
    if "stable_equilibria" in table:
        several = table["stable_equilibria"].reshape(shape)
        if np.nanmax(several) > 1.5:
            ax.contour(x, y, several, levels=[1.5], colors="#E31A1C", linewidths=0.9, linestyles="--")
            handles.append(Line2D([], [], color="#E31A1C", linestyle="--", label="several stable equilibria beyond"))
    if handles:
        legend_below(figure, handles, 2 if figure.get_figwidth() > 4 else 1)
    ax.set_aspect("equal")


def draw_map(arguments, sheet):
    """The figure of one map; the file written."""
    source = arguments.source
    table = columns(source)
    axes = [name for name in table if name.startswith("relative_")]
    if not 1 <= len(axes) <= 2 or "stability" not in table:
        raise wrong_file(source, "no column 'stability', or not one or two columns relative_*", "tandem stability --map")
    angle = r"\theta" if "alpha_1" in table else r"\alpha"  # at the ends, or at the motors
    figure, ax = plt.subplots(figsize=sheet.size((55 if len(axes) == 1 else 78) if sheet.columns == 1 else 110),
                              layout="constrained")
    if len(axes) == 1:
        draw_line(ax, table, axes[0])
    else:
        draw_plane(figure, ax, table, axes)
        ax.set_ylabel(rf"${angle}_{axes[1][-1]} - {angle}_1$ (deg)")
    ax.set_xlabel(rf"${angle}_{axes[0][-1]} - {angle}_1$ (deg)")
    ax.xaxis.set_major_locator(MultipleLocator(90))
    if len(axes) == 2:
        ax.yaxis.set_major_locator(MultipleLocator(90))
    return [sheet.save(figure, arguments.target)]


def rotation(x, y, z, w):
    """Matrix of a unit quaternion."""
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


class Reach:
    """What one arm reaches: tips in the arm's base frame, and the base in the robot's."""

    def __init__(self, folder, summary):
        self.name, self.symmetric = summary["arm"], summary["symmetric"]
        self.position = np.array(summary["base"][:3])
        self.rotation = rotation(*summary["base"][3:])
        table = columns(folder / f"workspace-{self.name}.csv")
        tips = np.stack([table[axis] for axis in "xyz"], axis=1)[table["status"] == "ok"]
        self.tip = (tips - self.position) @ self.rotation

    def section(self):
        """Distance from the base's axis and height, m."""
        return np.hypot(self.tip[:, 0], self.tip[:, 1]), self.tip[:, 2]

    def cloud(self, count, random):
        """So many tips in the robot's base frame; those of a solid of revolution turned anywhere."""
        tip = self.tip[random.permutation(len(self.tip))[:count]]
        if self.symmetric:
            angle = random.uniform(-np.pi, np.pi, len(tip))
            x = np.cos(angle) * tip[:, 0] - np.sin(angle) * tip[:, 1]
            y = np.sin(angle) * tip[:, 0] + np.cos(angle) * tip[:, 1]
            tip = np.stack([x, y, tip[:, 2]], axis=1)
        return tip @ self.rotation.T + self.position


def draw_section(sheet, arms, summary):
    """r-z sections, cell by cell, coloured by how many samples fell into them."""
    voxel = summary["voxel_m"]
    down = -(-len(arms) // sheet.beside(len(arms), 4))
    figure, axes = plt.subplots(down, -(-len(arms) // down), figsize=sheet.size(92 * down), squeeze=False, sharey=True,
                                layout="constrained")
    counts = []
    for arm in arms:
        r, z = arm.section()
        edges = [np.arange(np.floor(v.min() / voxel), np.floor(v.max() / voxel) + 2) * voxel for v in (r, z)]
        counts.append((edges, np.histogram2d(r, z, bins=edges)[0]))
    norm = LogNorm(vmin=1, vmax=max(2, max(count.max() for _, count in counts)))
    mesh = None
    for ax, arm, facts, (edges, count) in zip(axes.ravel(), arms, summary["arms"], counts):
        mesh = ax.pcolormesh(MM * edges[0], MM * edges[1], np.ma.masked_equal(count.T, 0), cmap="viridis", norm=norm,
                             rasterized=True)
        ax.set_title(f"{arm.name}: {1e6 * facts['volume_m3']:.0f} cm³")
        ax.set_xlabel("r (mm)")
        ax.set_ylabel("z (mm)")
        ax.set_aspect("equal")
        ax.xaxis.set_major_locator(MaxNLocator(3))
    for unused in axes.ravel()[len(arms):]:
        unused.set_visible(False)
    figure.colorbar(mesh, ax=axes, label=f"samples in a cell of {MM * voxel:g} mm")
    return figure


def draw_volume(sheet, arms, summary):
    """Tips of all arms in space."""
    random = np.random.default_rng(summary["seed"])
    figure = plt.figure(figsize=sheet.size(95 if sheet.columns == 1 else 120))
    height = INCH * figure.get_figheight()
    ax = figure.add_axes((0.02, 14 / height, 0.9, 1 - 15 / height), projection="3d")
    clouds = [MM * arm.cloud(POINTS // len(arms), random) for arm in arms]
    for cloud, color in zip(clouds, ARMS):
        ax.scatter(*cloud.T, s=0.6, color=color, alpha=0.35, linewidths=0, rasterized=True)
    equal_space(ax, np.concatenate(clouds))
    handles = [Line2D([], [], color=color, linestyle="", marker="o", markersize=3, label=arm.name)
               for arm, color in zip(arms, ARMS)]
    figure.legend(handles=handles, loc="lower center", ncol=4, borderaxespad=0.2)
    return figure


def draw_workspace(arguments, sheet):
    """Both figures of a workspace; the files written."""
    path = arguments.source / "workspace.json"
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
        arms = [Reach(arguments.source, facts) for facts in summary["arms"] if facts["reached"]]
    except OSError as error:
        raise Failure(f"{path}: {error.strerror}") from error
    except (KeyError, ValueError) as error:
        raise wrong_file(path, reason(error), "tandem workspace --csv") from error
    if not arms:
        raise Failure(f"{path}: found no arm with reached positions, expected at least one; use more samples, or wider limits")
    return [sheet.save(draw(sheet, arms, summary), arguments.target / f"workspace-{name}.{sheet.format}")
            for name, draw in (("section", draw_section), ("volume", draw_volume))]


def silhouette(arm, across, window):
    """Grid of a panel, and where what the arm's tip reaches is in front of or behind it.

    @param across  index of the panel's horizontal axis  @param window  (left, right, bottom, top), mm
    """
    base, position = rotation(*arm["base"][3:]), np.array(arm["base"][:3])
    x, y = np.meshgrid(np.linspace(*window[:2], 160), np.linspace(*window[2:], 240))
    inside = np.zeros(x.shape, dtype=bool)
    outline = np.array(arm["reach"]["outline_z_least_r_largest_r_m"])
    angle = np.linspace(0, 2 * np.pi, 49)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rings = [np.column_stack([radius * circle, np.full(len(circle), height)]) for height, _, radius in outline]
    for slice_ in zip(rings, rings[1:] or rings):
        place = MM * (np.concatenate(slice_) @ base.T + position)[:, [across, 2]]
        inside |= convex(place).contains_points(np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)
    return x, y, inside


def convex(points):
    """Path of the convex hull of points in a plane (monotone chain)."""
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))]

    def chain(places):
        hull = []
        for place in places:
            while len(hull) > 1 and np.linalg.det([hull[-1] - hull[-2], place - hull[-2]]) <= 0:
                hull.pop()
            hull.append(place)
        return hull[:-1]
    return Path(np.array(chain(ordered) + chain(ordered[::-1])))


def draw_side(ax, facts, view, window):
    """One panel of `tandem show`: reach, arms, place of least clearance, paths. @param view  indices of its two axes"""
    across = view[0]
    for arm, color in zip(facts.get("arms", []), ARMS):
        if arm.get("reach"):
            x, y, inside = silhouette(arm, across, window)
            ax.contourf(x, y, inside, levels=[0.5, 1.5], colors=[color], alpha=0.1)
            ax.contour(x, y, inside, levels=[0.5], colors=[color], linewidths=0.6, linestyles="--")
    for arm, color in zip(facts.get("arms", []), ARMS):
        place = MM * np.array(arm["shape_m"])[:, view]
        radii = arm.get("piece_radii_m") or [arm["tube_radii_m"][0]] * (len(place) - 1)
        for radius in sorted(set(radii)):  # thicker tubes are wider lines
            pieces = [k for k, each in enumerate(radii) if each == radius]
            width = 0.8 + 1.2 * radius / max(radii)
            ax.plot(*place[pieces[0]:pieces[-1] + 2].T, color=color, linewidth=width, solid_capstyle="round")
    for path in facts.get("paths", []):
        place = MM * np.array(path["path_m"])[:, view]
        ax.plot(*place.T, color="#CC00CC", linewidth=0.9)
    for pair in facts.get("clearance", []):
        ends = MM * np.array([pair["place_m"], pair["other_place_m"]])[:, view]
        ax.plot(*ends.T, color="#E31A1C", linewidth=0.8, marker="o", markersize=2.5, markerfacecolor="none")
    ax.set_xlim(*window[:2])
    ax.set_ylim(*window[2:])
    ax.set_aspect("equal")
    ax.set_xlabel(f"{'xy'[across]} (mm)")
    ax.xaxis.set_major_locator(MaxNLocator(4))


def show_handles(facts):
    arms = facts.get("arms", [])
    handles = [Line2D([], [], color=color, linewidth=1.8, label=arm["arm"]) for arm, color in zip(arms, ARMS)]
    if any(arm.get("reach") for arm in arms):
        handles.append(Line2D([], [], color="#606060", linewidth=0.6, linestyle="--", label="reach of a tip"))
    handles += [Line2D([], [], color="#E31A1C", linewidth=0.8, marker="o", markersize=2.5, markerfacecolor="none",
                       label=f"{pair['arm']} to {pair['other']}: {MM * pair['distance_m']:.2f} mm")
                for pair in facts.get("clearance", [])]
    names = ", ".join(path["name"] for path in facts.get("paths", []))
    if names:
        what = "path" if arms else "path from its start"
        handles.append(Line2D([], [], color="#CC00CC", linewidth=0.9, label=f"{what}: {names}"))
    return handles


def flat(facts):
    """Whether all arms are in the plane z = 0, as those of a planar robot."""
    return all(abs(place[2]) < 1e-9 for arm in facts["arms"] for place in arm["shape_m"])


def draw_show(arguments, sheet):
    """The figure of a file; the file written."""
    try:
        facts = json.loads(arguments.source.read_text(encoding="utf-8"))
        places = [MM * np.array(arm["shape_m"]) for arm in facts.get("arms", [])]
        places += [MM * np.array(path["path_m"]) for path in facts.get("paths", [])]
        for arm in facts.get("arms", []):
            if arm.get("reach"):
                radius, heights = arm["reach"]["radius_m"], arm["reach"]["z_m"]
                corners = np.array([(x, y, z) for x in (-radius, radius) for y in (-radius, radius) for z in heights])
                places.append(MM * (corners @ rotation(*arm["base"][3:]).T + np.array(arm["base"][:3])))
    except OSError as error:
        raise Failure(f"{arguments.source}: {error.strerror}") from error
    except (KeyError, ValueError) as error:
        raise wrong_file(arguments.source, reason(error), "tandem show --json") from error
    if not places:
        raise wrong_file(arguments.source, "neither arms nor paths", "tandem show --json")
    points = np.concatenate(places)
    middle, half = 0.5 * (points.min(axis=0) + points.max(axis=0)), 0.5 * np.ptp(points, axis=0)
    alone = not facts.get("arms")
    # A path in a plane is no line without height.
    half = np.maximum(half, (1.0 if alone else 0.15) * half.max()) + 0.08 * half.max()
    views = [[0, 2], [1, 2], [0, 1]] if alone else [[0, 1]] if flat(facts) else [[0, 2], [1, 2]]
    widths = [half[view[0]] for view in views]
    tallest = max(half[view[1]] for view in views)
    height = min(150, max(45, tallest / sum(widths) * (70 if sheet.columns == 1 else 150) + 28))
    figure, axes = plt.subplots(1, len(views), figsize=sheet.size(height), layout="constrained", width_ratios=widths)
    for view, ax in zip(views, axes := np.atleast_1d(axes)):
        draw_side(ax, facts, view, [middle[k] + sign * half[k] for k in view for sign in (-1, 1)])
        if ax is axes[0] or alone:
            ax.set_ylabel(f"{'xyz'[view[1]]} (mm)")
        else:
            ax.tick_params(labelleft=False)
    legend_below(figure, show_handles(facts), 3 if sheet.columns == 2 else 2)
    return [sheet.save(figure, arguments.target)]


def draw(arguments, sheet):
    return {"map": draw_map, "workspace": draw_workspace, "show": draw_show}[arguments.kind](arguments, sheet)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(dest="kind", required=True)
    for kind, target, name in (("map", figure_file, "FILE"), ("workspace", pathlib.Path, "FIGDIR"), ("show", figure_file, "FILE")):
        one = kinds.add_parser(kind)
        one.add_argument("source", type=pathlib.Path, metavar={"map": "CSV", "workspace": "CSVDIR", "show": "JSON"}[kind])
        one.add_argument("target", type=target, metavar=name)
        add_options(one, folder=kind == "workspace")
    return run("mechanics.py", draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
