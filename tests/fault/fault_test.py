# SPDX-License-Identifier: Apache-2.0
"""Dead, frozen and silent processes during a run in real time: the robot stands in time, says why, and moves again only when told to."""
import os
import pathlib
import signal
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "integration" / "harness"))
import system  # noqa: E402

PERIOD = 0.1             # s, of control
COMMAND_AGE = 0.3        # s: three periods without a command
REFERENCE_AGE = 0.25     # s without a reference
LEASE = 1.0              # s of silence of a commander
RAMP = 5e-3 / 0.1        # s: V_max over the deceleration of a stop
MACHINE = 0.25           # s: how late a busy machine may be


class Fault(system.SystemTest):
    def setUp(self):
        super().setUp()
        self.system = self.start("laptop")
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
        """FAULT latches; disable clears it, enable moves nothing, and a new run works."""
        stood = self.system.joints()
        self.assertEqual(self.system.robot("resume").returncode, 1)
        self.assertEqual(self.system.robot("enable").returncode, 1)
        self.assertEqual(self.system.states(), ["FAULT", "FAULT"])
        self.assert_ok(self.system.robot("disable"))
        status = self.system.status()
        self.assertEqual([arm["operating_state"] for arm in status["arms"]], ["DISABLED", "DISABLED"])
        self.assertEqual([arm["faults"] for arm in status["arms"]], ["none", "none"])
        self.assert_ok(self.system.robot("enable"))
        self.assertEqual(self.system.assert_still(self), stood, "an old trajectory went on after `enable`")
        self.assertEqual(self.system.states(), ["ENABLED", "ENABLED"])
        self.assert_ok(self.system.robot("disable"))
        self.assert_ok(self.system.robot("run", self.short_line()))
        self.assertNotEqual(self.system.joints(), stood)

    def death(self, name, budget):
        """kill -9: `up` says who died and how long the robot took to stand, ends everything and exits 1."""
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
        self.assertNotIn("moving", [event["event"] for event in self.system.events])
        self.run_process.communicate(timeout=20)
        self.assertEqual(self.run_process.returncode, 1)
        self.assert_nothing_left()
        self.starts_anew()

    def starts_anew(self):
        """On the same domain, at once: everything is there, nothing moves by itself, and a run works."""
        again = system.System(self.system.path)
        self.addCleanup(again.close)
        still = again.assert_still(self)
        self.assertEqual(again.states(), ["DISABLED", "DISABLED"])
        self.assertEqual([joints[:3] for joints in still], [[-0.15, -0.10, -0.05], [-0.13, -0.12, -0.10]])
        self.assert_ok(again.robot("run", self.short_line()))
        self.assertNotEqual(again.joints(), still)


class Death(Fault):
    def test_of_control(self):
        self.death("control", COMMAND_AGE)

    def test_of_planning(self):
        # Control hears of it at its next cycle; the drives end the setpoint that they have.
        self.death("planning", REFERENCE_AGE + 2 * PERIOD)

    def test_of_sim(self):
        self.death("sim", None)


class Freeze(Fault):
    def freeze(self, name):
        os.kill(self.system.pids[name], signal.SIGSTOP)

    def thaw(self, name):
        os.kill(self.system.pids[name], signal.SIGCONT)

    def test_of_control(self):
        self.freeze("control")
        self.end_of_run("control")
        self.thaw("control")
        stood = self.assert_fault("command_timeout", "state_timeout", "stale_command")
        self.assertIsNone(self.system.up.poll())
        self.assert_recovers()
        self.assertNotEqual(self.system.joints(), stood)

    def test_of_planning(self):
        frozen = time.monotonic()
        self.freeze("planning")
        self.end_of_run("FAULT", "reference_timeout")
        self.assertLess(time.monotonic() - frozen, REFERENCE_AGE + 2 * PERIOD + RAMP + 4 * MACHINE)
        self.thaw("planning")
        self.assert_fault("reference_timeout")
        self.assert_recovers()


class Silence(Fault):
    def test_a_dead_commander(self):
        self.run_process.kill()
        killed = time.monotonic()
        self.run_process.wait()
        system.until(lambda: self.faults() == ["lease_lost", "lease_lost"], LEASE + 8 * MACHINE, "the arms stop without a commander")
        # Until the lease was lost the robot went on: it was not the client's end that stopped it.
        self.assertGreater(time.monotonic() - killed, 0.5 * LEASE)
        self.assert_fault("lease_lost")
        self.assertEqual(self.system.status()["lease_holder"], 0)
        self.assert_recovers()

    def test_stop(self):
        self.assert_ok(self.system.robot("stop"))
        self.end_of_run("FAULT", "stop_requested")
        self.assert_fault("stop_requested")
        for command in ("resume", "enable"):
            self.assert_refused(self.system.robot(command), "FAULT", "disable")
        self.assert_fault("stop_requested")
        self.assert_recovers()

    def test_stop_of_a_standing_robot(self):
        self.run_process.send_signal(signal.SIGINT)
        self.run_process.communicate(timeout=20)
        self.assert_ok(self.system.robot("disable"))
        self.assert_ok(self.system.robot("stop"))
        self.assert_fault("stop_requested")
        self.assert_recovers()


if __name__ == "__main__":
    system.main()
