# SPDX-License-Identifier: Apache-2.0
"""tandem.Client against real processes. The first argument is the folder of the executables; the module lies in
PARENT/python."""
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
MODULE = pathlib.Path(sys.argv[1]).resolve().parent / "python"
sys.path[:0] = [str(MODULE), str(SOURCE / "tests/integration/harness")]

import numpy as np  # noqa: E402

import system  # noqa: E402
import tandem  # noqa: E402


def line(displacement_mm, speed=4):
    """Followed by time; 20 mm take 5 s."""
    return tandem.Trajectory.parse(f"tandem: trajectory/1\nname: line\nshape:\n  line: {{displacement_mm: {displacement_mm}}}\n"
                                   f"following: timed\nspeed_mm_per_s: {speed}\nacceleration_mm_per_s2: 20\n")


class Running(unittest.TestCase):
    """One system, one client a test; the arms are DISABLED between tests."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.path = system.deployment(cls.folder, "laptop", **system.real_time())
        cls.system = system.System(cls.path)
        cls.addClassCleanup(cls.system.close)

    def setUp(self):
        self.client = tandem.Client(str(self.path))
        self.addCleanup(self.client.close)

    def tearDown(self):
        self.client.disable()

    def states(self):
        return {arm["operating_state"] for arm in self.client.status()["arms"].values()}

    def test_status_and_measurements(self):
        status = self.client.status()
        self.assertEqual((status["deployment"], status["robot"], status["lease"]), ("laptop", "ark2024", "free"))
        self.assertEqual(list(status["arms"]), self.client.robot.arms)
        self.assertEqual(self.states(), {"DISABLED"})
        for name in "a", "b":
            positions, velocities = self.client.measured_js(name)
            np.testing.assert_array_equal(positions, status["arms"][f"arm_{name}"]["joints"])
            np.testing.assert_array_equal(velocities, np.zeros(6))
            arm = self.client.robot.arm(name, model=status["model"])
            np.testing.assert_allclose(self.client.measured_cp(name), arm.forward(positions), atol=1e-9)

    def test_joints(self):
        goal, _ = self.client.measured_js("a")
        goal[:3] += 2e-3
        goal[3:] += 0.1
        with self.assertRaisesRegex(tandem.ClientError, "control refused: "):
            self.client.move_jp("a", goal)  # not ENABLED
        self.assertEqual(self.client.status()["lease"], "free")
        self.client.enable()
        self.assertEqual(self.states(), {"ENABLED"})
        self.client.move_jp("a", goal)
        np.testing.assert_allclose(self.client.measured_js("a")[0], goal, atol=2e-4)
        with self.assertRaisesRegex(tandem.ClientError, "control refused: "):
            self.client.move_jp("a", goal + [1, 0, 0, 0, 0, 0])
        self.client.home()
        np.testing.assert_allclose(self.client.measured_js("a")[0], self.client.robot.arm("a").home, atol=2e-4)
        self.client.method("snsqp")
        self.client.set("tip_gain", 2.5)
        self.client.pause()
        self.assertEqual(self.states(), {"PAUSED"})
        self.assertEqual(self.client.status()["method"], "snsqp")
        self.client.resume()
        self.client.disable()
        self.assertEqual(self.states(), {"DISABLED"})
        with self.assertRaisesRegex(tandem.ClientError, "control refused: "):
            self.client.set("tip_gain", -1)

    def test_run(self):
        """Tips arrive; what is reported comes in order; other threads and looks go on meanwhile."""
        before = self.client.measured_cp("a")[:3, 3]
        reported, busy, counts, ended = [], [], [0], threading.Event()

        def progress(point, points, errors):
            reported.append((point, points, len(errors)))
            self.client.status()
            if not busy:
                with self.assertRaisesRegex(tandem.ClientError, "another command"):
                    self.client.enable()
                busy.append(counts[0])

        def count():
            while not ended.wait(1e-3):
                counts[0] += 1

        counter = threading.Thread(target=count)
        counter.start()
        try:
            end = self.client.run(line([0, 0, 4]), method="nspqp", progress=progress)
        finally:
            ended.set()
            counter.join()
        self.assertGreater(counts[0], busy[0] + 100, "no other thread could run")
        points = [point for point, _, _ in reported]
        self.assertGreater(len(points), 3)
        self.assertEqual(points, sorted(points))
        self.assertEqual({(points, errors) for _, points, errors in reported}, {(end["points"], 2)})
        self.assertLess(max(end["errors"]), 1e-3)
        moved = self.client.measured_cp("a")[:3, 3] - before
        np.testing.assert_allclose(moved, [0, 0, 4e-3], atol=1e-3)
        self.assertEqual((self.states(), self.client.status()["lease"]), ({"DISABLED"}, "free"))
        self.client.run(line([0, 0, -4]), keep_enabled=True)
        self.assertEqual(self.states(), {"ENABLED"})

    def test_what_progress_raises_pauses(self):
        class Enough(Exception):
            pass

        def progress(point, *_):
            if point > 2:
                raise Enough(point)

        with self.assertRaises(Enough):
            self.client.run(line([0, 20, 0]), progress=progress)
        self.assertEqual(self.states(), {"PAUSED"})
        self.assertNotEqual(self.client.status()["trajectory"]["phase"], "running")

    def test_stop(self):
        def progress(point, *_):
            if point > 2:
                self.client.stop("enough")

        with self.assertRaisesRegex(tandem.ClientError, "is in FAULT: .*stop_requested"):
            self.client.run(line([0, 20, 0]), progress=progress)
        self.assertEqual(self.states(), {"FAULT"})
        with self.assertRaisesRegex(tandem.ClientError, "refused"):
            self.client.enable()
        self.client.disable()
        self.assertEqual(self.states(), {"DISABLED"})

    def test_interrupt(self):
        """Ctrl-C in another interpreter."""
        script = ("import sys, tandem\n"
                  "with tandem.Client(sys.argv[1]) as client:\n"
                  "    client.run(tandem.Trajectory.parse(sys.argv[2]), progress=lambda *x: print('moves', flush=True))\n")
        with subprocess.Popen([sys.executable, "-c", script, str(self.path), line([0, 20, 0]).to_yaml()], text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={"PYTHONPATH": str(MODULE)}) as process:
            self.assertEqual(process.stdout.readline(), "moves\n")
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=60)
        self.assertIn("KeyboardInterrupt", errors)
        self.assertNotEqual(process.returncode, 0)
        self.assertEqual(self.states(), {"PAUSED"})

    def test_two_clients(self):
        with tandem.Client(str(self.path)) as other:
            self.client.enable()
            self.assertEqual({arm["operating_state"] for arm in other.status()["arms"].values()}, {"ENABLED"})

            def progress(point, *_):
                if point == 2:
                    with self.assertRaisesRegex(tandem.ClientError, "refused: .*lease"):
                        other.move_jp("b", other.measured_js("b")[0])

            self.client.run(line([0, 0, 2]), progress=progress)

    def test_arguments(self):
        for call, error, words in ((lambda: self.client.measured_js("c"), KeyError, "expected one of arm_a, arm_b"),
                                   (lambda: self.client.move_jp("a", [0, 1]), ValueError, r"q: found shape \(2,\)"),
                                   (lambda: self.client.move_jp("a", np.zeros((1, 6))), ValueError, "expected one"),
                                   (lambda: self.client.run("nowhere"), tandem.ConfigError, "rectangle"),
                                   (lambda: self.client.run("line", method="best"), ValueError, "expected one of 'nsp'")):
            with self.subTest(words=words), self.assertRaisesRegex(error, words):
                call()

    def test_what_the_page_says_runs(self):
        page = (SOURCE / "docs/python.md").read_text()
        blocks = [b for b in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "tandem.Client" in b]
        self.assertTrue(blocks)
        for block in blocks:
            self.assertIn('"laptop"', block)
            exec(block.replace('"laptop"', repr(str(self.path))), {"tandem": tandem})  # pylint: disable=exec-used


class Alone(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        self.addCleanup(folder.cleanup)
        self.path = system.deployment(folder.name, "laptop", **system.real_time())

    def test_no_running_system(self):
        with self.assertRaisesRegex(tandem.ConfigError, "laptop"):
            tandem.Client("nowhere")
        client = tandem.Client(str(self.path))
        with self.assertRaisesRegex(tandem.ClientError, r"not running or not connected: sim \(or hal\), control, planning"):
            client.connect(timeout=0.3)
        with self.assertRaisesRegex(tandem.ClientError, "do not report standstill"):
            client.stop()
        client.close()
        client.close()
        with self.assertRaisesRegex(tandem.ClientError, "closed"):
            client.status()

    def test_silence(self):
        running = system.System(self.path)
        self.addCleanup(running.close)
        with tandem.Client(str(self.path)) as client:
            self.assertEqual(client.status()["lease"], "free")
            running.close()

            def silent():
                try:
                    client.status()
                except tandem.ClientError as error:
                    return "message from control" in str(error)
                return False

            system.until(silent, 10, "status() raises once control is silent")


class Catheters(unittest.TestCase):
    """Arms that hold an object: what of a client needs no kinematic model, and what does."""

    def test_arms_follow_a_path(self):
        with tempfile.TemporaryDirectory(prefix="tandem-test-") as folder:
            path = system.deployment(folder, "ablation-pair", **system.real_time(),
                                     robot=system.PRESETS / "cooperative" / "ablation-pair.yaml")
            lift = pathlib.Path(folder) / "lift.yaml"
            lift.write_text("{tandem: path/1, name: lift, shape: line, along: [z], size_mm: 1, duration_s: 2, hold: none}\n")
            running = system.System(path)
            self.addCleanup(running.close)
            with tandem.Client(str(path)) as client:
                self.assertEqual(client.robot.arms, ["arm_a", "arm_b"])
                self.assertEqual(client.measured_js("a")[0].shape, (3,))
                start = client.measured_cp("a")
                with self.assertRaisesRegex(ValueError, "found the catheters of .*expected concentric tubes"):
                    client.robot.arm("a")
                with self.assertRaisesRegex(tandem.ClientError, "planning refused: the path requires .*not possible: "):
                    client.run("tip-eight")
                points = []
                end = client.run(str(lift), progress=lambda point, *_: points.append(point))
                self.assertEqual(end["points"], 100)
                self.assertGreater(len(points), 3)
                np.testing.assert_allclose(client.measured_cp("a"), start, atol=2e-4)
                client.disable()
            running.close()


if __name__ == "__main__":
    system.main()
