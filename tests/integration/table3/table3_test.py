# SPDX-License-Identifier: Apache-2.0
"""Table 3 over DDS in lock-step, twice, and in one process: the same bytes.

The results are verified with the kinematics of the tests."""
import csv
import filecmp
import math
import pathlib
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402
import tubes  # noqa: E402

HEADER = ("trajectory,configuration,method,points,converged,iterations,rms_ab,std_ab,max_ab,rms_a,std_a,max_a,"
          "limit_violations,gate_actions,mean_ab,mean_a,gate,largest_excess")
METHODS = ["nspwln", "nspwln-joint", "nspqp", "snsqp"]
SHAPES = ["rectangle", "lissajous"]
CONFIGURATIONS = {  # Table 2, mm and degrees
    "1": ([-100, -80, -50, 45, 45, 45], [-80, -60, -30, 45, 45, 45]),
    "2": ([-150, -100, -50, 180, 90, 45], [-130, -120, -100, 90, -60, -270]),
    "3": ([-250, -200, -120, 0, 0, 0], [-250, -200, -120, 0, 0, 0]),
}
TOLERANCE = 0.88e-3
SAME = 1e-9


def si(joints):
    return [x * 1e-3 for x in joints[:3]] + [math.radians(x) for x in joints[3:]]


def tip(joints, arm):
    return tubes.position(tubes.transform(joints, arm))


def statistics(errors):
    mean = sum(errors) / len(errors)
    square = sum(e * e for e in errors) / len(errors)
    return math.sqrt(square), math.sqrt(max(0.0, square - mean * mean)), max(errors), mean


class Run:
    """One file of rows, with tips and errors recomputed."""

    def __init__(self, path, configuration):
        with open(path, newline="", encoding="utf-8") as file:
            self.rows = list(csv.DictReader(file))
        start_a, start_b = (si(q) for q in CONFIGURATIONS[configuration])
        self.relative = tubes.minus(tip(start_a, "a"), tip(start_b, "b"))  # constant from the start
        self.joints, self.errors = [], []
        for row in self.rows:
            q = [[float(row[f"{kind}_{arm}{i}"]) for kind in ("beta", "alpha") for i in (1, 2, 3)] for arm in "ab"]
            a, b = tip(q[0], "a"), tip(q[1], "b")
            target = [float(row[f"target_{axis}"]) for axis in "xyz"]
            self.joints.append(q)
            self.errors.append((tubes.norm(tubes.minus(self.relative, tubes.minus(a, b))),
                                tubes.norm(tubes.minus(target, a))))
        points = [int(row["point"]) for row in self.rows]
        self.last = [i for i in range(len(points)) if i + 1 == len(points) or points[i + 1] != points[i]]
        self.points = points


