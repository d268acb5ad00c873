# SPDX-License-Identifier: Apache-2.0
"""tandem-hal remembers the last positions: killed, with a joint turned by hand or a damaged file, it asks before an arm can
be enabled."""
import os
import pathlib
import signal
import sys
from unittest import mock

import yaml

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from hardware import COUNTS_PER_M, HalTest, system  # noqa: E402

TOLERANCE = 0.5e-3  # m
READY, UNCONFIRMED = "switch on disabled", "position not confirmed"
UNMEASURED = "position not measured"


class Positions(HalTest):
    # Nothing here is about deadlines: a busy host must not end the test.
    budgets = "{minimum_age_ms: 1500, planning_reference_ms: 3000, lease_ms: 6000, drive_heartbeat_ms: 1000}"
    feedback_budget_ms = 900

    def setUp(self):
        super().setUp()
        state = self.folder / "state"
        environment = mock.patch.dict(os.environ, XDG_STATE_HOME=str(state))
        environment.start()
        self.addCleanup(environment.stop)
        self.stored = state / "tandem" / "positions"
        key = "reference: absolute_encoder"
        # The linear stages of both arms.
        self.remembering = self.hardware.read_text().replace(key, f"{key}\n      jump_tolerance_mm: {1e3 * TOLERANCE}", 1)

    def kill(self):
        os.kill(self.running.pids["hal"], signal.SIGKILL)
        self.running.event("stopped", 30)
        self.running.close()

    def await_states(self, *expected):
        def states():
            return tuple(axis["state"] for axis in self.monitor(self.running)["axes"][:3])

        system.until(lambda: states() == expected, 30, f"the axes are {expected}")

    def confirm(self):
        self.assert_ok(system.run("home", "-d", self.running.path, "--confirm"))
        self.await_states(READY, READY, READY)

    def test_a_killed_hal_asks_after_a_jump(self):
        self.hardware.write_text(self.remembering)
        for bus in "ab":
            self.drive_sim(bus)
        self.running = self.start_hal()
        self.await_states(UNCONFIRMED, UNCONFIRMED, UNCONFIRMED)
        self.assert_refused(system.run("home", "-d", self.running.path), "--confirm")
        self.assertEqual({arm["homed"] for arm in self.monitor(self.running)["arms"]}, {False})
        waiting = self.running.status()["unconfirmed"]
        self.assertEqual([entry["joint"] for entry in waiting],
                         [f"arm_{arm} beta_{tube}" for arm in "ab" for tube in (1, 2, 3)])
        self.assertEqual({entry["expected"] for entry in waiting}, {None})
        self.assertIn("no last position is stored", waiting[0]["text"])
        self.confirm()
        [file] = system.until(lambda: list(self.stored.glob("*.txt")), 10, "the positions are stored")
        system.until(lambda: len(file.read_text().splitlines()) == 14, 10, "all twelve of them")
        for jump, first in ((0.5 * TOLERANCE, READY), (3.0 * TOLERANCE, UNCONFIRMED)):
            text = file.read_text()
            self.kill()
            self.tell("a", f"turn 1 {round(jump * COUNTS_PER_M)}")
            self.assertEqual(file.read_text(), text)
            self.running = self.start_hal()
            self.await_states(first, READY, READY)
            waiting = self.running.status()["unconfirmed"]
            self.assertEqual(len(waiting), 1 if first == UNCONFIRMED else 0)
            if first == UNCONFIRMED:
                found = waiting[0]
                self.assertEqual(found["joint"], "arm_a beta_1")
                self.assertAlmostEqual(found["measured"] - found["expected"], jump, delta=0.5 * TOLERANCE)
                self.assertAlmostEqual(found["tolerance"], TOLERANCE)
                text = self.assert_ok(system.run("status", self.running.path)).stdout
                self.assertIn("arm_a beta_1: position not confirmed: ", text)
                self.confirm()
                self.assertEqual(self.running.status()["unconfirmed"], [])
        self.kill()
        file.write_text(file.read_text()[:-30])
        self.running = self.start_hal()
        self.await_states(UNCONFIRMED, UNCONFIRMED, UNCONFIRMED)
        self.confirm()

    def test_measured_joints_are_known_after_their_measurement(self):
        hardware = yaml.safe_load(self.hardware.read_text())
        [group] = hardware["translations"]
        del group["encoder"]
        group["axes"] = [{key: value for key, value in axis.items() if not key.startswith("encoder")} for axis in group["axes"]]
        group["drive"]["reference"] = "measured"
        self.hardware.write_text(yaml.safe_dump(hardware, sort_keys=False))
        for bus in "ab":
            self.drive_sim(bus)
        self.running = self.start_hal()
        self.await_states(UNMEASURED, UNMEASURED, UNMEASURED)
        home = ["home", "-d", self.running.path]
        self.assert_refused(system.run(*home), "--measured")
        self.assertIn("--arm arm_a --measured beta_1=MM", self.running.status()["unconfirmed"][0]["text"])
        for wrong, why in (("beta_1", "JOINT=POSITION"), ("beta_1=1 mm", "JOINT=POSITION"), ("beta_1=nan", "JOINT=POSITION"),
                           ("gamma_1=3", "gamma_1"), ("beta_1=1e9", "check its unit"), ("alpha_1=3", "another `reference`")):
            answer = system.run(*home, "--arm", "a", "--measured", wrong)
            self.assertNotEqual(answer.returncode, 0, wrong)
            self.assertIn(why, answer.stderr)
        self.assertIn("expected --arm", system.run(*home, "--measured", "beta_1=1").stderr)
        self.assertIn("excludes", system.run(*home, "--arm", "a", "--measured", "beta_1=1", "--confirm").stderr)
        self.await_states(UNMEASURED, UNMEASURED, UNMEASURED)
        for arm, places in (("a", (-150.0, -100.0, -50.0)), ("b", (-130.0, -120.0, -100.0))):
            one, *others = [f"--measured=beta_{tube}={place}" for tube, place in enumerate(places, 1)]
            text = self.assert_ok(system.run(*home, "--arm", arm, one)).stdout
            self.assertIn(f"arm_{arm} beta_2: position not measured", text)
            self.assert_ok(system.run(*home, "--arm", arm, *others))
            axes = [axis for axis in self.monitor(self.running)["axes"] if axis["arm"] == f"arm_{arm}"]
            for axis, place in zip(axes, places):
                self.assertEqual(axis["state"], READY)
                self.assertAlmostEqual(1e3 * axis["position"], place, delta=0.01)
        self.assert_ok(self.running.robot("enable"))


if __name__ == "__main__":
    system.main()
