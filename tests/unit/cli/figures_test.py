# SPDX-License-Identifier: Apache-2.0
"""Figures of all commands: file types and sizes, no text over another one or outside the sheet, a style for each method."""
import contextlib
import csv
import importlib
import io
import itertools
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402

sys.path.insert(0, str(system.SOURCE / "experiments"))
import matplotlib  # noqa: E402

matplotlib.use("Agg")
import matplotlib.figure  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.text import Text  # noqa: E402

METHODS = ("nsp", "nspwln", "nspwln-joint", "nspqp", "snsqp", "sns", "hqp")
RECORDINGS = system.SOURCE / "tests" / "archive" / "5e7986a" / "recordings"
SLACK = 1.0  # pixels


def texts(figure):
    """All texts that a drawn figure shows."""
    hidden, shown = set(), set()
    for axes in figure.axes:
        ticks = [axis for axis in (axes.xaxis, axes.yaxis, getattr(axes, "zaxis", None)) if axis is not None]
        for axis in ticks:
            lower, upper = sorted(axis.get_view_interval())
            room = 1e-6 * (lower if axis.get_scale() == "log" else upper - lower)
            hidden |= {text for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()) for text in (tick.label1, tick.label2)
                       if not lower - room <= tick.get_loc() <= upper + room}  # not drawn
        if not axes.get_visible():
            hidden |= set(axes.findobj(Text))
    for text in figure.findobj(Text):
        if text not in hidden and text.get_visible() and text.get_text().strip():
            shown.add(text)
    return shown


def corners(text, renderer):
    """The rectangle of a text, which may be turned: 4 x 2, pixels."""
    box = text.get_window_extent(renderer)
    middle = np.array([box.x0 + box.x1, box.y0 + box.y1]) / 2
    angle = text.get_rotation()
    text.set_rotation(0)
    flat = text.get_window_extent(renderer)
    text.set_rotation(angle)
    half = np.array([max(flat.width / 2 - SLACK, 0.1), max(flat.height / 2 - SLACK, 0.1)])
    turn = np.deg2rad(angle)
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return middle + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half @ matrix.T


def apart(one, other):
    """Whether an edge of one of two rectangles, or an axis of the sheet, separates them."""
    if (one.max(axis=0) < other.min(axis=0)).any() or (other.max(axis=0) < one.min(axis=0)).any():
        return True
    for rectangle in (one, other):
        for edge in (rectangle[1] - rectangle[0], rectangle[2] - rectangle[1]):
            a, b = one @ edge, other @ edge
            if a.max() < b.min() or b.max() < a.min():
                return True
    return False


