# SPDX-License-Identifier: Apache-2.0
"""The Python module against the command line, against itself, and against wrong input.

The first argument is the folder of the executables of a build tree; the module lies in PARENT/python."""
import ast
import csv
import io
import json
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import unittest

BIN = pathlib.Path(sys.argv.pop(1)).resolve()
SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(BIN.parent / "python"))

import numpy as np  # noqa: E402

import tandem  # noqa: E402

SEED = int(os.environ.get("TANDEM_TEST_SEED", random.randrange(2**32)))


def command_line(*words, rows):
    text = "\n".join(",".join(repr(float(x)) for x in row) for row in rows) + "\n"
    answer = subprocess.run([BIN / "tandem", *words], input=text, capture_output=True, text=True, check=True)
    return list(csv.DictReader(io.StringIO(answer.stdout)))


class ModuleTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        print(f"TANDEM_TEST_SEED={SEED}", flush=True)
        cls.robot = tandem.Robot.load("ark2024")


class Arms(ModuleTest):
    def test_same_digits_as_the_command_line(self):
        for model in ("rigid", "compliant"):
            arm = self.robot.arm("a", model=model)
            q = arm.sample(50, seed=SEED)
            rows = command_line("fk", "-r", "ark2024", "-a", "a", "--model", model, "--jacobian", rows=q)
            poses, jacobians = arm.forward(q), arm.jacobian(q)
            self.assertEqual((poses.shape, jacobians.shape), ((50, 4, 4), (50, 6, 6)))
            for row, pose, jacobian in zip(rows, poses, jacobians):
                self.assertEqual([float(row[k]) for k in "xyz"], list(pose[:3, 3]))
                self.assertEqual([float(row[f"j{i}{j}"]) for i in range(1, 7) for j in range(1, 7)], list(jacobian.flat))

    def test_one_row_many_rows_many_threads(self):
        arm = self.robot.arm("arm_b", model="compliant")
        q = arm.sample(500, seed=SEED)
        for ask in (arm.forward, arm.jacobian, arm.compliance, arm.stability, arm.shape, arm.frames):
            many = ask(q)
            np.testing.assert_array_equal(many, ask(q, threads=1))
            np.testing.assert_array_equal(many[7], ask(q[7]))
            np.testing.assert_array_equal(many, ask(np.asfortranarray(q)))
        self.assertIsInstance(arm.stability(q[0]), float)
        np.testing.assert_array_equal(arm.frames(q, 20)[:, :, :3, 3], arm.shape(q, 20))

    def test_rows_without_an_answer(self):
        arm = self.robot.arm("a")
        q = arm.sample(100, seed=SEED)
        q[40, 0] = 0.01  # in front of the entry point
        q[60, 3] = np.nan
        with self.assertRaisesRegex(tandem.ModelError, "row 40: .*beta > 0"):
            arm.forward(q)
        poses = arm.forward(q, errors="nan")
        self.assertEqual(set(np.flatnonzero(np.isnan(poses).any(axis=(1, 2)))), {40, 60})

    def test_limits(self):
        arm = self.robot.arm("a")
        q = arm.sample(1000, seed=SEED)
        self.assertTrue(arm.within_limits(q).all())
        self.assertIs(arm.within_limits(arm.home), True)
        a, b = arm.coupled_limits
        self.assertTrue((q @ a.T <= b).all() and (q >= arm.lower).all() and (q <= arm.upper).all())
        outside = q[0].copy()
        outside[0] = arm.upper[0] + 1e-3
        self.assertIs(arm.within_limits(outside), False)
        self.assertIs(arm.within_limits(outside, tolerance=1.0), True)
        self.assertIs(arm.within_limits(np.full(6, np.nan)), False)

    def test_jacobian_is_the_derivative(self):
        arm = self.robot.arm("a", model="compliant")
        rng = np.random.default_rng(SEED)
        q, step = arm.sample(20, seed=SEED), 1e-6
        for row in q[arm.stability(q) > 0.3]:
            direction = rng.normal(size=6) * ([0.01] * 3 + [1.0] * 3)
            ends = arm.forward(np.array([row + step * direction, row - step * direction]), errors="nan")
            difference = (ends[0, :3, 3] - ends[1, :3, 3]) / (2 * step)
            if np.isfinite(difference).all():
                np.testing.assert_allclose(arm.jacobian(row)[:3] @ direction, difference, atol=2e-5)

    def test_input_that_is_wrong(self):
        arm = self.robot.arm("a")
        for call, error, words in (
                (lambda: arm.forward(np.zeros(5)), ValueError, r"q: found shape \(5,\), expected \(6,\) or \(N, 6\)"),
                (lambda: arm.forward(np.zeros((2, 3, 6))), ValueError, "found shape"),
                (lambda: arm.forward(arm.home, errors="ignore"), ValueError, "expected 'raise' or 'nan'"),
                (lambda: arm.forward(arm.home, threads=-1), ValueError, "threads"),
                (lambda: arm.forward(arm.home, wrench=np.ones(6)), tandem.ModelError, "does not deform|carries no load"),
                (lambda: arm.shape(arm.home, 1), ValueError, "expected 2 or more"),
                (lambda: arm.forward("six"), (TypeError, ValueError), ""),
                (lambda: self.robot.arm("c"), KeyError, "expected one of arm_a, arm_b"),
                (lambda: self.robot.arm("a", model="soft"), ValueError, "'rigid' or 'compliant'"),
                (lambda: tandem.Robot.load("nobody"), tandem.ConfigError, "ark2024"),
        ):
            with self.subTest(words=words), self.assertRaisesRegex(error, words):
                call()

    def test_the_list_of_methods_is_that_of_the_stub_and_of_the_messages(self):
        stub = (SOURCE / "python/tandem/__init__.pyi").read_text()
        listed = re.search(r"^Method = Literal\[(.*)\]$", stub, re.MULTILINE).group(1)
        self.assertEqual(list(tandem.METHODS), [word.strip(' "') for word in listed.split(",")])
        for method in tandem.METHODS:
            self.assertEqual(tandem.Controller(self.robot, method).method, method)
            self.assertIn(method, tandem.Controller.__init__.__doc__)


