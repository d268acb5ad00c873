# SPDX-License-Identifier: Apache-2.0
"""Killed, frozen and silent processes during a run in real time.

The robot stops in time, reports the reason, and moves again only after a command."""
import os
import pathlib
import signal
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "integration" / "harness"))
import system  # noqa: E402

PERIOD = 0.05            # s, of control
COMMAND_AGE = 0.30       # s without a command; wider than the default, so that a busy machine causes no faults
REFERENCE_AGE = 0.50     # s without a reference
BUDGETS = f"{{minimum_age_ms: {1e3 * COMMAND_AGE:.0f}, planning_reference_ms: {1e3 * REFERENCE_AGE:.0f}}}"
LEASE = 1.0              # s without a heartbeat of the lease owner
RAMP = 5e-3 / 0.1        # s: V_max over the deceleration of a stop
MACHINE = 0.75           # s: greatest delay by a busy machine


class Fault(system.SystemTest):
    def setUp(self):
        super().setUp()
        self.system = self.start("laptop", control_period_s=PERIOD, budgets=BUDGETS)

    def begin_run(self):
        self.run_process = self.start_run(self.system, self.long_line())
        self.system.await_motion(self.run_process)

    def short_line(self):
        return self.trajectory("short", [0, 2, 0], points=2)

    def end_of_run(self, *reasons):
        """The client detects the fault itself, and reports the reason."""
        _, errors = self.run_process.communicate(timeout=20)
        self.assertEqual(self.run_process.returncode, 1)
        for reason in reasons:
            self.assertIn(reason, errors)

    def faults(self):
        return [arm["faults"] for arm in self.system.status()["arms"]]

    def assert_fault(self, *alternatives):
        """Both arms are in FAULT for one of these reasons and at standstill."""
        status = self.system.status()
        for arm in status["arms"]:
            self.assertEqual(arm["operating_state"], "FAULT", arm)
            self.assertTrue(any(reason in arm["faults"] for reason in alternatives), arm)
        return self.system.assert_still(self)

    def assert_recovers(self):
        """`disable` clears the fault, and `enable` moves nothing. The next test shows that a new run works."""
        stood = self.system.joints()
        self.assert_ok(self.system.robot("disable"))
        arms = self.system.status()["arms"]
        self.assertEqual([(arm["operating_state"], arm["faults"]) for arm in arms], [("DISABLED", "none")] * 2)
        self.assert_ok(self.system.robot("enable"))
        self.assertEqual(self.system.assert_still(self, looks=3), stood, "an old trajectory went on after `enable`")
        self.assertEqual(self.system.states(), ["ENABLED", "ENABLED"])

    def assert_runs(self):
        stood = self.system.joints()
        self.assert_ok(self.system.robot("run", self.short_line()))
        self.assertNotEqual(self.system.joints(), stood)

    def death(self, name, budget):
        """kill -9: `up` reports which process died and the time to standstill, ends everything and exits 1."""
        self.begin_run()
        victim = self.system.pids[name]
        killed = time.monotonic()
        os.kill(victim, signal.SIGKILL)
        died = self.system.event("died", 5)
        self.assertEqual((died["process"], died["pid"]), (name, victim))
        self.assertIn("killed by signal 9", died["text"])
        self.assertLess(died["at"] - killed, MACHINE)
        if budget is not None:
            standing = self.system.event("standing", 5)
            self.assertLess(standing["at"] - killed, budget + RAMP + MACHINE)
        self.system.event("stopped", 10)
        self.assertEqual(self.system.up.wait(10), 1)
        self.system.end_watch()
        self.assertNotIn("moving", [event["event"] for event in self.system.events])
        self.run_process.communicate(timeout=20)
        self.assertEqual(self.run_process.returncode, 1)
        self.assert_nothing_left()
        self.starts_anew()

    def starts_anew(self):
        """Restart on the same domain, at once: all processes run, and nothing moves without a command. The next run tests the rest."""
        again = system.System(self.system.path)
        self.addCleanup(again.close)
        self.assertEqual(again.states(), ["DISABLED", "DISABLED"])
        still = again.assert_still(self)
        self.assertEqual([joints[:3] for joints in still], [[-0.15, -0.10, -0.05], [-0.13, -0.12, -0.10]])
        self.system = again


