# SPDX-License-Identifier: Apache-2.0
"""`tandem commission`: a new arm whose file has a wrong direction, at drives with free travel, and a person who answers."""
import csv
import json
import os
import pathlib
import signal
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from hardware import COUNTS_PER_M, HalTest, system  # noqa: E402

PLAY_MM = 0.05


class Commission(HalTest):
    # What stops in time is tested elsewhere; here a process of a busy host may be late.
    feedback_budget_ms = 900
    budgets = ("{drive_heartbeat_ms: 1500, minimum_age_ms: 1000, planning_reference_ms: 2000, lease_ms: 5000, "
               "teleoperation_ms: 1000}")

    def commission(self, running, answers, *words):
        return system.run("commission", "-d", running.path, "--out", self.folder / "found", "--json", *words, text="".join(answers),
                          timeout=150)

    def found(self):
        return json.loads((self.folder / "found" / "commissioning.json").read_text())["axes"]

    def test_an_arm_is_checked_axis_by_axis(self):
        for bus in "ab":
            self.drive_sim(bus, "--play", str(PLAY_MM * 1e-3 * COUNTS_PER_M))
        running = self.start_hal()
        self.await_ready(running)
        start = running.joints()
        quick = ("--speed-percent", "10", "--arm", "a")

        # One axis: moved once more, then confirmed.
        answer = self.commission(running, ["a\n", "y\n"], *quick, "--joint", "beta_3")
        self.assert_ok(answer)
        axis = self.found()["arm_a beta_3"]
        self.assertEqual((axis["direction"], axis["problems"]), ("right", []))
        self.assertAlmostEqual(axis["travel"], 1.0, delta=0.5)  # a late command moves the joint longer
        self.assertAlmostEqual(axis["backlash"], PLAY_MM, delta=0.01)
        self.assertAlmostEqual(axis["encoder_ratio"], 1.0, delta=0.01)
        self.assertEqual(running.states(), ["DISABLED", "DISABLED"])
        self.assertLess(max(abs(a - b) for a, b in zip(running.joints()[0], start[0])), 1e-3, "near where it was")
        rows = list(csv.DictReader((self.folder / "found" / "arm_a_beta_3.csv").open(encoding="utf-8")))
        self.assertGreater(len(rows), 20)
        self.assertEqual(list(rows[0])[1], "setpoint_mm")
        # On a quiet host a simulated drive stays between its last targets, which is no following error.
        errors = [abs(float(row["following_error_mm"])) for row in rows]
        self.assertLess(min(abs(axis["following_max"] - error) for error in errors), 1e-6)
        self.assertLessEqual(axis["following_max"], max(errors) + 1e-6)

        # A joint that goes the wrong way.
        answer = self.commission(running, ["x\n", "n\n"], *quick, "--joint", "alpha_1", "--figure", self.folder / "sweep.png")
        self.assertEqual(answer.returncode, 1, answer.stdout + answer.stderr)
        self.assertIn("found 'x', expected one letter of ynaq", answer.stderr)
        self.assertIn("it moves the wrong way: set `reversed: true`", answer.stderr)
        self.assertGreater((self.folder / "sweep.png").stat().st_size, 10000)
        corrected = self.folder / "found" / "hardware.yaml"
        self.assert_ok(system.run("validate", corrected))
        self.assertEqual(corrected.read_text().count("reversed: true"), 2, "drive and encoder")
        self.assertIn("| arm_a alpha_1 | wrong |", (self.folder / "found" / "report.md").read_text())

        # Ctrl-C at a question.
        client = subprocess.Popen([system.executable(), "commission", "-d", str(running.path), "--out", str(self.folder / "found"),
                                   *quick, "--joint", "alpha_2"], stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                  start_new_session=True)
        self.addCleanup(system.reap, client)
        for line in client.stderr:
            if "moves by" in line:
                break
        system.until(lambda: client.stderr.read(1) == "d", 60, "it asks: did ... move")
        client.send_signal(signal.SIGINT)
        client.wait(60)  # communicate() would end the answers
        errors = client.stderr.read()
        self.assertEqual(client.returncode, 1, errors)
        self.assertIn("interrupted; the results so far are kept", errors)
        self.assertEqual(running.states(), ["DISABLED", "DISABLED"])
        self.assertNotIn("arm_a alpha_2", self.found())

        # All of the arm: the finished axis is skipped; without answers it ends at the next one.
        answer = self.commission(running, [], *quick)
        self.assertEqual(answer.returncode, 1)
        self.assertIn("no answer; the results so far are kept", answer.stdout + answer.stderr)
        self.assertEqual(running.states(), ["DISABLED", "DISABLED"])
        answer = self.commission(running, [], *quick, "--joint", "beta_3")
        self.assert_ok(answer)
        self.assertIn("arm_a beta_3: is done", answer.stderr)

    def test_what_cannot_be_checked_is_refused(self):
        for bus in "ab":
            self.drive_sim(bus)
        running = self.start_hal()
        self.await_ready(running)
        answer = self.commission(running, [], "--joint", "beta_9")
        self.assertEqual(answer.returncode, 2)
        self.assertEqual(self.commission(running, [], "--speed-percent", "0").returncode, 2)
        answer = system.run("commission", "-d", "laptop", "--out", self.folder / "none")
        self.assertEqual(answer.returncode, 2)
        self.assertIn("has no `hardware`", answer.stdout + answer.stderr)
        # A drive that fails while it is measured: the arm stops, the command says why.
        client = subprocess.Popen([system.executable(), "commission", "-d", str(running.path), "--out", str(self.folder / "failed"),
                                   "--arm", "a", "--joint", "beta_3"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True, start_new_session=True)
        self.addCleanup(system.reap, client)
        before = running.joints()[0][2]
        system.until(lambda: abs(running.joints()[0][2] - before) > 2e-4, 60, "beta_3 moves")
        self.tell("a", "inject 3 over_current")
        _, errors = client.communicate(timeout=60)
        self.assertEqual(client.returncode, 1, errors)
        self.assertIn("the arm is in FAULT: ", errors)
        self.assertFalse(os.path.exists(self.folder / "failed" / "commissioning.json"))


if __name__ == "__main__":
    system.main()