class Loops(ModuleTest):
    def test_a_loop_in_python_is_the_loop_of_the_library(self):
        trajectory = tandem.Trajectory.parse(LINE)
        for method in ("nspwln-joint", "nspqp", "snsqp"):
            run = tandem.run(self.robot, trajectory, method)
            self.assertEqual(run["converged"], run["points"], method)
            self.assertLess(run["tip_error"][-1], trajectory.tolerance)
            simulator, controller = tandem.Simulator(self.robot), tandem.Controller(self.robot, method)
            tips = simulator.tips
            wanted, relative = trajectory.points(tips["arm_a"][:3, 3], tips["arm_a"][:3, 3] - tips["arm_b"][:3, 3])
            iterations, spacing = 0, 1.0 / 10.0
            for k, (x, x_ab) in enumerate(zip(wanted, relative)):
                feed = (x - (wanted[k - 1] if k else tips["arm_a"][:3, 3])) * spacing
                while True:
                    step = controller.step(simulator.joints, [tandem.relative("a", "b", x_ab), tandem.tip("a", x, feed)])
                    self.assertEqual(step.status, "solved")
                    simulator.step(step.velocity)
                    iterations, feed = iterations + 1, np.zeros(3)
                    now = simulator.tips
                    a, b = now["arm_a"][:3, 3], now["arm_b"][:3, 3]
                    if max(np.linalg.norm(a - x), np.linalg.norm(a - b - x_ab)) <= trajectory.tolerance:
                        break
                    self.assertLess(iterations, 500)
            self.assertEqual(iterations, run["iterations"], method)
            np.testing.assert_allclose(simulator.joints, run["joints"][-1], atol=1e-9)

    def test_soft_tasks_lead_away_from_limits_and_from_instability(self):
        limits = self.robot.arm("a").coupled_limits
        elastic = self.robot.arm("a", model="compliant")
        near_limit, near_snap = np.array(self.robot.home), np.array(self.robot.home)
        near_limit[:3] = -0.101, -0.1, -0.06
        near_snap[:6] = -0.39106, -0.280623, -0.187635, 0.453353, -2.739849, 0.507801
        cases = ((tandem.joint_limits("a", 5e-3), "rigid", near_limit, lambda q: np.min(limits[1] - limits[0] @ q), 1e-3, 4e-3),
                 (tandem.elastic_stability("a", 0.6), "compliant", near_snap, elastic.stability, 0.27, 0.5))
        for soft, model, start, margin, before, after in cases:
            for method in ("nspqp", "snsqp", "hqp"):
                with self.subTest(soft=soft, method=method):
                    simulator = tandem.Simulator(self.robot, start=start, model=model)
                    controller = tandem.Controller(self.robot, method, model=model)
                    tip = simulator.tips["arm_a"][:3, 3]
                    self.assertAlmostEqual(margin(simulator.joints[:6]), before, delta=1e-3)
                    for _ in range(100):
                        step = controller.step(simulator.joints, [tandem.tip("a", tip), soft])
                        self.assertEqual(step.status, "solved")
                        simulator.step(step.velocity)
                    self.assertGreater(margin(simulator.joints[:6]), after)
                    self.assertLess(np.linalg.norm(simulator.tips["arm_a"][:3, 3] - tip), 1e-6)
                    self.assertGreaterEqual(step.errors[1], 0.0)
        self.assertEqual(repr(tandem.joint_limits("arm_a", 0.01)), "<tandem.Target joint limits of arm_a>")
        self.assertEqual(repr(tandem.relative("a", "b", [0, 0, 0])), "<tandem.Target relative position of a and b>")

    def test_parameters_and_targets_that_are_wrong(self):
        home = self.robot.home
        controller = tandem.Controller(self.robot)
        for call, error, words in (
                (lambda: tandem.Controller(self.robot, "best"), ValueError, "expected one of 'nsp'"),
                (lambda: tandem.Controller(self.robot, zeta=1), TypeError, "argument 'zeta'"),
                (lambda: tandem.Controller(self.robot, nspqp_zeta=-1), ValueError, "above 0"),
                (lambda: tandem.Controller(self.robot, period=np.nan), ValueError, "period"),
                (lambda: tandem.Controller(self.robot, bounds="soft"), ValueError, "'coupled' or 'frozen'"),
                (lambda: controller.step(home, []), ValueError, "targets"),
                (lambda: controller.step(home[:6], [tandem.tip("a", [0, 0, 0])]), ValueError, "q: found shape"),
                (lambda: controller.step(home, [tandem.tip("c", [0, 0, 0])]), KeyError, "arm_a, arm_b"),
                (lambda: controller.step(home, [tandem.tip("a", [0, np.inf, 0])]), ValueError, "not finite"),
                (lambda: tandem.joint_limits("a", 0), ValueError, "distance: found 0.000000, expected a finite number above 0"),
                (lambda: tandem.joint_limits("a", np.inf), ValueError, "distance: found inf"),
                (lambda: tandem.elastic_stability("a", 1.5), ValueError, "above: found 1.500000, .* at most 1"),
                (lambda: controller.step(home, [tandem.joint_limits("c", 0.01)]), KeyError, "arm_a, arm_b"),
                (lambda: controller.step(home, [tandem.elastic_stability("a", 0.3)]), ValueError, "expected .*model='compliant'"),
                (lambda: tandem.Simulator(self.robot).step(np.full(12, np.nan)), ValueError, "not finite"),
                (lambda: tandem.Simulator(self.robot, start=np.full(12, 0.01)), ValueError, "limit|outside"),
                (lambda: tandem.Trajectory.parse("tandem: trajectory/1\nname: x\nline: 3\n"), tandem.ConfigError, "text:"),
        ):
            with self.subTest(words=words), self.assertRaisesRegex(error, words):
                call()

    def test_simulated_robot_has_the_errors_of_its_plant(self):
        forth_and_back = [*[0.02] * 40, *[-0.02] * 40]

        def tip_after(plant):
            simulator = tandem.Simulator(self.robot, model="compliant", plant=plant)
            velocity = np.zeros(self.robot.joint_count)
            for speed in forth_and_back:
                velocity[3] = 10 * speed
                simulator.step(velocity)
            return simulator

        ideal = tip_after({}).tips["arm_a"][:3, 3]
        self.assertGreater(np.linalg.norm(tip_after({"tube_friction": 0.05}).tips["arm_a"][:3, 3] - ideal), 1e-4)
        tracked = tip_after({"tracker": {"rate_Hz": 10, "bias_mm": [0, 0, 3]}})
        np.testing.assert_allclose(tracked.tips["arm_a"][:3, 3], ideal, atol=1e-12)
        np.testing.assert_allclose((tracked.measured_tips["arm_a"] - tracked.tips["arm_a"]).T, [*3 * [4 * [0]], [0, 0, 3e-3, 0]], 0, 1e-9)
        self.assertEqual(tandem.Simulator(self.robot).measured_tips, {})

    def test_run_follows_the_tracker_with_feedback_sensor(self):
        circle, plant = tandem.Trajectory.load("circle"), {"tube_deviation": {"curvature": 0.2}, "tracker": {"rate_Hz": 10}}

        def worst(run):  # true error when the run leaves a point, m
            last = np.append(np.diff(run["point"]) != 0, True)
            return run["tip_error"][last].max()

        self.assertLess(worst(tandem.run(self.robot, circle, plant=plant, feedback="sensor")), circle.tolerance)
        self.assertGreater(worst(tandem.run(self.robot, circle, plant=plant)), circle.tolerance)

    def test_run_follows_the_tracker_with_orientation_feedback_sensor(self):
        kept = tandem.Trajectory.parse("tandem: trajectory/1\nname: kept\nshape: {line: {displacement_mm: [0, 10, 5]}}\npoints: 10\n"
                                       "tasks: [{axis: {arm: a, tolerance_deg: 0.2}}, {tip: a}]\n")
        plant = {"model": "compliant", "tracker": {"rate_Hz": 10}}
        start = [self.robot.arm("a").sample(1, seed=0)[0], self.robot.arm("b").sample(1, seed=9)[0]]

        def turned(**feedback):  # of the true axis, which the rigid model does not know, rad
            joints = tandem.run(self.robot, kept, start=start, plant=plant, feedback="sensor", **feedback)["joints"]
            first, last = (tandem.Simulator(self.robot, start=joints[row], model="compliant").tips["arm_a"][:3, 2] for row in (0, -1))
            return np.linalg.norm(np.cross(first, last))

        self.assertGreater(turned(), 0.1)
        self.assertLess(turned(orientation_feedback="sensor"), 0.02)

    def test_plants_and_trajectories_that_are_refused(self):
        for plant, text in (({"frictoin": 1}, "plant:1:.*frictoin: unknown key"),
                            ({"tracker": {"rate_Hz": -1}}, "tracker.rate_Hz: found -1"),
                            ({"tube_errors": [{"arm": "q", "tube": 1}]}, "expected an arm of the robot")):
            with self.subTest(plant=plant), self.assertRaisesRegex(tandem.ConfigError, text):
                tandem.Simulator(self.robot, plant=plant)
        with self.assertRaisesRegex(ValueError, "trajectory circle: found arm b, expected a"):
            tandem.run(tandem.Robot.load("timc2024"), tandem.Trajectory.load("circle"))
        for feedback, text in (("sensor", "without a tracker"), ("eyes", "expected 'model' or 'sensor'")):
            with self.subTest(feedback=feedback), self.assertRaisesRegex(ValueError, text):
                tandem.run(self.robot, tandem.Trajectory.load("circle"), feedback=feedback)
        with self.assertRaisesRegex(ValueError, "orientation_feedback: found 'sensor' without a tracker"):
            tandem.run(self.robot, tandem.Trajectory.load("circle"), orientation_feedback="sensor")
        with self.assertRaisesRegex(ValueError, "expected feedback: sensor"):
            tandem.run(self.robot, tandem.Trajectory.load("circle"), plant={"tracker": {"rate_Hz": 10}}, orientation_feedback="sensor")


