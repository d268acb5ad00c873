# SPDX-License-Identifier: Apache-2.0
"""The example type of docs/own-robot-type.md in the command line, the simulator, control, planning, the console and a recording."""
import csv
import io
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

ROBOT = system.PRESETS / "planar" / "planar-pair.yaml"
LINKS = (0.15, 0.12)  # m


def tip(joints, base):
    """Tip of two links in the plane, m."""
    first, second = joints[0], joints[0] + joints[1]
    return [LINKS[0] * math.cos(first) + LINKS[1] * math.cos(second), base + LINKS[0] * math.sin(first) + LINKS[1] * math.sin(second)]


class Planar(system.SystemTest):
    def test_command_line(self):
        answer = self.assert_ok(system.run("validate", ROBOT))
        self.assertIn("planar-pair", answer.stdout)
        answer = self.assert_ok(system.run("fk", "-r", "planar-pair", "-a", "b", "--jacobian", text="0.3,-0.8\n"))
        row = next(csv.DictReader(io.StringIO(answer.stdout)))
        x, y = tip((0.3, -0.8), -0.1)
        self.assertAlmostEqual(float(row["x"]), x, delta=1e-12)
        self.assertAlmostEqual(float(row["y"]), y, delta=1e-12)
        self.assertEqual(sum(name.startswith("j") for name in row), 12)
        answer = system.run("fk", "-r", "planar-pair", "--branch", text="0,0\n")
        self.assertEqual(answer.returncode, 2)
        self.assertIn("--branch: the arm has no tubes", answer.stderr)
        answer = self.assert_ok(system.run("experiment", "planar-circle", "--offline", "--csv", self.folder))
        self.assertIn("circle", answer.stdout)
        with open(self.folder / "circle-home-hqp.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertIn("turn_a1", rows[0])
        at = [tip((float(row["turn_a1"]), float(row["turn_a2"])), 0.1) for row in rows]
        self.assertAlmostEqual(max(y for _, y in at) - min(y for _, y in at), 0.04, delta=2e-3)

    def drive_by_a_recorded_hand(self, robot):
        """10 mm/s along x for two seconds, without the deadband, halved."""
        hand = self.folder / "hand.csv"
        hand.write_text("time_s,present,vx_mm_per_s,vy_mm_per_s,vz_mm_per_s\n"
                        "0,0,0,0,0\n0.3,1,10,0,0\n2.3,1,10,0,0\n2.4,1,0,0,0\n2.6,1,0,0,0\n")
        before = tip(robot.joints()[0], 0.1)
        answer = self.assert_ok(system.run("teleop", "--deployment", robot.path, "--trace", hand, "--enable", "--mode", "tip",
                                           "--arm", "a", "--scale", "0.5", timeout=60))
        after = tip(robot.joints()[0], 0.1)
        self.assertGreater(after[0] - before[0], 5e-3, answer.stdout)
        self.assertLess(after[0] - before[0], 11e-3, answer.stdout)
        self.assertAlmostEqual(after[1], before[1], delta=1e-3)
        self.assertEqual(robot.states(), ["DISABLED", "DISABLED"])

    def test_running_system(self):
        robot = self.start("planar-pair", robot=ROBOT, **system.real_time())
        circle = self.folder / "circle.yaml"
        circle.write_text("tandem: trajectory/1\nname: circle\narm: a\nother_arm: b\npoints: 60\nrelative: hold\n"
                          "following: timed\nspeed_mm_per_s: 30\nacceleration_mm_per_s2: 100\ntolerance_mm: 0.9\nmax_iterations: 1000\n"
                          "shape:\n  circle: {center_offset_mm: [0, 20, 0], normal: [0, 0, 1], turns: 1}\n")
        before = robot.joints()
        refused = robot.robot("run", circle, "--planned")
        self.assertEqual(refused.returncode, 2, refused.stderr)
        self.assertIn("found the planar arms of ", refused.stderr)
        answer = self.assert_ok(robot.robot("run", circle, timeout=60))
        self.assertIn("finished: 60 points", answer.stdout)
        for arm, base in ((0, 0.1), (1, -0.1)):
            for here, there in zip(tip(robot.joints()[arm], base), tip(before[arm], base)):
                self.assertAlmostEqual(here, there, delta=1.5e-3)
        self.drive_by_a_recorded_hand(robot)
        self.assert_ok(robot.robot("enable"))
        jogged = system.run("jog", "-d", robot.path, "b", "turn_2", "2", "--for", "0.3")
        self.assert_ok(jogged)
        wrong = system.run("jog", "-d", robot.path, "b", "beta_1", "0.5")
        self.assertIn("expected one of: turn_1 (deg/s), turn_2 (deg/s)", wrong.stderr)
        self.assert_ok(robot.robot("home"))
        for found, wanted in zip(robot.joints(), ((-20, 60), (20, -60))):
            for one, other in zip(found, wanted):
                self.assertAlmostEqual(one, math.radians(other), delta=1e-4)


if __name__ == "__main__":
    system.main()