class Table3(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        cls.addClassCleanup(cls.folder.cleanup)
        folder = pathlib.Path(cls.folder.name)
        deployment = system.deployment(folder, "lockstep")
        cls.answers, cls.seconds = {}, {}
        for name, options in (("first", []), ("second", []), ("offline", ["--offline"])):
            start = time.monotonic()
            cls.answers[name] = system.run("experiment", "table3", "--deployment", deployment, "--csv", folder / name,
                                           *options, timeout=150)
            cls.seconds[name] = time.monotonic() - start
        cls.path = folder / "first"
        with open(cls.path / "summary.csv", newline="", encoding="utf-8") as file:
            cls.header = file.readline().rstrip("\n")
            cls.summary = list(csv.DictReader(file, cls.header.split(",")))
        cls.runs = {(s["trajectory"], s["configuration"], s["method"]):
                    Run(cls.path / f"{s['trajectory']}-{s['configuration']}-{s['method']}.csv", s["configuration"])
                    for s in cls.summary}

    def average(self, shape, method, column):
        values = [float(s[column]) for s in self.summary if (s["trajectory"], s["method"]) == (shape, method)]
        self.assertEqual(len(values), 3)
        return sum(values) / 3

    def test_all_runs_succeed_and_leave_no_process(self):
        for name, answer in self.answers.items():
            self.assertEqual(answer.returncode, 0, (name, answer.stdout, answer.stderr))
        self.assertEqual(system.processes_of(self.folder.name), [])

    def test_each_run_takes_less_than_a_minute(self):
        for name, seconds in self.seconds.items():
            self.assertLess(seconds, 60.0, name)

    def test_the_same_bytes(self):
        names = sorted(path.name for path in self.path.iterdir())
        self.assertEqual(len(names), 25)
        for other in ("second", "offline"):
            folder = self.path.parent / other
            self.assertEqual(sorted(path.name for path in folder.iterdir()), names)
            same, different, failed = filecmp.cmpfiles(self.path, folder, names, shallow=False)
            self.assertEqual((different, failed), ([], []), other)
            self.assertEqual(len(same), 25)

    def test_summary_has_all_runs(self):
        self.assertEqual(self.header, HEADER)
        wanted = {(s, c, m) for s in SHAPES for c in CONFIGURATIONS for m in METHODS}
        self.assertEqual(set(self.runs), wanted)
        self.assertEqual(len(self.summary), len(wanted))

    def test_joints_keep_equation_1(self):
        for key, run in self.runs.items():
            for q in run.joints:
                for arm in q:
                    self.assertLessEqual(tubes.excess(arm), SAME, key)

    def test_errors(self):
        for key, run in self.runs.items():
            for row, (relative, absolute) in zip(run.rows, run.errors):
                self.assertAlmostEqual(float(row["err_ab"]), relative, delta=SAME, msg=str(key))
                self.assertAlmostEqual(float(row["err_a"]), absolute, delta=SAME, msg=str(key))

    def test_all_points_converge(self):
        for key, run in self.runs.items():
            self.assertEqual([run.points[i] for i in run.last], list(range(1, 101)), key)
            for i in run.last:
                self.assertLessEqual(max(run.errors[i]), TOLERANCE + SAME, (key, run.points[i]))

    def test_targets_are_the_trajectories(self):
        # Rectangles close; the Lissajous figure is symmetric about its start. Both stay in their planes and sizes.
        for (shape, configuration, method), run in self.runs.items():
            start = tip(si(CONFIGURATIONS[configuration][0]), "a")
            targets = [[float(run.rows[i][f"target_{axis}"]) for axis in "xyz"] for i in run.last]
            offsets = [tubes.minus(target, start) for target in targets]
            self.assertLess(tubes.norm(offsets[-1]), 1e-8, "it ends where it began")
            spans = [max(o[k] for o in offsets) - min(o[k] for o in offsets) for k in range(3)]
            size = [0, 20e-3, 20e-3] if shape == "lissajous" else ([20e-3, 0, 20e-3] if configuration == "1" else
                                                                   [20e-3, 20e-3, 0])
            for span, wanted in zip(spans, size):
                self.assertAlmostEqual(span, wanted, delta=0.1e-3, msg=f"{shape} {configuration} {method}")

    def test_summary_agrees_with_the_rows(self):
        for line in self.summary:
            run = self.runs[line["trajectory"], line["configuration"], line["method"]]
            self.assertEqual(int(line["iterations"]), len(run.rows))
            self.assertEqual(int(line["points"]), 100)
            self.assertEqual(int(line["converged"]), 100)
            self.assertEqual(int(line["limit_violations"]), 0)
            self.assertEqual(int(line["gate_actions"]), sum(int(row["gate_actions"]) for row in run.rows))
            for column, which in (("ab", 0), ("a", 1)):
                for name, value in zip(("rms", "std", "max", "mean"), statistics([run.errors[i][which] for i in run.last])):
                    # A standard deviation is the root of a difference of squares, which amplifies rounding errors.
                    self.assertAlmostEqual(float(line[f"{name}_{column}"]), 1e3 * value, delta=1e-5, msg=str(line))

    def test_qp_methods_need_no_gate(self):
        for line in self.summary:
            if line["method"] in ("nspqp", "snsqp"):
                self.assertEqual(int(line["gate_actions"]), 0, line)

    def test_errors_of_the_paper(self):
        for shape in SHAPES:
            for method in METHODS:
                self.assertLessEqual(self.average(shape, method, "max_a"), 0.88, (shape, method))
                bound = 0.35 if method == "nspwln" else 0.13
                self.assertLessEqual(self.average(shape, method, "max_ab"), bound, (shape, method))

    def test_iterations_of_the_paper(self):
        for shape in SHAPES:
            iterations = {method: self.average(shape, method, "iterations") for method in METHODS}
            ratio = iterations["nspwln"] / iterations["nspqp"]
            self.assertGreaterEqual(ratio, 1.7, shape)
            self.assertLessEqual(ratio, 2.3, shape)
            self.assertLess(abs(iterations["nspwln-joint"] / iterations["nspqp"] - 1.0), 0.10, shape)


class OtherPlants(unittest.TestCase):
    """Plant and controller differ: over DDS and in one process the same bytes; errors are those of the true tips."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)

    def both_ways(self, name, run, only=None, experiment="table3", **changes):
        """Runs those whose names contain `only`; returns the larger error of one of them at the end of each of its points."""
        preset = changes.pop("preset", "lockstep")
        (self.folder / name).mkdir()
        deployment = system.deployment(self.folder / name, preset, **changes)
        for way, options in (("dds", []), ("offline", ["--offline"])):
            answer = system.run("experiment", experiment, "--deployment", deployment, "--only", only or run, "--csv",
                                self.folder / name / way, *options, timeout=100)
            self.assertIn(answer.returncode, (0, 1), answer.stderr)  # 1: a point did not converge
        folders = [self.folder / name / way for way in ("dds", "offline")]
        names = sorted(path.name for path in folders[0].iterdir())
        self.assertIn(f"{run}.csv", names)
        self.assertEqual(filecmp.cmpfiles(*folders, names, shallow=False), (names, [], []))
        with open(folders[0] / f"{run}.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        last = [row for row, after in zip(rows, rows[1:] + [None]) if after is None or after["point"] != row["point"]]
        self.assertEqual(len(last), int(rows[-1]["point"]))
        return [max(float(row["err_ab"]), float(row["err_a"])) for row in last]

    def test_a_rigid_controller_is_off_where_tubes_twist_and_the_sensor_mends_it(self):
        off = self.both_ways("plant", "rectangle-3-nspqp", preset="lockstep-compliant-plant")
        self.assertGreater(max(off), 2.5e-3)
        mended = self.both_ways("sensor", "rectangle-3-nspqp", preset="lockstep-compliant-sensor")
        self.assertEqual(len(mended), 100)
        self.assertLessEqual(max(mended), TOLERANCE)

    def test_everything_random_repeats(self):
        plant = ("{model: compliant, seed: 4, motors: {delay_ms: 30, lag_translation_ms: 50, lag_rotation_ms: 20,"
                 " backlash_translation_mm: 0.02, backlash_rotation_deg: 0.1}, encoders: {resolution_translation_mm:"
                 " 0.001, noise_translation_mm: 0.002, noise_rotation_deg: 0.01}, tube_deviation: {curvature: 0.03},"
                 " tracker: {rate_Hz: 30, position_noise_mm: 0.05, delay_ms: 20, drop_out: 0.2}}")
        errors = self.both_ways("random", "rectangle-2-nspqp", "-2-nspqp", plant=plant, feedback="sensor")
        self.assertLess(max(errors), TOLERANCE + 6 * 0.05e-3, "points are left by what is measured")

    def test_the_plants_own_model_needs_no_sensor(self):
        errors = self.both_ways("model", "rectangle-2-nspqp", experiment="overlap", preset="lockstep-compliant-plant",
                                model="compliant")
        self.assertLessEqual(max(errors), TOLERANCE)


if __name__ == "__main__":
    system.main()
