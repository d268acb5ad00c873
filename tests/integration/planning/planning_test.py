# SPDX-License-Identifier: Apache-2.0
"""Computations by planning for clients while it runs a robot: the same results as in process, without effect on control."""
import json
import pathlib
import signal
import subprocess
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402
import tubes  # noqa: E402


class Live:
    """A `tandem plan` of a running system in the background; its progress is read as it arrives."""

    def __init__(self, test, path, *words):
        self.process = subprocess.Popen([system.executable(), "plan", *map(str, words), "--deployment", str(path)],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                        start_new_session=True)
        self.lines, self._said = [], threading.Event()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        test.addCleanup(self.end)

    def _read(self):
        for line in self.process.stderr:
            self.lines.append(line.strip())
            self._said.set()

    def await_progress(self, seconds=60):
        if not self._said.wait(seconds):
            raise AssertionError("no progress")

    def interrupt(self, seconds=20):
        """Ctrl-C. @return seconds until the process has ended"""
        begin = time.monotonic()
        self.process.send_signal(signal.SIGINT)
        self.process.wait(seconds)
        return time.monotonic() - begin

    def end(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        self._reader.join(10)
        self.process.stdout.close()
        self.process.stderr.close()


class Computations(system.SystemTest):
    # A computation of seconds on the thread that publishes references, or at its priority with one of its locks, would exceed the budgets.
    def setUp(self):
        super().setUp()
        self.system = self.start("laptop", **system.real_time())
        self.path = self.system.path

    def plan(self, *words, code=0):
        answer = system.run("plan", *words, "--deployment", self.path, timeout=120)
        self.assertEqual(answer.returncode, code, answer.stdout + answer.stderr)
        return answer

    def endless(self):
        return Live(self, self.path, "start", "circle", "--tries", 10000)

    def test_the_running_system_answers_what_is_computed_in_process(self):
        # Measured joints as decimals that convert back to the same doubles.
        here = ",".join(repr(x) for arm in self.system.joints() for x in arm)
        far = self.trajectory("far", [0, 0, 200], points=8)
        for words, code in ((("check", "circle"), 0), (("check", far), 1), (("ik", "--tip", "a=0.02,0.01,0.3"), 0),
                            (("ik", "--tip", "a=0.02,0.01,0.7"), 1), (("time", "circle"), 0),
                            (("start", "circle", "--tries", 2), 0)):
            live = self.plan(*words, "--json", code=code)
            local = system.run("plan", *words, "--json", "--joints", here, timeout=120)
            self.assertEqual(json.loads(live.stdout), json.loads(local.stdout), words)
        near = self.folder / "near.yaml"
        report = json.loads(self.plan("repair", far, "-o", near, "--json").stdout)
        self.assertTrue(report["after"]["feasible"])
        self.assertIn("feasible: all 8 points", self.plan("check", near).stdout)

    def test_a_trajectory_runs_while_planning_computes(self):
        computation = self.endless()
        computation.await_progress()
        run = self.start_run(self.system, self.trajectory("line", [0, 12, 0], following="timed", speed_mm_per_s=2,
                                                          acceleration_mm_per_s2=5))
        self.system.await_motion(run, 30)
        seen = len(computation.lines)
        before = self.system.status()["control"]
        while run.poll() is None:
            status = self.system.status()
            self.assertEqual(status["hold"], "")
            for arm in status["arms"]:
                self.assertNotEqual(arm["operating_state"], "FAULT", arm)
        out, err = run.communicate()
        self.assertEqual(run.returncode, 0, out + err)
        self.assertIn("finished", out)
        after = self.system.status()["control"]
        cycles = after["cycles"] - before["cycles"]
        self.assertGreater(cycles, 20)
        self.assertLess(after["overruns"] - before["overruns"], max(2, 0.1 * cycles), after)
        self.assertIsNone(computation.process.poll(), "it has to last longer than the trajectory")
        self.assertGreater(len(computation.lines) + 1, seen)
        self.assertLess(computation.interrupt(), 10)
        self.assertEqual(computation.process.returncode, 1)
        computation.end()
        self.assertIn("cancelled by its client", computation.lines[-1])
        self.plan("check", "circle")

    def test_one_computation_at_a_time_and_each_ends(self):
        first = self.endless()
        first.await_progress()
        self.assertIn("planning is busy with another computation", self.plan("check", "circle", code=1).stderr)
        # A killed client sends no cancellation.
        first.process.kill()
        self.assertIn("feasible", system.until(self.accepted, 30, "planning is free again").stdout)

    def accepted(self):
        answer = system.run("plan", "check", "circle", "--deployment", self.path, timeout=60)
        return answer if answer.returncode == 0 else None

    def test_a_run_that_is_not_feasible_is_refused_before_it_starts(self):
        before = self.system.joints()
        far = self.trajectory("far", [0, 0, 200], points=8)
        self.assert_refused(self.system.robot("run", far, "--check"), "nothing was started", "point 8:", "limited by")
        self.assertEqual(self.system.states(), ["DISABLED", "DISABLED"])
        self.assertEqual(self.system.joints(), before)
        near = self.trajectory("near", [0, 2, 0], points=2)
        planned = json.loads(self.assert_ok(self.system.robot("--json", "run", near, "--planned")).stdout)
        self.assertEqual(planned["phase"], "finished")
        reported = json.loads(self.assert_ok(self.system.robot("--json", "run", near, "--check")).stdout)
        self.assertEqual(reported["phase"], "finished")

    def test_a_check_before_a_run_rehearses_with_what_is_set(self):
        near = self.trajectory("near", [0, 2, 0], points=2)
        slow = ("translation_step=1e-8", "rotation_velocity=1e-5")
        for name, value in (setting.split("=") for setting in slow):
            self.assert_ok(self.system.robot("set", name, value))
        self.assert_refused(self.system.robot("run", near, "--check"), "nothing was started", "point 1")
        self.assertEqual(self.system.states(), ["DISABLED", "DISABLED"])
        self.plan("check", near)
        self.plan("check", near, "--set", slow[0], "--set", slow[1], code=1)
        self.assertIn("expected NAME=VALUE", self.plan("check", near, "--set", "tip_gain", code=2).stderr)
        refused = self.plan("check", near, "--set", "tip_gain=fast", code=2).stderr
        self.assertIn("parameters[0]: tip_gain: found 'fast', expected a finite number above zero", refused)
        for name, value in (("translation_step", "1e-3"), ("rotation_velocity", "2")):
            self.assert_ok(self.system.robot("set", name, value))
        self.assert_ok(self.system.robot("run", near, "--check"))


class Clearance(system.SystemTest):
    def test_control_publishes_how_near_the_bodies_are(self):
        running = self.start("laptop", **system.real_time(), port="{radius_mm: 15, depth_mm: 5}")

        # At home the bodies touch: move to other joints.
        asked = system.run("plan", "ik", "--tip", "a=0.02,0.01,0.3", "--clearance-mm", 2, "--json", timeout=120)
        joints = json.loads(self.assert_ok(asked).stdout)["joints"]
        self.assert_ok(running.robot("enable"))
        for arm, own in (("a", joints[:6]), ("b", joints[6:])):
            self.assert_ok(running.robot("move-jp", "--arm", arm, "--", *own))
        self.assert_ok(running.robot("disable"))
        there = time.monotonic_ns()

        def current():
            status = running.status()
            return status if len(status["clearance"]) == 3 and status["clearance_stamp_ns"] > there else None

        status = system.until(current, 20, "clearances")
        reported = {(body["arm"], body["other"]): body for body in status["clearance"]}
        # Inverse kinematics of the tip poses, with the present joints as reference, gives the present joints.
        here = ",".join(repr(x) for arm in status["arms"] for x in arm["joints"])
        tips = [tubes.position(tubes.transform(arm["joints"], name)) for arm, name in zip(status["arms"], "ab")]
        words = [f"--tip={name}={','.join(repr(float(x)) for x in tip)}" for name, tip in zip("ab", tips)]
        local = system.run("plan", "ik", *words, "--joints", here, "--json", timeout=120)
        self.assertEqual(local.returncode, 0, local.stderr)
        arms = reported["arm_a", "arm_b"]
        self.assertAlmostEqual(arms["distance_m"], json.loads(local.stdout)["clearance_m"], delta=1e-5)
        self.assertLess(0, max(map(abs, arms["by_joints"])))
        for arm, base in (("arm_a", 0.005), ("arm_b", -0.005)):
            port = reported[arm, "port"]
            place = port["place_m"]
            self.assertLess(place[2], 0.3)
            # The rim's radius less the distance from the axis, less the tube's radius of at most 2 mm.
            self.assertLess(port["distance_m"], 0.015 - abs(base) + 1e-3)
            self.assertGreater(port["distance_m"], 0.015 - abs(base) - 4e-3)
        text = system.run("status", "--deployment", running.path)
        self.assertRegex(text.stdout, r"arm_a to arm_b: [\d.-]+ mm\n  arm_a to port: [\d.]+ mm")


if __name__ == "__main__":
    system.main()
