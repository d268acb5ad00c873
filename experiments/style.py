# SPDX-License-Identifier: Apache-2.0
"""Style of all figures: sizes on paper, fonts, colours, lines and markers of the methods, output files.

Figures have no title: the caption of a document has it. Sizes are those of a journal page, one column of 88 mm or two of
180 mm; fonts are 7 and 8 points at this size.
"""

import argparse
import csv
import math
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator  # noqa: E402

WIDTHS = {1: 88.0, 2: 180.0}  # columns of a page: mm
INCH = 25.4  # mm
MM = 1e3
FORMATS = ("png", "pdf", "svg")
FLOOR = 1e-4  # mm; errors below are drawn here on logarithmic axes
LEGEND_ROW = 0.17  # inches
HANDLE = 4.6  # length of a line in a legend, in font sizes

# Colours that colour-blind readers distinguish too (after Okabe and Ito), and a dash pattern each, so that print in grey does.
# nspqp, which snsqp often coincides with, is a broad line under a narrow one.
METHODS = {
    "nsp": {"color": "#8C8C8C", "linestyle": (0, (1, 2)), "marker": "v", "linewidth": 1.4},
    "nspwln": {"color": "#D55E00", "linestyle": (0, (7, 1.5)), "marker": "s", "linewidth": 1.2},
    "nspwln-joint": {"color": "#009E73", "linestyle": (0, (7, 1.5, 1.2, 1.5)), "marker": "D", "linewidth": 1.2},
    "nspqp": {"color": "#56B4E9", "linestyle": "-", "marker": "o", "linewidth": 2.4},
    "snsqp": {"color": "#000000", "linestyle": (0, (3, 1.5)), "marker": "^", "linewidth": 1.0},
    "sns": {"color": "#0072B2", "linestyle": (0, (3, 1.3, 1, 1.3, 1, 1.3)), "marker": "P", "linewidth": 1.2},
    "hqp": {"color": "#E69F00", "linestyle": (0, (1.6, 0.8)), "marker": "X", "linewidth": 1.4},
    "foreign": {"color": "#CC79A7", "linestyle": (0, (9, 2, 3, 2)), "marker": "*", "linewidth": 1.2},
}
ARMS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#8C8C8C", "#000000"]
TUBES = ["#000000", "#0072B2", "#E69F00", "#8C8C8C", "#009E73", "#CC79A7", "#56B4E9", "#D55E00"]

plt.rcParams.update({
    "font.family": "DejaVu Sans", "font.size": 7, "axes.labelsize": 7, "axes.titlesize": 7, "xtick.labelsize": 6.5, "ytick.labelsize": 6.5,
    "legend.fontsize": 7, "legend.frameon": False, "legend.handlelength": HANDLE, "axes.grid": True, "grid.color": "#E0E0E0",
    "grid.linewidth": 0.5, "axes.linewidth": 0.6, "xtick.major.width": 0.6, "ytick.major.width": 0.6, "lines.linewidth": 1.1,
    "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False, "axes.titlepad": 3, "pdf.fonttype": 42,
    "svg.hashsalt": "tandem"})


class Failure(Exception):
    """A file that is missing or not of the format."""


def wrong_file(path, found, command):
    """Failure of a file that another command has written, or that lacks data: `found` is "no column 'x'"."""
    return Failure(f"{path}: found {found}, expected the output of `{command}`")


def reason(error):
    """Text of an error that a wrong file causes: a missing key, or a value of another form."""
    return f"no {error}" if isinstance(error, KeyError) else f"a value of another form ({error})"


