# SPDX-License-Identifier: Apache-2.0
"""Dead, frozen and silent processes during a run in real time.

The robot stands in time, says why, and moves again only when commanded to."""
import os
import pathlib
import signal
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "integration" / "harness"))
import system  # noqa: E402

PERIOD = 0.05            # s, of control
COMMAND_AGE = 0.30       # s without a command; wider than by default, so that a busy machine is no fault of its own
REFERENCE_AGE = 0.50     # s without a reference
BUDGETS = f"{{minimum_age_ms: {1e3 * COMMAND_AGE:.0f}, planning_reference_ms: {1e3 * REFERENCE_AGE:.0f}}}"
LEASE = 1.0              # s of silence of a commander
RAMP = 5e-3 / 0.1        # s: V_max over the deceleration of a stop
MACHINE = 0.25           # s: how late a busy machine may be


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
        """The client notices by itself, and says why."""
        _, errors = self.run_process.communicate(timeout=20)
        self.assertEqual(self.run_process.returncode, 1)
        for reason in reasons:
            self.assertIn(reason, errors)

    def faults(self):
        return [arm["faults"] for arm in self.system.status()["arms"]]

    def assert_fault(self, *alternatives):
        """Both arms are in FAULT for one of these reasons and stand still."""
        status = self.system.status()
        for arm in status["arms"]:
            self.assertEqual(arm["operating_state"], "FAULT", arm)
            self.assertTrue(any(reason in arm["faults"] for reason in alternatives), arm)
        return self.system.assert_still(self)

    def assert_recovers(self):
        """`disable` clears the fault, and `enable` moves nothing. That a new run works, the next one shows."""
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
        """kill -9: `up` says who died and how long the robot took to stand, ends everything and exits 1."""
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
        """On the same domain, at once: everything is there, and nothing moves by itself. The next run shows the rest."""
        again = system.System(self.system.path)
        self.addCleanup(again.close)
        self.assertEqual(again.states(), ["DISABLED", "DISABLED"])
        still = again.assert_still(self)
        self.assertEqual([joints[:3] for joints in still], [[-0.15, -0.10, -0.05], [-0.13, -0.12, -0.10]])
        self.system = again


class Death(Fault):
    """What was started anew after one death is what dies next."""

    def test_one_after_the_other(self):
        # Control learns of planning's death at its next cycle; the drives end the setpoint that they have.
        for name, budget in (("control", COMMAND_AGE), ("planning", REFERENCE_AGE + 2 * PERIOD), ("sim", None)):
            print(f"  {name}", flush=True)
            self.death(name, budget)
        self.assert_runs()


class Latched(Fault):
    """Faults that the processes survive, one after the other in one life."""

    def test_one_after_the_other(self):
        for step in ("frozen_control", "frozen_planning", "dead_commander", "stop_during_a_run",
                     "stop_of_a_standing_robot"):
            print(f"  {step}", flush=True)
            getattr(self, step)()
            self.assert_recovers()
            self.assertIsNone(self.system.up.poll())
        self.frozen_for_longer_than_dds_waits()  # the last one: the system may be given up

    def frozen_control(self):
        self.begin_run()
        os.kill(self.system.pids["control"], signal.SIGSTOP)
        time.sleep(2.5 * COMMAND_AGE)  # beyond the budget of a command, within the time in which DDS gives a process up
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
        self.assertEqual(self.system.status()["lease_holder"], 0)

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
            self.assert_ok(self.system.robot("stop"))  # waits for nobody whom it does not need
        finally:
            os.kill(self.system.pids["planning"], signal.SIGCONT)
        self.assert_fault("stop_requested")

    def frozen_for_longer_than_dds_waits(self):
        """Either control comes back in FAULT, or it is given up for dead: nothing in between, and no motion."""
        self.begin_run()
        os.kill(self.system.pids["control"], signal.SIGSTOP)
        self.end_of_run("control")  # its silence of more than 2 s
        os.kill(self.system.pids["control"], signal.SIGCONT)

        def decided():
            return self.system.up.poll() is not None or system.run("status", self.system.path).returncode == 0

        system.until(decided, 10, "control is back, or `tandem up` has ended")
        if self.system.up.poll() is None:
            self.system.end_watch()  # it may have lost control, too
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
