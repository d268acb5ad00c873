# SPDX-License-Identifier: Apache-2.0
"""Bodies that overlap: an interlock where the deployment asks for one, warnings where it does not. The preset's arms overlap at home."""
import pathlib
import sys
import unittest.mock

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

LINE = """tandem: trajectory/1
name: short
shape: {line: {displacement_mm: [0, 0, 2]}}
points: 10
following: timed
speed_mm_per_s: 2
tolerance_mm: 0.88
max_iterations: 1000
"""


class Clearance(system.SystemTest):
    def trajectory(self):
        path = self.folder / "short.yaml"
        path.write_text(LINE)
        return path

    def logged(self, **changes):
        """The preset `laptop`; what its processes log is in the file `log`."""
        with open(self.folder / "log", "w", encoding="utf-8") as log, unittest.mock.patch.object(system.System, "stderr", log):
            return self.start("laptop", **system.real_time(), **changes)

    def test_interlock(self):
        robot = self.logged(least_clearance_mm=0)
        answer = robot.robot("run", self.trajectory())
        self.assertEqual(answer.returncode, 1, answer.stdout + answer.stderr)
        self.assertRegex(answer.stderr, r"in FAULT: clearance\. .*jog them apart")
        self.assertRegex((self.folder / "log").read_text(), r"FAULT of arm_a: clearance: -0\.1\d+ mm, expected at least 0 mm")
        before = robot.joints()
        self.assertEqual(robot.states(), ["FAULT", "FAULT"])
        refused = robot.robot("enable")
        self.assertNotEqual(refused.returncode, 0)
        self.assertEqual(robot.joints(), before)
        self.assert_ok(robot.robot("disable"))
        self.assert_ok(robot.robot("enable"))
        # Away from the other arm: backwards out of the port.
        self.assert_ok(system.run("jog", "-d", robot.path, "a", "beta_1", "-1", "--for", "0.5"))
        self.assertEqual(robot.states(), ["ENABLED", "ENABLED"], "the bodies come no closer")

    def test_warnings(self):
        robot = self.logged()
        answer = self.assert_ok(robot.robot("run", self.trajectory()))
        self.assertRegex(answer.stdout, r"WARNING: bodies overlapped by up to 0\.[12]\d+ mm")
        status = self.assert_ok(system.run("status", robot.path))
        self.assertRegex(status.stdout, r"arm_a to arm_b: -0\.[12]\d+ mm: they overlap")
        log = (self.folder / "log").read_text()
        self.assertRegex(log, r"\[control\] \[warning\] arm_a and arm_b overlap by 0\.1\d+ mm: tube \d of arm_a, tube \d of arm_b")


if __name__ == "__main__":
    system.main()