class Plans(ModuleTest):
    def test_inverse_kinematics(self):
        planner, arm = tandem.Planner(self.robot), self.robot.arm("a")
        there = arm.forward(joints := arm.sample(1, seed=SEED)[0])
        for part, reference in ((np.s_[:3, 3], None), (np.s_[:], [*joints + [0, 0, 0, .01, .01, .01], *self.robot.home[6:]])):
            answer = planner.inverse_kinematics({"a": there[part]}, reference)
            self.assertEqual(answer["reach"], "reached", answer)
            np.testing.assert_allclose(arm.forward(answer["joints"][:6])[part], there[part], atol=1e-5)
        far = planner.inverse_kinematics({"a": [1.0, 0.0, 0.0]})
        self.assertTrue(far["reach"] in ("outside_workspace", "limits") and far["reason"], far)
        self.assertTrue(arm.within_limits(far["joints"][:6], tolerance=1e-9))

    def test_check(self):
        report = tandem.Planner(self.robot).check(tandem.Trajectory.parse(LINE))
        self.assertTrue(report["feasible"], report)
        self.assertTrue(self.robot.arm("a").within_limits(report["joints"][:, :6], tolerance=1e-9).all())

    def command(self, *words):
        """JSON that `tandem` prints for the same."""
        answer = subprocess.run([BIN / "tandem", *words, "--json"], capture_output=True, text=True, check=True)
        return json.loads(answer.stdout)

    def test_clearance(self):
        (pair, (distance, place, other)), = tandem.Planner(self.robot).clearance().items()
        shown, = self.command("show", "ark2024")["clearance"]
        self.assertEqual(pair, (shown["arm"], shown["other"]))
        np.testing.assert_allclose(distance, shown["distance_m"], atol=1e-12)
        np.testing.assert_allclose([place, other], [shown["place_m"], shown["other_place_m"]], atol=1e-12)

    def test_time(self):
        trajectory = tandem.Trajectory.load("line")
        answer = tandem.Planner(self.robot).time(trajectory)
        self.assertEqual(answer["status"], "optimal")
        self.assertEqual(answer["joints"].shape, (trajectory.point_count + 1, 12))
        np.testing.assert_allclose(answer["joints"][0], self.robot.home)
        self.assertEqual(len(answer["limiting"]), trajectory.point_count)
        joints = {f"arm_{arm}.{joint}_{tube}" for arm in "ab" for joint in ("beta", "alpha") for tube in (1, 2, 3)}
        self.assertLessEqual(set(answer["limiting"]), joints | {""})
        apart = tandem.Planner(self.robot, clearance=0.0).time(trajectory)
        printed = self.command("plan", "time", "line", "--robot", "ark2024")
        self.assertAlmostEqual(apart["time"][-1], printed["seconds"], delta=1e-9)
        slower = tandem.Planner(self.robot).time(trajectory, rotation_velocity=0.01)
        self.assertGreater(slower["time"][-1], answer["time"][-1])

    def test_repair_makes_a_trajectory_feasible(self):
        far = tandem.Trajectory.parse(LINE.replace("[0, 0, 8]", "[0, 60, 0]"))
        planner = tandem.Planner(self.robot)
        self.assertFalse(planner.check(far)["feasible"])
        with self.assertRaisesRegex(ValueError, "not feasible from this start"):
            planner.time(far)
        answer = planner.repair(far)
        self.assertFalse(answer["before"]["feasible"])
        self.assertTrue(answer["after"]["feasible"])
        self.assertTrue(planner.check(answer["trajectory"])["feasible"])
        self.assertGreater(answer["largest_change"], answer["rms_change"])

    def test_starts_have_the_same_tips(self):
        candidates = tandem.Planner(self.robot).starts(tandem.Trajectory.parse(LINE), tries=4)
        self.assertGreaterEqual(len(candidates), 2)
        keys = [(each["unreachable"], -round(each["room"], 6)) for each in candidates]
        self.assertEqual(keys, sorted(keys))
        for part, name in ((slice(0, 6), "a"), (slice(6, 12), "b")):
            arm = self.robot.arm(name)
            tips = [arm.forward(each["joints"][part])[:3, 3] for each in candidates]
            np.testing.assert_allclose(tips, [arm.forward(arm.home)[:3, 3]] * len(tips), atol=1e-5)


