# SPDX-License-Identifier: Apache-2.0
"""Trajectories whose task list is one tip, or names other arms than the first two: in the command line and in a running system."""
import csv
import json
import math
import pathlib
import re
import sys

import yaml

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

CIRCLE = """tandem: trajectory/1
name: quick
tasks: [{tip: a}]
shape:
  circle: {center_offset_mm: [0, 5, 0], normal: [0, 0, 1], turns: 1}
points: 40
following: timed
speed_mm_per_s: 8
acceleration_mm_per_s2: 20
tolerance_mm: 0.88
max_iterations: 1000
"""


INSERTION = """tandem: trajectory/1
name: in
tasks: [{tip: a}, {follow_the_leader: {arm: a}}]
shape:
  insertion: {stages: [{tubes: 1, length_mm: 4}]}
points: 20
following: timed
speed_mm_per_s: 2
acceleration_mm_per_s2: 10
tolerance_mm: 0.88
max_iterations: 1000
"""


class OneArm(system.SystemTest):
    def file(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def table(self, *arguments):
        return json.loads(self.assert_ok(system.run("experiment", *arguments, "--json", timeout=120)).stdout)["rows"]

    def three_arms(self):
        """ark2024 with a third arm, 40 mm beside the others."""
        robot = yaml.safe_load((system.PRESETS / "robots" / "ark2024.yaml").read_text())
        third = json.loads(json.dumps(robot["arms"][1]))
        third.update(name="arm_c", base={"position_mm": [40, 0, 0], "rpy_deg": [0, 0, 0]})
        robot["arms"].append(third)
        robot["name"] = "three"
        return self.file("three.yaml", yaml.safe_dump(robot, sort_keys=False))

    def test_experiments(self):
        offline = self.table("one-arm", "--offline", "-d", "lockstep-one-arm")
        self.assertEqual(offline, self.table("one-arm", "-d", "lockstep-one-arm"), "over DDS as in one process")
        for row in offline:
            self.assertIsNone(row["epsilon_ab"])
            self.assertEqual((row["converged"], row["limit_violations"]), (100, 0), row)
        answer = self.assert_ok(system.run("experiment", "one-arm", "--offline", "--only", "lissajous", "--csv", self.folder))
        self.assertRegex(answer.stdout, r"nspqp +\d+\.\d +- +0\.\d")
        with open(self.folder / "lissajous-home-nspqp.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            error = math.dist([float(row[f"target_{x}"]) for x in "xyz"], [float(row[f"tip_{x}"]) for x in "xyz"])
            self.assertAlmostEqual(float(row["err_a"]), error, delta=1e-12)

    def test_an_insertion_follows_its_leader(self):
        offline = self.table("follow-the-leader", "--offline")
        self.assertEqual(offline, self.table("follow-the-leader"), "over DDS as in one process")
        for row in offline:
            self.assertEqual((row["converged"], row["limit_violations"]), (140, 0), row)
        answer = self.assert_ok(system.run("experiment", "follow-the-leader", "--offline", "--only", "plane", "--csv", self.folder))
        self.assertIn("remote centre of a: mean ", answer.stdout)
        for file in self.folder.glob("insertion-plane-*.csv"):
            with open(file, newline="", encoding="utf-8") as rows:
                deviation = max(float(row["err_remote_centre_a"]) for row in csv.DictReader(rows))
            self.assertLess(deviation, 0.4e-3 if "hqp" in file.name else 0.1e-3, file.name)

    def test_a_soft_task_keeps_neighbours_apart(self):
        def gap(soft, *options):
            """Least distance of neighbouring carriages, m; the rows of the run."""
            experiment = yaml.safe_load((system.PRESETS / "experiments" / "one-arm.yaml").read_text())
            experiment.update(robot=str(system.PRESETS / "robots" / "timc2024.yaml"), methods=["nspqp"])
            for trajectory in experiment["trajectories"]:
                trajectory["tasks"] += [{"joint_limits": {"arm": "a", "distance_mm": 40}}] if soft else []
            run = self.file("soft.yaml", yaml.safe_dump(experiment, sort_keys=False))
            answer = self.assert_ok(system.run("experiment", run, "-d", "lockstep-one-arm", "--only", "rectangle", "--csv", self.folder,
                                               *options, timeout=120))
            self.assertEqual("joint limits of a: mean 0." in answer.stdout, soft, answer.stdout)
            path = self.folder / "rectangle-home-nspqp.csv"
            with open(path, newline="", encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
            self.assertEqual(rows[-1]["point"], "100")
            self.assertLess(float(rows[-1]["err_a"]), 0.88e-3, "the tip goes where it goes without")
            return min(float(row[f"beta_a{i + 1}"]) - float(row[f"beta_a{i}"]) for row in rows for i in (1, 2)), path.read_bytes()

        self.assertLess(gap(False)[0], 15e-3)
        apart, rows = gap(True)
        self.assertGreater(apart, 25e-3)
        self.assertEqual(rows, gap(True, "--offline")[1], "over DDS as in one process")

    def test_random_tasks(self):
        answer = self.assert_ok(system.run("montecarlo", "-d", "lockstep-one-arm", "--tasks", "20", "--methods", "nspqp,hqp",
                                           "--infeasible", "0", "--json"))
        for line in json.loads(answer.stdout):
            self.assertGreater(line["succeeded"], 0)

    def test_arms_beyond_the_first_two(self):
        experiment = yaml.safe_load((system.PRESETS / "experiments" / "one-arm.yaml").read_text())
        experiment["robot"] = str(self.three_arms())
        experiment["methods"] = ["nspqp"]
        for tasks, relative in (([{"relative": ["c", "b"]}, {"tip": "c"}], True), ([{"tip": "b"}], False)):
            for trajectory in experiment["trajectories"]:
                trajectory["tasks"] = tasks
            for row in self.table(self.file("run.yaml", yaml.safe_dump(experiment, sort_keys=False)), "--offline"):
                self.assertEqual(row["converged"], 100, tasks)
                self.assertEqual(row["epsilon_ab"] is not None, relative)

    def test_running_system(self):
        robot = self.start("one-arm", robot=system.PRESETS / "robots" / "timc2024.yaml", **system.real_time())
        quick = self.file("quick.yaml", CIRCLE)
        answer = self.assert_ok(robot.robot("run", quick, timeout=60))
        self.assertIn("finished: 40 points", answer.stdout)
        self.assertIn("error, tip of arm_a: RMS 0.", answer.stdout)
        self.assertNotIn("relative", answer.stdout)
        insertion = self.file("in.yaml", INSERTION)
        said = json.loads(system.run("plan", "check", "-d", robot.path, insertion, "--json").stdout)["leader"]["deviation_m"]
        self.assertGreater(said, 1e-3)
        answer = self.assert_ok(robot.robot("run", insertion, timeout=60))
        self.assertIn("finished: 20 points", answer.stdout)
        measured = float(re.search(r"error, remote centre of arm_a: .*maximum ([\d.]+) mm", answer.stdout)[1])
        self.assertAlmostEqual(1e3 * said, measured, delta=0.3, msg="the deviation said before and measured after, mm")
        soft = self.file("soft.yaml", CIRCLE.replace("{tip: a}", "{tip: a}, {joint_limits: {arm: a, distance_mm: 40}}"))
        answer = self.assert_ok(robot.robot("run", soft, timeout=60))
        self.assertIn("finished: 40 points", answer.stdout)
        self.assertIn("error, joint limits of arm_a: RMS 0.", answer.stdout)
        for answer in (robot.robot("run", "circle"), system.run("plan", "check", "circle", "--robot", "timc2024")):
            self.assertNotEqual(answer.returncode, 0)
            self.assertIn("found arm b, expected a, the only arm of this robot; write tasks: [{tip: a}]", answer.stderr)
        answer = self.assert_ok(system.run("plan", "check", "-d", robot.path, quick, "--json"))
        self.assertTrue(json.loads(answer.stdout)["feasible"])
        self.assert_ok(robot.robot("enable"))
        self.assert_ok(robot.robot("home"))


if __name__ == "__main__":
    system.main()
