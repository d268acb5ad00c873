# SPDX-License-Identifier: Apache-2.0
"""Draws what `tandem stability --map` and `tandem workspace` leave as CSV files (docs/csv.md).

    mechanics.py map CSV PNG              stability over rotations relative to tube 1
    mechanics.py workspace CSVDIR FIGDIR  reachable cells: FIGDIR/workspace-section.png and FIGDIR/workspace-volume.png

Files written are listed on standard output. Ends with 1 where a file is missing or is not of this format, with 2 where
the command line is wrong.
"""

import json
import pathlib
import sys

import numpy as np
from matplotlib.colors import LogNorm, Normalize, TwoSlopeNorm
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from figures import MM, Failure, plt, read_csv

DEGREES = 180 / np.pi
ARMS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#999999", "#000000"]  # Okabe and Ito
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
    ax.plot(DEGREES * table[axis], table["stability"], color="#0072B2", linewidth=1.6)
    ax.axhline(0.0, color="#E31A1C", linewidth=1.0)
    ax.set_ylabel("stability: smallest determinant along the arm")


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
    figure.colorbar(mesh, ax=ax, label="stability: smallest determinant along the arm",
                    extend="min" if lowest < -1.0 else "neither")
    handles = []
    if lowest < 0.0:
        points = table["conjugate_points"].reshape(shape)
        ax.contour(x, y, points, levels=[0.5], colors="black", linewidths=1.2)
        handles.append(Line2D([], [], color="black", linewidth=1.2, label="stability lost"))
    if "stable_equilibria" in table:
        several = table["stable_equilibria"].reshape(shape)
        if np.nanmax(several) > 1.5:
            ax.contour(x, y, several, levels=[1.5], colors="#E31A1C", linewidths=1.2, linestyles="--")
            handles.append(Line2D([], [], color="#E31A1C", linestyle="--", label="several stable equilibria beyond"))
    if handles:
        ax.legend(handles=handles, loc="upper right", framealpha=0.9)
    ax.set_aspect("equal")


def draw_map(source, target):
    """The figure of one map; the file written."""
    table = columns(source)
    axes = [name for name in table if name.startswith("relative_")]
    if not 1 <= len(axes) <= 2 or "stability" not in table:
        raise Failure(f"{source}: not a map of `tandem stability`")
    angle = r"\theta" if "alpha_1" in table else r"\alpha"  # at the ends, or at the motors
    figure, ax = plt.subplots(figsize=(6.4, 5.2), layout="constrained")
    if len(axes) == 1:
        draw_line(ax, table, axes[0])
    else:
        draw_plane(figure, ax, table, axes)
        ax.set_ylabel(rf"${angle}_{axes[1][-1]} - {angle}_1$ (deg)")
    ax.set_xlabel(rf"${angle}_{axes[0][-1]} - {angle}_1$ (deg)")
    ax.set_title("stability over " + ("end angles" if "alpha_1" in table else "motor angles, from cold starts"))
    target.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(target)
    return [target]


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


def draw_section(arms, summary):
    """r-z sections, cell by cell, coloured by how many samples fell into them."""
    voxel = summary["voxel_m"]
    height = max(np.ptp(arm.section()[1]) for arm in arms)
    width = max(1.8, 5.0 * max(np.ptp(arm.section()[0]) for arm in arms) / height)  # inches, at 5 for the height
    figure, axes = plt.subplots(1, len(arms), figsize=(min(width + 0.6, 6.0) * len(arms) + 1.4, 6.2), squeeze=False,
                                sharey=True, layout="constrained")
    figure.suptitle(f"{summary['robot']}, {summary['model']} model:\nreachable cells of {MM * voxel:g} mm")
    for ax, arm, facts in zip(axes[0], arms, summary["arms"]):
        r, z = arm.section()
        edges = [np.arange(np.floor(v.min() / voxel), np.floor(v.max() / voxel) + 2) * voxel for v in (r, z)]
        count, _, _ = np.histogram2d(r, z, bins=edges)
        mesh = ax.pcolormesh(MM * edges[0], MM * edges[1], np.ma.masked_equal(count.T, 0), cmap="viridis",
                             norm=LogNorm(vmin=1, vmax=max(count.max(), 2)))
        ax.set_title(f"{arm.name}: {1e6 * facts['volume_m3']:.0f} cm³")
        ax.set_xlabel("r from the arm's axis (mm)")
        ax.set_aspect("equal")
    axes[0, 0].set_ylabel("z (mm)")
    figure.colorbar(mesh, ax=axes[0], label="samples per cell")
    return figure


def draw_volume(arms, summary):
    """Tips of all arms in space."""
    random = np.random.default_rng(summary["seed"])
    figure = plt.figure(figsize=(7.2, 6.4), layout="constrained")
    ax = figure.add_subplot(projection="3d")
    clouds = [MM * arm.cloud(POINTS // len(arms), random) for arm in arms]
    for arm, cloud, color in zip(arms, clouds, ARMS):
        ax.scatter(*cloud.T, s=1.2, color=color, alpha=0.35, label=arm.name, rasterized=True)
    everything = np.concatenate(clouds)
    ax.set_box_aspect(np.maximum(np.ptp(everything, axis=0), 1e-3), zoom=0.85)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(4))
    ax.set_xlabel("x (mm)")
    ax.set_ylabel("y (mm)")
    ax.set_zlabel("z (mm)")
    title = f"{summary['robot']}: reachable tips"
    if "shared" in summary:
        title += f"; every arm reaches {1e6 * summary['shared']['common_m3']:.0f} cm³"
    ax.set_title(title)
    legend = ax.legend(loc="upper left", markerscale=6)
    for handle in legend.legendHandles:
        handle.set_alpha(1.0)
    return figure


def draw_workspace(source, target):
    """Both figures of a workspace; the files written."""
    path = source / "workspace.json"
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
        arms = [Reach(source, facts) for facts in summary["arms"] if facts["reached"]]
    except OSError as error:
        raise Failure(f"{path}: {error.strerror}") from error
    except (KeyError, ValueError) as error:
        raise Failure(f"{path}: not of `tandem workspace`: {error}") from error
    if not arms:
        raise Failure(f"{path}: no arm reaches anything")
    target.mkdir(parents=True, exist_ok=True)
    written = []
    for name, draw in (("section", draw_section), ("volume", draw_volume)):
        written.append(target / f"workspace-{name}.png")
        figure = draw(arms, summary)
        figure.savefig(written[-1])
        plt.close(figure)
    return written


def main():
    kinds = {"map": draw_map, "workspace": draw_workspace}
    if len(sys.argv) != 4 or sys.argv[1] not in kinds:
        print(__doc__.strip(), file=sys.stderr)
        return 0 if sys.argv[1:] in (["--help"], ["-h"]) else 2
    try:
        for path in kinds[sys.argv[1]](pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])):
            print(path)
    except Failure as failure:
        print(f"mechanics.py: {failure}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"mechanics.py: {error.filename}: {error.strerror}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