class Documentation(unittest.TestCase):
    def test_what_the_page_says_runs(self):
        blocks = re.findall(r"```python\n(.*?)```", (SOURCE / "docs/python.md").read_text(), re.DOTALL)
        names = {}
        for block in blocks:
            if "run.mcap" not in block and "tandem.Client" not in block:  # client_test.py has a running system
                exec(block, names)  # pylint: disable=exec-used
        self.assertEqual(names["step"].status, "solved")
        self.assertEqual(names["answer"]["reach"], "reached", names["answer"])

    def test_examples_draw_their_figures(self):
        page = (SOURCE / "docs/python.md").read_text()
        with tempfile.TemporaryDirectory() as folder:
            for example in sorted((SOURCE / "python/examples").glob("*.py")):
                self.assertIn(f"| `{example.name}` |", page)
                figure = pathlib.Path(folder, f"{example.stem}.png")
                subprocess.run([sys.executable, example, figure], check=True, timeout=120,
                               env={**os.environ, "PYTHONPATH": str(BIN.parent / "python"),
                                    "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}"})
                self.assertGreater(figure.stat().st_size, 10000, example)


class Wire(unittest.TestCase):
    def test_constants_are_those_of_the_libraries(self):
        self.assertEqual([method.label for method in tandem.wire.Method], [*tandem.METHODS, "foreign"])
        self.assertEqual(tandem.wire.Fault.DRIVE | tandem.wire.Fault.SENSOR, tandem.wire.Fault(768))