def read_csv(path):
    """Columns of a CSV file by name, as lists of text."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise Failure(f"{path}: {error.strerror}") from error
    if not rows:
        raise Failure(f"{path}: found no rows, expected at least one below the header")
    return {name: [row[name] for row in rows] for name in rows[0]}


def method_order(method):
    names = list(METHODS)
    return names.index(method) if method in names else len(names)


def method_style(method):
    return METHODS.get(method, METHODS["foreign"])


def line_style(method):
    """Keywords of `plot` for the line of a method, without markers."""
    return {key: value for key, value in method_style(method).items() if key != "marker"}


class Sheet:
    """Size and file type of the figures of one command."""

    def __init__(self, arguments):
        self.columns, self.dpi, self.format = arguments.width, arguments.dpi, getattr(arguments, "format", None)

    def size(self, height):
        """Width and height in inches. @param height  mm"""
        return WIDTHS[self.columns] / INCH, height / INCH

    def beside(self, panels, most):
        """Number of panels in a row, of which a page of two columns has `most`."""
        return max(1, min(panels, most if self.columns == 2 else most // 2))

    def save(self, figure, path):
        """Writes and closes a figure; the ending of the file is its type. @return the file"""
        path.parent.mkdir(parents=True, exist_ok=True)
        moment = {".pdf": "CreationDate", ".svg": "Date"}.get(path.suffix)  # equal figures are equal files
        figure.savefig(path, dpi=self.dpi, metadata={moment: None} if moment else None)
        plt.close(figure)
        return path


def figure_file(text):
    path = pathlib.Path(text)
    if path.suffix[1:] not in FORMATS:
        raise argparse.ArgumentTypeError(f"found '{text}', expected a file that ends in .png, .pdf or .svg")
    return path


def dots_per_inch(text):
    if not text.isdecimal() or not 30 <= int(text) <= 2400:
        raise argparse.ArgumentTypeError(f"found '{text}', expected 30 to 2400")
    return int(text)


def add_options(parser, folder):
    """The options of all figures. @param folder  several figures: --format instead of the ending of a file"""
    parser.add_argument("--width", type=int, choices=sorted(WIDTHS), default=2, help="columns of a page: 88 or 180 mm")
    parser.add_argument("--dpi", type=dots_per_inch, default=200, help="of a PNG, and of images in PDF and SVG")
    if folder:
        parser.add_argument("--format", choices=FORMATS, default="png")


def run(script, draw, arguments):
    """Draws and lists the files. @return the exit code: 1 where a file is missing or is not of its format"""
    try:
        for path in draw(arguments, Sheet(arguments)):
            print(path)
    except Failure as failure:
        print(f"{script}: {failure}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"{script}: {error.filename}: {error.strerror}", file=sys.stderr)
        return 1
    return 0


def legend_below(figure, handles, columns):
    """A legend under all axes of a figure with constrained layout."""
    rows = math.ceil(len(handles) / columns)
    height = (LEGEND_ROW * rows + 0.1) / figure.get_figheight()
    figure.get_layout_engine().set(rect=(0, height, 1, 1 - height))
    figure.legend(handles=handles, loc="lower center", ncol=min(columns, len(handles)), borderaxespad=0.2, columnspacing=1.2)


def log_axis(axis, lower, upper):
    """Ticks of a logarithmic axis from `lower` to `upper`: decades, or 1-2-5 where there are few of them; plain numbers."""
    decades = math.log10(upper / lower)
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if decades < 2 else (1,), numticks=8 if decades < 2 else 6))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def signed_log_axis(ax, threshold, values):
    """A vertical axis that is linear to the threshold and logarithmic beyond it, with few ticks."""
    ax.set_yscale("symlog", linthresh=threshold, linscale=0.5)
    lower, upper = (float(np.nanmin(values)), float(np.nanmax(values))) if np.isfinite(values).any() else (0.0, 1.0)
    decades = threshold * 10.0 ** np.arange(0, 8)
    ticks = [t for t in decades if t <= max(upper, threshold)]
    ticks = ticks[:: 1 + len(ticks) // 4]
    below = [-t for t in decades if t <= -lower]
    ax.yaxis.set_major_locator(FixedLocator([*below[:: 1 + len(below) // 2][::-1], 0.0, *ticks]))
    ax.yaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def zoom_from_zero(ax, values, least):
    """Vertical limits of numbers that may all be zero up to rounding. @param least  smallest range that is drawn"""
    lower, upper = min(0.0, float(np.nanmin(values))), max(0.0, float(np.nanmax(values)))
    room = 0.05 * max(upper - lower, least)
    ax.set_ylim(lower - room, lower + max(upper - lower, least) + room)


def equal_space(ax, points, ticks=3):
    """Axes of a figure in space: equal scales, room for all points, few ticks, labels in mm.

    @param points  n x 3, mm
    """
    lower, upper = points.min(axis=0), points.max(axis=0)
    extent = np.maximum(upper - lower, 0.12 * (upper - lower).max())
    middle = 0.5 * (lower + upper)
    for k, name in enumerate("xyz"):
        getattr(ax, f"set_{name}lim")(middle[k] - 0.5 * extent[k], middle[k] + 0.5 * extent[k])
        share = extent[k] / extent.max()
        axis = getattr(ax, f"{name}axis")
        axis.set_major_locator(plt.MaxNLocator(ticks + 1 if share > 0.5 else 3 if share > 0.2 else 1, min_n_ticks=1))
        axis.set_tick_params(pad=1 if name == "z" else -2)
        getattr(ax, f"set_{name}label")(f"{name} (mm)", labelpad=8 if name == "z" else -6)
    ax.set_box_aspect(extent, zoom=0.92)
