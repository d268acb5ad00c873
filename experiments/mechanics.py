# SPDX-License-Identifier: Apache-2.0
"""Draws what `tandem stability --map` and `tandem workspace` leave as CSV files (docs/csv.md).

    mechanics.py map CSV FILE             stability over rotations relative to tube 1
    mechanics.py workspace CSVDIR FIGDIR  reachable cells: FIGDIR/workspace-section and FIGDIR/workspace-volume

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
from matplotlib.ticker import MaxNLocator, MultipleLocator
from style import ARMS, INCH, MM, Failure, add_options, equal_space, figure_file, legend_below, plt, read_csv, run

DEGREES = 180 / np.pi
POINTS = 12000  # of the 3-D figure, over all arms


def columns(path):
    """Numbers of a CSV file by column name, NaN for empty fields; `status` stays text."""
    try:
        return {name: np.array(values) if name == "status" else np.array([float(x) if x else np.nan for x in values])
                for name, values in read_csv(path).items()}
    except (TypeError, ValueError) as error:
        raise Failure(f"{path}: not numbers: {error}") from error


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
        raise Failure("the map is no full grid")
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
        raise Failure(f"{source}: not a map of `tandem stability`")
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
        raise Failure(f"{path}: not of `tandem workspace`: {error}") from error
    if not arms:
        raise Failure(f"{path}: no arm reaches anything")
    return [sheet.save(draw(sheet, arms, summary), arguments.target / f"workspace-{name}.{sheet.format}")
            for name, draw in (("section", draw_section), ("volume", draw_volume))]


def draw(arguments, sheet):
    return {"map": draw_map, "workspace": draw_workspace}[arguments.kind](arguments, sheet)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(dest="kind", required=True)
    for kind, target, name in (("map", figure_file, "FILE"), ("workspace", pathlib.Path, "FIGDIR")):
        one = kinds.add_parser(kind)
        one.add_argument("source", type=pathlib.Path, metavar="CSV" if kind == "map" else "CSVDIR")
        one.add_argument("target", type=target, metavar=name)
        add_options(one, folder=kind == "workspace")
    return run("mechanics.py", draw, parser.parse_args())


if __name__ == "__main__":
    sys.exit(main())