def faults(figure):
    """Texts of a figure that lie over one another or outside the sheet."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    boxes = {text: corners(text, renderer) for text in texts(figure)}
    width, height = figure.bbox.width, figure.bbox.height
    found = [f"'{text.get_text()}' is outside the sheet" for text, box in boxes.items()
             if box.min() < -SLACK or box[:, 0].max() > width + SLACK or box[:, 1].max() > height + SLACK]
    for (one, first), (other, second) in itertools.combinations(boxes.items(), 2):
        if not apart(first, second):
            found.append(f"'{one.get_text()}' lies over '{other.get_text()}'")
    return found


def drawn(script, *arguments):
    """Runs a script in this process. @return files written, faults of their figures by file"""
    found, written = {}, []
    save = matplotlib.figure.Figure.savefig

    def checked(figure, path, **options):
        found[pathlib.Path(path).name] = faults(figure)
        written.append(pathlib.Path(path))
        save(figure, path, **options)

    class Here:
        """A pool of no processes, so that this process sees the figures."""

        def __init__(self, _):
            self.imap = map

        def __enter__(self):
            return self

        def __exit__(self, *_):
            return False

    module = importlib.import_module(script)
    matplotlib.figure.Figure.savefig, before = checked, sys.argv
    pool, sys.argv = getattr(module, "multiprocessing", None), [script, *map(str, arguments)]
    if pool:
        module.multiprocessing = type("Processes", (), {"Pool": Here})
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            code = module.main()
    finally:
        matplotlib.figure.Figure.savefig, sys.argv = save, before
        if pool:
            module.multiprocessing = pool
    assert code == 0, script
    return written, found


class Figures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        text = (system.PRESETS / "experiments" / "table3.yaml").read_text()
        text = re.sub(r"methods: .*", f"methods: [{', '.join(METHODS)}]", text).replace("points: 100", "points: 20")
        cls.experiment = cls.folder / "seven.yaml"
        cls.experiment.write_text(re.sub(r"robot: .*", "robot: ark2024", text))

    def command(self, *words):
        answer = system.run(*words, timeout=240)
        self.assertIn(answer.returncode, (0, 1), answer.stdout + answer.stderr)  # 1: a point that nsp does not reach

    def check(self, script, *arguments):
        """No text over another one, at both widths."""
        for width in (1, 2):
            _, found = drawn(script, *arguments, "--width", width)
            self.assertTrue(found)
            for name, bad in found.items():
                self.assertEqual(bad, [], f"{script} {name}, {width} columns")

    def test_experiment(self):
        self.command("experiment", self.experiment, "--offline", "--only", "lissajous-1-", "--csv", self.folder / "seven")
        self.check("figures", self.folder / "seven", self.folder / "figures")
        names = {path.name for path in (self.folder / "figures").iterdir()}
        self.assertEqual(names, {f"{kind}-lissajous-1.png" for kind in ("path", "actuation", "gaps", "steps", "errors")})

    def test_tips_of_an_experiment(self):
        """The tip in each row is as far from the target as its error says, and is not the target."""
        self.command("experiment", self.experiment, "--offline", "--only", "rectangle-1-nspqp", "--csv", self.folder / "one")
        with open(self.folder / "one" / "rectangle-1-nspqp.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            tip, target = (np.array([float(row[f"{what}_{axis}"]) for axis in "xyz"]) for what in ("tip", "target"))
            self.assertAlmostEqual(np.linalg.norm(tip - target), float(row["err_a"]), delta=1e-12)
        self.assertGreater(max(float(row["err_a"]) for row in rows), 1e-5)

    def test_monte_carlo_and_its_tables(self):
        table = self.folder / "mc.csv"
        self.command("montecarlo", "--tasks", 12, "--tip-noise-mm", "0,0.3", "--curvature-error", "0,5%", "--methods", ",".join(METHODS),
                     "--csv", table)
        self.check("montecarlo", table, self.folder / "mc.png")
        with open(self.folder / "mc.stats.csv", encoding="utf-8") as file:
            stats = {row["method"]: row for row in csv.DictReader(file)}
        with open(table, encoding="utf-8") as file:
            runs = [row for row in csv.DictReader(file) if row["feasible"] == "1" and float(row["tip_noise_mm"]) == 0 and
                    float(row["curvature_error"]) == 0]
        self.assertEqual(set(stats), set(METHODS))
        for method, row in stats.items():
            mine = [run for run in runs if run["method"] == method]
            self.assertEqual(int(row["tasks"]), len(mine))
            self.assertEqual(int(row["succeeded"]), sum(run["succeeded"] == "1" for run in mine))
            self.assertAlmostEqual(float(row["rms_a_mm_median"]), 1e3 * np.median([float(run["rms_a"]) for run in mine]))
        latex = (self.folder / "mc.stats.tex").read_text()
        self.assertEqual(latex.count(r"\\"), 1 + len(METHODS))

    def test_interval_of_a_median(self):
        """The chance that order statistics contain the median, from the binomial distribution; one further in is too narrow."""
        from math import comb

        from montecarlo import median_interval
        for n in (6, 9, 10, 37, 200, 1000):
            lower, upper = median_interval(np.arange(n, dtype=float))
            self.assertEqual(lower, n - 1 - upper)
            covered = [1 - 2 * sum(comb(n, k) for k in range(int(cut) + 1)) / 2 ** n for cut in (lower, lower + 1)]
            self.assertGreaterEqual(covered[0], 0.95, n)
            self.assertLess(covered[1], 0.95, n)

    def test_cooperative(self):
        for robot, options in (("co-manipulate", ()), ("target-assist", ("--shape", "circle", "--along", "x,y"))):
            self.command("cooperative", robot, "--offline", *options, "--figure", self.folder / f"{robot}.svg")
            self.check("cooperative", "track", self.folder / f"{robot}.csv", self.folder / f"{robot}.shapes.csv", self.folder / "track.png")
        self.command("cooperative", "reach", "--samples", 1500, "--csv", self.folder / "reach.csv")
        self.check("cooperative", "reach", self.folder / "reach.csv", self.folder / "reach.png")
        self.command("cooperative", "payload", "--directions", 8, "--csv", self.folder / "payload.csv")
        self.check("cooperative", "payload", self.folder / "payload.csv", self.folder / "payload.png", "both", "a", "b")

    def test_mechanics(self):
        for options in ((), ("--end-angles",), ("--tubes", "2")):
            self.command("stability", "--map", "--beta", "-0.3,-0.18,-0.064", "--resolution", 13, "--figure", self.folder / "map.pdf",
                         *options)
            self.check("mechanics", "map", self.folder / "map.csv", self.folder / "map.png")
        self.command("workspace", "--samples", 2000, "--model", "rigid", "--csv", self.folder / "workspace")
        self.check("mechanics", "workspace", self.folder / "workspace", self.folder / "workspace")

    def test_recordings(self):
        for name, arms, joints in (("lock-step", "arm_a,arm_b", "6,6"), ("catheters-lock-step", "arm_a,arm_b", "3,3")):
            self.command("export", RECORDINGS / f"{name}.mcap", "--indices", "--csv", self.folder / name)
            self.check("recording_figures", self.folder / name, self.folder / f"{name}-figures", "--arms", arms, "--joints", joints)

    def test_types_and_sizes(self):
        """Of the command line: type by ending or --format, width in the file; a wrong ending before the run."""
        self.command("experiment", self.experiment, "--offline", "--only", "rectangle-1-hqp", "--figures", self.folder / "typed",
                     "--format", "pdf", "--width", 1)
        for path in (self.folder / "typed").glob("*.*"):
            width = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ", path.read_bytes())
            self.assertAlmostEqual(float(width.group(1)), 88 / 25.4 * 72, delta=0.1, msg=path.name)
        self.assertEqual(len(list((self.folder / "typed").glob("*.pdf"))), 5)
        few = ("montecarlo", "--tasks", 6, "--methods", "nspqp")
        self.command(*few, "--figure", self.folder / "few.svg")
        self.assertIn(b"<svg", (self.folder / "few.svg").read_bytes()[:600])
        self.command(*few, "--figure", self.folder / "few.png", "--dpi", 100)
        width = int.from_bytes((self.folder / "few.png").read_bytes()[16:20], "big")
        self.assertAlmostEqual(width, 180 / 25.4 * 100, delta=1)
        answer = system.run(*few, "--figure", self.folder / "few.jpg")
        self.assertEqual(answer.returncode, 2)
        self.assertIn("few.jpg', expected a file that ends in .png, .pdf or .svg", answer.stderr)
        self.assertFalse((self.folder / "few.jpg").exists())

    def test_what_is_missing_is_named(self):
        stand_in = self.folder / "modules"
        stand_in.mkdir()
        (stand_in / "sitecustomize.py").write_text("import sys\nsys.modules['matplotlib'] = None\n")
        answer = system.run("show", "ark2024", "--figure", self.folder / "x.png", environment={"PYTHONPATH": str(stand_in)})
        self.assertEqual(answer.returncode, 1)
        self.assertIn("figures need python3-matplotlib", answer.stderr)
        (self.folder / "a-file").touch()
        answer = system.run("show", "ark2024", "--figure", self.folder / "a-file" / "x.png")
        self.assertEqual(answer.returncode, 1)
        self.assertNotIn("matplotlib", answer.stderr)
        self.assertNotIn("Traceback", answer.stderr)
        self.assertIn("a-file", answer.stderr)

    def test_files_of_other_commands_are_refused(self):
        folder = self.folder / "others"
        folder.mkdir()
        table, facts = folder / "table.csv", folder / "facts.json"
        table.write_text("a,b\n1,2\n")
        facts.write_text("{}")
        (folder / "workspace.json").write_text("{}")
        (folder / "summary.csv").write_text("trajectory\nline\n")
        target = folder / "none.png"
        for script, words, command in (("cooperative", ("track", table, table, target), "cooperative track --csv"),
                                       ("cooperative", ("reach", table, target), "cooperative reach --csv"),
                                       ("cooperative", ("payload", table, target, "a"), "cooperative payload --csv"),
                                       ("mechanics", ("map", table, target), "stability --map"),
                                       ("mechanics", ("workspace", folder, folder), "workspace --csv"),
                                       ("mechanics", ("show", facts, target), "show --json"),
                                       ("montecarlo", (table, target), "montecarlo --csv"),
                                       ("figures", (folder, folder), "experiment --csv")):
            answer = subprocess.run([sys.executable, system.SOURCE / "experiments" / f"{script}.py", *words],
                                    stderr=subprocess.PIPE, text=True, check=False)
            self.assertEqual(answer.returncode, 1, script)
            self.assertRegex(answer.stderr, rf"{re.escape(str(folder))}\S*: found n.*, expected the output of `tandem {command}`\n$")

    def test_each_method_has_its_own_colour_line_and_marker(self):
        import style
        self.assertEqual(set(style.METHODS), {*METHODS, "foreign"})
        for key in ("color", "linestyle", "marker"):
            self.assertEqual(len({str(of[key]) for of in style.METHODS.values()}), len(style.METHODS), key)


if __name__ == "__main__":
    system.main()