class Stub(unittest.TestCase):
    def test_stub_names_what_the_module_has(self):
        tree = ast.parse((SOURCE / "python/tandem/__init__.pyi").read_text())
        stub = {node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        public = {name for name in dir(tandem) if not name.startswith("_")} | {"__version__"}
        values = {node.target.id for node in tree.body if isinstance(node, ast.AnnAssign)} | {"wire"}
        self.assertEqual(set(stub) | values, public)
        for name, node in stub.items():
            thing = getattr(tandem, name)
            self.assertTrue(thing.__doc__, name)
            if isinstance(node, ast.ClassDef) and not issubclass(thing, Exception):
                own = {n for n in vars(thing) if not n.startswith("_") or n == "__getitem__"}
                methods = {m.name for m in node.body if isinstance(m, ast.FunctionDef)}
                self.assertEqual(methods - {"__init__", "__enter__", "__exit__"}, own, name)

    def test_the_installed_stub_has_the_texts_of_the_module(self):
        def outline(tree, texts):
            """(name, signature or text) of all classes and functions."""
            return [(node.name, ast.get_docstring(node) if texts else ast.unparse(node.args))
                    for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) or (texts and isinstance(node, ast.ClassDef))]
        source = ast.parse((SOURCE / "python/tandem/__init__.pyi").read_text())
        installed = ast.parse((pathlib.Path(tandem.__file__).parent / "__init__.pyi").read_text())
        self.assertEqual(outline(installed, False), outline(source, False))
        self.assertIn(("clearance", tandem.Planner.clearance.__doc__.split("\n", 1)[1].strip()), outline(installed, True))
        without = [name for name, text in outline(installed, True) if not text and not name.startswith("__")]
        self.assertEqual(without, [])


LINE = """\
tandem: trajectory/1
name: line
arm: a
other_arm: b
shape:
  line: {displacement_mm: [0, 0, 8]}
points: 10
relative: hold
following: point_by_point
point_duration_s: 10
tolerance_mm: 0.88
max_iterations: 100
"""

if __name__ == "__main__":
    unittest.main(verbosity=2)