class Death(Fault):
    """The system restarted after one death is the subject of the next."""

    def test_one_after_the_other(self):
        # Control detects planning's death in its next cycle; the drives complete their present setpoint.
        for name, budget in (("control", COMMAND_AGE), ("planning", REFERENCE_AGE + 2 * PERIOD), ("sim", None)):
            print(f"  {name}", flush=True)
            self.death(name, budget)
        self.assert_runs()


class Latched(Fault):
    """Faults that the processes survive, in sequence in one session."""

    def test_one_after_the_other(self):
        for step in ("frozen_control", "frozen_planning", "dead_commander", "stop_during_a_run",
                     "stop_of_a_standing_robot"):
            print(f"  {step}", flush=True)
            getattr(self, step)()
            self.assert_recovers()
            self.assertIsNone(self.system.up.poll())
        self.frozen_for_longer_than_dds_waits()  # the last step, since it may end the system

    def frozen_control(self):
        self.begin_run()
        os.kill(self.system.pids["control"], signal.SIGSTOP)
        time.sleep(2.5 * COMMAND_AGE)  # longer than the budget of a command, shorter than DDS's liveliness lease
        os.kill(self.system.pids["control"], signal.SIGCONT)
        self.end_of_run("FAULT")
        self.assert_fault("command_timeout", "state_timeout", "stale_command")

    def frozen_planning(self):
        self.begin_run()
        frozen = time.monotonic()
        os.kill(self.system.pids["planning"], signal.SIGSTOP)
        self.end_of_run("FAULT", "reference_timeout")
        self.assertLess(time.monotonic() - frozen, REFERENCE_AGE + 2 * PERIOD + RAMP + 2 * MACHINE)
        os.kill(self.system.pids["planning"], signal.SIGCONT)
        self.assert_fault("reference_timeout")

    def dead_commander(self):
        self.begin_run()
        killed = time.monotonic()
        self.run_process.kill()
        self.run_process.wait()
        system.until(lambda: self.faults() == ["lease_lost", "lease_lost"], LEASE + 4 * MACHINE,
                     "the arms stop without a commander")
        self.assertGreater(time.monotonic() - killed, 0.5 * LEASE, "it was not the lease that ended the motion")
        self.assert_fault("lease_lost")
        self.assertEqual(self.system.status()["lease_owner"], 0)

    def stop_during_a_run(self):
        self.begin_run()
        self.assert_ok(self.system.robot("stop"))
        self.end_of_run("FAULT", "stop_requested")
        for command in ("resume", "enable"):
            self.assert_refused(self.system.robot(command), "FAULT", "disable")
        self.assert_fault("stop_requested")

    def stop_of_a_standing_robot(self):
        self.assertEqual(self.system.states(), ["ENABLED", "ENABLED"])
        os.kill(self.system.pids["planning"], signal.SIGSTOP)
        try:
            self.assert_ok(self.system.robot("stop"))  # does not wait for processes that it does not need
        finally:
            os.kill(self.system.pids["planning"], signal.SIGCONT)
        self.assert_fault("stop_requested")

    def frozen_for_longer_than_dds_waits(self):
        """Either control resumes in FAULT, or it is considered dead: no other state, and no motion."""
        self.begin_run()
        os.kill(self.system.pids["control"], signal.SIGSTOP)
        self.end_of_run("control")  # more than 2 s without samples
        os.kill(self.system.pids["control"], signal.SIGCONT)

        def decided():
            return self.system.up.poll() is not None or system.run("status", self.system.path).returncode == 0

        system.until(decided, 10, "control is back, or `tandem up` has ended")
        if self.system.up.poll() is None:
            self.system.end_watch()  # its client may also have lost control
            self.assert_fault("command_timeout", "state_timeout", "stale_command")
            self.assert_recovers()
            self.assert_runs()
        else:
            self.assertEqual(self.system.up.poll(), 1)
            self.assertEqual(self.system.event("died", 1)["process"], "control")
            self.system.end_watch()
            self.assert_nothing_left()


if __name__ == "__main__":
    system.main()
