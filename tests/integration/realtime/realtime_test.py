# SPDX-License-Identifier: Apache-2.0
"""A deployment in real time, driven by the command line: `tandem up`, `robot`, `status`."""
import json
import os
import pathlib
import signal
import sys
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402
import tubes  # noqa: E402

HOME = [[-0.15, -0.10, -0.05], [-0.13, -0.12, -0.10]]  # translations of the robot file's home, m
REACHED = 1e-6


class RealTime:
    """Tests for every rate."""

    preset, period, steps = "", 0.0, ()

    def setUp(self):
        super().setUp()
        self.system = self.start(self.preset, **system.real_time())

    def status(self):
        return self.system.status()

    def move(self, arm, joints):
        return self.system.robot("move-jp", "--arm", arm, "--", *joints)

    def assert_joints(self, arm, wanted):
        for got, want in zip(self.system.joints()[arm], wanted):
            self.assertAlmostEqual(got, want, delta=REACHED)

    def short_line(self, name="short", **keys):
        # Iterations per point: 10 s, whatever the rate.
        return self.trajectory(name, [0, 3, 0], points=4, max_iterations=round(10 / self.period), **keys)

    def tips(self):
        return [tubes.position(tubes.transform(q, arm)) for q, arm in zip(self.system.joints(), "ab")]

    def assert_moved(self, before, after, by):
        """Tip A has moved `by`, m, and the relative position is constant, both within the paper's tolerance."""
        self.assertLess(tubes.norm(tubes.minus(tubes.minus(after[0], before[0]), by)), 0.88e-3)
        relative = tubes.minus(tubes.minus(after[0], after[1]), tubes.minus(before[0], before[1]))
        self.assertLess(tubes.norm(relative), 0.88e-3)

    def test_a_session(self):
        # One session of a deployment, in order: every step starts from the state that the previous one leaves.
        for step in self.steps:
            print(f"  {step}", flush=True)
            getattr(self, step)()

    def begin(self):
        status = self.status()
        self.assertEqual([arm["name"] for arm in status["arms"]], ["arm_a", "arm_b"])
        for arm, home in zip(status["arms"], HOME):
            self.assertEqual(arm["operating_state"], "DISABLED")
            self.assertEqual(arm["faults"], "none")
            self.assertEqual(arm["joints"][:3], home)
        self.assertEqual(status["method"], "nspqp")
        self.assertEqual(status["trajectory"]["phase"], "idle")
        self.assertEqual(status["control"]["period_s"], self.period)
        self.assertEqual(status["lease_owner"], 0)
        self.assertIn("DISABLED", system.run("status", self.system.path).stdout)
        once = json.loads(system.run("status", self.system.path, "--json").stdout)
        self.assertEqual(once["arms"], status["arms"])
        self.system.assert_still(self)

    def run_short(self):
        before = self.tips()
        answer = self.assert_ok(self.system.robot("--json", "run", self.short_line()))
        reported = json.loads(answer.stdout)
        self.assertEqual((reported["phase"], reported["points"]), ("finished", 4))
        summary = reported["summary"]
        self.assertEqual([task["task"] for task in summary["tasks"]], ["relative position of arm_a and arm_b", "tip of arm_a"])
        self.assertEqual((summary["reached"], summary["iterations"]), (4, reported["iterations"]))
        for task in summary["tasks"]:
            self.assertLessEqual(task["rms_m"], task["maximum_m"])
            self.assertLessEqual(task["maximum_m"], 0.88e-3)  # a point is left within the tolerance
        self.assertGreater(summary["tasks"][1]["rms_m"], 1e-6)
        self.assertGreater(summary["duration_s"], (reported["iterations"] - 2) * self.period)
        status = self.status()
        self.assertEqual(status["last_run"], summary)
        self.assertEqual(status["trajectory"]["phase"], "finished")
        self.assertEqual(status["trajectory"]["iterations"], reported["iterations"])
        self.assertEqual([arm["operating_state"] for arm in status["arms"]], ["DISABLED", "DISABLED"])
        self.assertEqual(status["lease_owner"], 0)
        self.assert_moved(before, self.tips(), [0, 3e-3, 0])

    def run_timed(self):
        before = self.tips()
        line = self.short_line("timed", following="timed", speed_mm_per_s=2, acceleration_mm_per_s2=5)
        reported = json.loads(self.assert_ok(self.system.robot("--json", "run", line, "--keep-enabled")).stdout)
        self.assertEqual(reported["phase"], "finished")
        # 3 mm at 2 mm/s with ramps of 0.4 s take 1.9 s.
        self.assertGreaterEqual(reported["iterations"], 1.9 / self.period - 1)
        self.assertEqual(self.system.states(), ["ENABLED", "ENABLED"])
        self.assert_moved(before, self.tips(), [0, 3e-3, 0])
        self.assert_ok(self.system.robot("disable"))

    def run_that_misses(self):
        """The arms cannot follow at 50 mm/s: the run says so, and is no success."""
        fast = self.trajectory("fast", [0, 10, 0], points=4, max_iterations=2, following="timed", speed_mm_per_s=50,
                               acceleration_mm_per_s2=500)
        answer = self.system.robot("run", fast)
        self.assertEqual(answer.returncode, 1, answer.stdout)
        self.assertRegex(answer.stdout, r"failed: 4 points, \d+ iterations: missed [234] of 4 points, worst .* mm at point \d")
        self.assertRegex(answer.stdout, r"error, tip of arm_a: RMS [\d.]+, 95 % within [\d.]+, maximum [1-9][\d.]* mm")
        self.assertRegex(answer.stdout, r"points reached: [012] of 4; time [\d.]+ s; gate: \d+ interventions")
        self.assertEqual(self.system.states(), ["DISABLED", "DISABLED"])

    def positions(self):
        self.assert_refused(self.move("a", self.system.joints()[0]), "not ENABLED")
        self.assert_ok(self.system.robot("enable"))
        before = self.system.joints()
        goal = [before[0][0] - 0.002, before[0][1] + 0.001, before[0][2] + 0.001] + [x + 0.1 for x in before[0][3:]]
        self.assert_ok(self.move("a", goal))
        self.assert_joints(0, goal)
        self.assertEqual(self.system.joints()[1], before[1], "the other arm moved")
        self.assert_ok(self.move("arm_a", before[0]))
        self.assert_joints(0, before[0])
        self.assertEqual(self.system.states(), ["ENABLED", "ENABLED"])

    def refusals(self):
        # A refused command must release the control lease.
        inside = self.system.joints()[0]
        before = self.system.assert_still(self, looks=2)
        outside = {"in front of the entry point": [0.001] + inside[1:],
                   "carriages out of order": [inside[0], inside[0] - 0.001] + inside[2:],
                   "an outer tube ahead": [inside[0], min(0.0, inside[0] + 0.121)] + inside[2:]}
        for what, joints in outside.items():
            self.assertGreater(tubes.excess(joints), 1e-4, what)
            self.assert_refused(self.move("a", joints), "outside the limits")
        self.assert_refused(self.move("a", inside[:5]), "found 5", "expected 6")
        self.assertEqual(self.move("a", inside[:5] + ["nan"]).returncode, 2)
        self.assertEqual(self.move("c", inside).returncode, 2)
        self.assert_refused(self.system.robot("method", "magic"), "found 'magic'", "expected")
        self.assert_refused(self.system.robot("set", "tip_gain", "--", "-1"), "found '-1'", "expected")
        self.assert_refused(self.system.robot("set", "magic", "1"), "found parameter 'magic'", "expected")
        self.assert_refused(self.system.robot("resume"), "'resume' is not allowed in ENABLED")
        self.assertEqual(self.system.joints(), before)
        self.assertEqual(self.system.states(), ["ENABLED", "ENABLED"])

    def pausing(self):
        before = self.system.joints()
        self.assert_ok(self.system.robot("pause"))
        self.assertEqual(self.system.states(), ["PAUSED", "PAUSED"])
        self.assert_refused(self.move("a", before[0]), "not ENABLED")
        self.assert_ok(self.system.robot("resume"))
        self.assertEqual(self.system.states(), ["ENABLED", "ENABLED"])
        self.assertEqual(self.system.assert_still(self), before)
        self.assert_ok(self.system.robot("disable"))
        self.assert_refused(self.system.robot("resume"), "'resume' is not allowed in DISABLED; 'enable' comes first")
        # A run that is refused switches the power off that it switched on.
        self.assert_refused(self.system.robot("run", "lift"), "planning/request")
        self.assertEqual(self.system.states(), ["DISABLED", "DISABLED"])

    def methods(self):
        for method in ("nspwln-joint", "snsqp", "nspqp"):
            self.assert_ok(self.system.robot("method", method))
            self.assertEqual(self.status()["method"], method)
        self.assert_ok(self.system.robot("set", "tip_gain", "2.5"))
        self.assert_ok(self.system.robot("set", "bounds", "frozen"))
        self.assert_ok(self.system.robot("set", "bounds", "coupled"))
        before = self.tips()
        back = self.trajectory("back", [0, -2, 0], points=2, max_iterations=round(10 / self.period))
        self.assert_ok(self.system.robot("run", back, "--method", "snsqp"))
        self.assertEqual(self.status()["method"], "snsqp")
        self.assert_moved(before, self.tips(), [0, -2e-3, 0])

    def interrupted_move(self):
        self.assert_ok(self.system.robot("enable"))
        here = self.system.joints()[1]
        far = here[:3] + [here[3] + 0.01, here[4], here[5]]
        far[2] = min(0.0, here[2] + 0.03)
        move = self.start_client("move-jp", "--arm", "b", "--", *far)
        system.until(lambda: self.system.joints()[1] != here, 10, "arm B moves")
        move.send_signal(signal.SIGINT)
        _, errors = move.communicate(timeout=20)
        self.assertEqual(move.returncode, 1)
        self.assertIn("paused", errors)
        self.assertEqual(self.system.states(), ["PAUSED", "PAUSED"])
        stood = self.system.assert_still(self)
        self.assertLess(abs(stood[1][2] - here[2]), 0.03, "it got to the goal before it was interrupted")
        self.assert_ok(self.system.robot("resume"))
        self.assertEqual(self.system.assert_still(self), stood, "what was interrupted went on by itself")
        self.assert_ok(self.system.robot("disable"))

    def start_client(self, *words):
        process = system.client(self.system.path, *words)
        self.addCleanup(system.reap, process)
        return process

    def guards(self):
        status = self.status()
        acted = {name for name, count in status["guards"].items() if count}
        if status["control"]["overruns"] > 0:
            # A loaded machine: control may approach a limit without recent positions of the drives.
            acted -= {"fresh", "position", "coupled_row"}
        if status["guards"].get("fresh", 0) <= 3:
            # A command that is occasionally delivered late is refused, which is the function of the guard.
            acted -= {"fresh"}
        self.assertEqual(acted, set())

    def end(self):
        pids = self.system.pids
        self.system.end_watch()
        self.assertEqual(sorted(set(pids) - {"recorder"}), ["control", "planning", "sim"])
        os.kill(self.system.up.pid, signal.SIGINT)
        self.system.event("stopped", 10)
        self.assertEqual(self.system.up.wait(10), 0)
        for pid in pids.values():
            self.assertRaises(ProcessLookupError, os.kill, pid, 0)
        self.assert_nothing_left()

    def await_words(self, run, words):
        """Reads the output of a run up to the line that contains `words`."""
        watch = threading.Timer(20, run.kill)
        watch.start()
        try:
            self.assertTrue(any(words in line for line in run.stderr), f"the run does not say '{words}'")
        finally:
            watch.cancel()

    def one_commander(self):
        method = self.status()["method"]
        run = self.start_run(self.system, self.long_line(120))  # outlasts ten commands on a loaded machine
        self.system.await_motion(run)
        held = self.status()["lease_owner"]
        self.assertNotEqual(held, 0)
        self.assert_refused(self.move("a", self.system.joints()[0]), "another client has the control lease")
        self.assert_refused(self.system.robot("enable"), "another client has the control lease")
        self.assert_refused(self.system.robot("method", "nspwln"), "another client has the control lease")
        self.assert_refused(self.system.robot("run", self.long_line()), "another client has the control lease")
        status = self.status()
        self.assertEqual((status["lease_owner"], status["trajectory"]["phase"], status["method"]),
                         (held, "running", method))
        # Any client may remove power, and the run reports how to continue.
        self.assert_ok(self.system.robot("pause"))
        self.await_words(run, "paused by cli (pid ")
        system.until(lambda: "; paused by cli (pid " in self.status()["diagnostics"]["tandem-control"]["message"], 10,
                     "control names the client that has paused")
        stood = self.system.assert_still(self)
        self.assertIsNone(run.poll(), "a pause ended the run")
        self.assert_refused(self.system.robot("resume"), "another client has the control lease: cli (pid ", f"pid {run.pid} on ",
                            "only that client can resume")
        self.system.assert_still(self)
        run.stdin.write("\n")
        run.stdin.flush()
        system.until(lambda: self.system.states() == ["ENABLED", "ENABLED"], 10, "Enter goes on")
        system.until(lambda: self.system.joints() != stood, 10, "the trajectory goes on")
        self.assert_ok(self.system.robot("pause"))
        self.await_words(run, "paused by cli (pid ")
        self.system.assert_still(self)
        run.send_signal(signal.SIGINT)
        _, errors = run.communicate(timeout=20)
        self.assertEqual(run.returncode, 1)
        self.assertIn("interrupted", errors)
        self.assertNotIn("paused by", errors, "once for each pause")
        self.assertEqual(self.system.states(), ["PAUSED", "PAUSED"])
        stood = self.system.joints()
        for command in ("resume", "disable", "enable"):
            self.assert_ok(self.system.robot(command))
            self.assertEqual(self.system.assert_still(self), stood, f"an old trajectory went on after '{command}'")
        self.assertEqual(self.system.states(), ["ENABLED", "ENABLED"])
        self.assert_ok(self.system.robot("run", self.short_line()))


class TenHertz(RealTime, system.SystemTest):
    preset, period = "laptop", 0.1
    steps = ("begin", "run_short", "run_timed", "run_that_misses", "positions", "guards", "end")


class OneKilohertz(RealTime, system.SystemTest):
    preset, period = "laptop-1khz", 0.001
    steps = ("begin", "run_short", "run_timed", "positions", "refusals", "pausing", "methods",
             "interrupted_move", "one_commander", "guards", "end")


if __name__ == "__main__":
    system.main()
