# SPDX-License-Identifier: Apache-2.0
"""tandem plan: verdicts, reasons, files and exit codes."""
import csv
import itertools
import json
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest

import yaml

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402

FAR = """tandem: trajectory/1
name: far
arm: a
other_arm: b
shape:
  line: {displacement_mm: [0, 0, 200]}
points: 12
relative: hold
"""
NEAR = FAR.replace("200", "10").replace("points: 12", "points: 5")


def plan(*arguments):
    answer = system.run("plan", *arguments)
    return answer, (json.loads(answer.stdout) if "--json" in arguments and answer.returncode < 2 else None)


class Plan(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.far = self.folder / "far.yaml"
        self.far.write_text(FAR)
        self.near = self.folder / "near.yaml"
        self.near.write_text(NEAR)

    def file(self, name, content):
        path = self.folder / name
        path.write_text(yaml.safe_dump(content, sort_keys=False))
        return path

    def test_files_of_solvers_in_the_working_folder_change_nothing(self):
        answers = []
        for options in ("", "max_iter 0\n"):
            (self.folder / "ipopt.opt").write_text(options)
            for words in (("ik", "--tip", "a=0.02,0.01,0.3"), ("time", self.near)):
                done = subprocess.run([system.executable(), "plan", *map(str, words), "--json"], cwd=self.folder, capture_output=True,
                                      text=True, timeout=120, check=False)
                self.assertEqual(done.returncode, 0, done.stderr)
                answers.append(done.stdout)
        self.assertEqual(answers[2:], answers[:2])

    def test_inverse_kinematics_with_an_orientation_is_that_of_fk(self):
        joints = "-0.1,-0.08,-0.05,0.7,1.1,0.4"
        fk = subprocess.run([system.executable(), "fk", "--json", "--csv", "-"], input=joints, capture_output=True, text=True,
                            timeout=60, check=True)
        tip = "a=" + ",".join(str(json.loads(fk.stdout)[0][key]) for key in ("x", "y", "z", "qx", "qy", "qz", "qw"))
        other = "-0.1,-0.08,-0.05,0.785,0.785,0.785"
        answer, report = plan("ik", "--tip", tip, "--joints", f"{joints.replace('0.7', '0.71')},{other}", "--no-clearance", "--json")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertLess(report["angles_rad"][0], 1e-6)
        for joint, expected in zip(report["joints"], map(float, joints.split(","))):
            self.assertAlmostEqual(joint, expected, delta=1e-4)
        for wrong, words in (("a=0,0,0.3,0,0,0,0", "quaternion qx,qy,qz,qw of length 0, expected 1"),
                             ("a=0,0,0.3,1", "found 4 numbers in 'a=0,0,0.3,1', expected 3, 6 or 7"), ("a=0,0,0.3,nan,0,0,1", "--tip")):
            answer, _ = plan("ik", "--tip", wrong)
            self.assertEqual(answer.returncode, 2, answer.stderr)
            self.assertIn(words, answer.stderr)

    def test_a_trajectory_that_can_be_run_ends_with_0_and_one_that_cannot_says_where_and_why(self):
        answer, report = plan("check", self.near, "--json")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertTrue(report["feasible"])
        self.assertEqual((report["points"], report["unreachable"]), (5, []))
        self.assertRegex(answer.stderr, r"point 5/5")
        answer, report = plan("check", self.far, "--json")
        self.assertEqual(answer.returncode, 1, answer.stderr)
        self.assertFalse(report["feasible"])
        last = report["unreachable"][-1]
        self.assertEqual((last["point"], last["reach"]), (12, "limits"))
        self.assertRegex(last["reason"], r"arm a: [\d.]+ mm away, limited by .*(translation|travel)")
        self.assertAlmostEqual(sum((a - b) ** 2 for a, b in zip(last["wanted_m"], last["nearest_m"])) ** 0.5,
                               last["error_m"], delta=1e-9)
        text, _ = plan("check", self.far)
        self.assertEqual(text.returncode, 1)
        self.assertIn(f"point 12: {last['reason']}", text.stdout)

    def test_further_tasks_are_checked_for_what_the_tasks_before_leave(self):
        file = self.folder / "axis.yaml"
        short = "arm: a\nother_arm: b\n"

        def check(tasks, *options):
            text = NEAR.replace(short, f"tasks: {tasks}\n")
            file.write_text(text if "relative:" in tasks else re.sub(r"^relative:.*\n", "", text, flags=re.M))
            return plan("check", file, "--no-rehearsal", *options)

        answer, report = check("[{relative: [a, b]}, {tip: a}, {axis: {arm: a}}]", "--json")
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        self.assertEqual([task["task"] for task in report["tasks"]], ["relative position of a and b", "tip of a", "axis of a"])
        self.assertEqual([task["degrees_of_freedom"] for task in report["tasks"]], [3, 3, 2])
        self.assertEqual(report["lost_task"], "")
        for tasks, before in (("[{orientation: {arm: a}}, {tip: a}, {axis: {arm: a}}]", "orientation of a, tip of a"),
                              ("[{orientation: {arm: a}}, {axis: {arm: a}}, {relative: [a, b]}, {tip: a}]", "orientation of a")):
            answer, _ = check(tasks)
            self.assertEqual(answer.returncode, 1, answer.stdout + answer.stderr)
            self.assertIn("task axis of a: rank 0 of 2, ", answer.stdout)
            self.assertRegex(answer.stdout, rf"not feasible: axis of a: at .* the tasks before it \({before}\) take all degrees of freedom")

    def test_an_insertion_is_judged_by_how_far_the_tubes_leave_their_path(self):
        """In the rigid model tubes follow their leader however they are turned, elastic ones only in one plane."""
        said = {}
        for start in ("plane", "turned"):
            for model in ("rigid", "compliant"):
                answer, report = plan("check", "follow-the-leader", "--from", f"follow-the-leader:{start}", "--model", model, "--json",
                                      "--no-clearance")
                self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
                leader = report["leader"]
                self.assertLess(leader["rehearsed_deviation_m"], 0.2e-3, (start, model))
                said[start, model] = leader["deviation_m"]
        for start, model in (("plane", "rigid"), ("turned", "rigid"), ("plane", "compliant")):
            self.assertLess(said[start, model], 2e-6)
        self.assertGreater(said["turned", "compliant"], 5 * said["turned", "rigid"])
        answer, _ = plan("check", "follow-the-leader", "--from", "follow-the-leader:plane", "--no-clearance")
        self.assertRegex(answer.stdout,
                         r"the shaft leaves its path by [\d.e-]+ mm at most, at point \d+, at \[.*\] mm; in the rehearsal by")
        answer, _ = plan("check", "remote-centre")
        self.assertNotIn("leader", answer.stdout)

    def test_helical_tubes_leave_their_path_as_far_as_the_check_says(self):
        """Helices of one torsion do not twist each other where they are aligned, others do."""
        robot = yaml.safe_load((system.PRESETS / "robots" / "ark2024.yaml").read_text())
        for arm, torsions in zip(robot["arms"], ((25, 25, 25), (25, 25, -25)), strict=True):
            for tube, torsion in zip(arm["tubes"], torsions, strict=True):
                tube["torsion_per_m"] = torsion
        self.file("helix.yaml", robot)
        preset = yaml.safe_load((system.PRESETS / "experiments" / "follow-the-leader.yaml").read_text())
        planned = {}
        for arm, model in itertools.product("ab", ("rigid", "compliant")):
            deployment = yaml.safe_load((system.PRESETS / "deployments" / "lockstep-compliant-plant.yaml").read_text())
            deployment.update(robot="helix.yaml", model=model, plant={"model": model})
            tasks = [{"tip": arm}, {"follow_the_leader": {"arm": arm}}]
            experiment = {**preset, "robot": "helix.yaml"}
            for configuration in experiment["configurations"]:
                configuration["joints"] = [{**joints, "arm": f"arm_{k}"} for joints, k in
                                           zip(configuration["joints"], arm + "ab".replace(arm, ""), strict=True)]
            run = experiment["trajectories"][0]
            run["tasks"] = tasks
            trajectory = {"tandem": "trajectory/1", "name": "in", **{key: run[key] for key in
                          ("tasks", "shape", "points", "tolerance_mm", "max_iterations")}}
            files = [self.file("experiment.yaml", experiment), self.file("in.yaml", trajectory)]
            answer = system.run("experiment", files[0], "--offline", "-d", self.file("deployment.yaml", deployment), "--json")
            self.assertEqual(answer.returncode, 0, answer.stderr)
            measured = {entry["run"]: 1e-3 * entry["max_mm"] for entry in json.loads(answer.stdout)["further"]}
            self.assertEqual(len(measured), 8)
            for name, deviation in measured.items():
                _, start, method = name.split("-")
                answer, report = plan("check", files[1], "--robot", self.folder / "helix.yaml", "--model", model, "--method", method,
                                      "--from", f"{files[0]}:{start}", "--no-clearance", "--json")
                self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
                rehearsed = report["leader"]["rehearsed_deviation_m"]
                self.assertLess(deviation, rehearsed + 10e-6, (arm, model, name))
                self.assertLess(rehearsed, deviation + 1e-3 * run["tolerance_mm"], (arm, model, name))
                planned[arm, start, model] = report["leader"]["deviation_m"]
                self.assertEqual(report["planar_start"], (arm, start) == ("a", "plane"))
        for arm, start, model in planned:
            if model == "rigid" or (arm, start) == ("a", "plane"):
                self.assertLess(planned[arm, start, model], 2e-6)
            else:
                self.assertGreater(planned[arm, start, model], 10e-6)

    def test_the_arms_pass_a_needle_without_touching(self):
        answer, report = plan("check", "needle-passing", "--from", "needle-passing:apart", "--clearance-mm", "2", "--json")
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        self.assertTrue(report["feasible"])
        self.assertGreater(report["smallest_clearance_m"], 2e-3)
        self.assertEqual([task["rank"] for task in report["tasks"]], [3, 3, 3])

    def test_a_repaired_trajectory_can_be_run(self):
        repaired = self.folder / "repaired.yaml"
        answer, report = plan("repair", self.far, "-o", repaired, "--json")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertTrue(report["after"]["feasible"])
        self.assertGreater(report["largest_change_m"], 1e-3)
        self.assertEqual(system.run("validate", repaired).returncode, 0)
        again, _ = plan("check", repaired)
        self.assertEqual(again.returncode, 0, again.stdout)

    def test_joints_for_a_tip_give_that_tip(self):
        answer, report = plan("ik", "--tip", "a=0.02,0.01,0.3", "--tip", "b=0.03,-0.015,0.25", "--json")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        for arm, first, tip in (("a", 0, (0.02, 0.01, 0.3)), ("b", 6, (0.03, -0.015, 0.25))):
            row = ",".join(repr(x) for x in report["joints"][first:first + 6]) + "\n"
            line = next(csv.DictReader(system.run("fk", "--arm", arm, text=row).stdout.splitlines()))
            for name, wanted in zip("xyz", tip):
                self.assertAlmostEqual(float(line[name]), wanted, delta=1e-6)
        answer, report = plan("ik", "--tip", "a=0.02,0.01,0.7", "--json")
        self.assertEqual((answer.returncode, report["reached"], report["reach"]), (1, False, "limits"))
        self.assertGreater(len(report["limits"]), 0)

    def test_timing_keeps_the_speed_of_the_carriages(self):
        table = self.folder / "timing.csv"
        answer, report = plan("time", self.near, "--csv", table, "--json")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        rows = list(csv.DictReader(table.read_text().splitlines()))
        self.assertEqual(len(rows), 6)
        self.assertAlmostEqual(float(rows[-1]["t"]), report["seconds"], delta=1e-9)
        for before, after in zip(rows, rows[1:]):
            duration = float(after["t"]) - float(before["t"])
            for j in (1, 2, 3, 7, 8, 9):
                self.assertLessEqual(abs(float(after[f"q_{j}"]) - float(before[f"q_{j}"])), 5e-3 * duration + 1e-12)

    def test_starts_come_best_first(self):
        answer, starts = plan("start", self.near, "--tries", "4", "--json")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertTrue(any(start["given"] for start in starts))
        self.assertEqual([s["unreachable"] for s in starts], sorted(s["unreachable"] for s in starts))

    def test_a_start_with_overlapping_arms_is_refused_before_the_points(self):
        text = (system.PRESETS / "robots/ark2024.yaml").read_text()
        for sign in ("", "-"):
            self.assertIn(f"position_mm: [0, {sign}5, 0]", text)
            text = text.replace(f"position_mm: [0, {sign}5, 0]", f"position_mm: [0, {sign}0.5, 0]")
        robot = self.folder / "close.yaml"
        robot.write_text(text)
        answer, _ = plan("check", "circle", "--robot", robot)
        self.assertEqual(answer.returncode, 1)
        self.assertRegex(answer.stdout, r"not feasible: at the start the distance of the arms is -2\.\d+ mm, expected at least 0 mm")
        self.assertIn("at the start arm_a and arm_b overlap by 2.", answer.stderr)
        self.assertNotRegex(answer.stderr, r"point \d+/")
        self.assertEqual(plan("check", "circle", "--robot", robot, "--no-clearance")[0].returncode, 0)

    def test_a_check_that_is_interrupted_says_what_it_has_found(self):
        self.far.write_text(FAR.replace("points: 12", "points: 2000"))
        check = subprocess.Popen([system.executable(), "plan", "check", self.far], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                 text=True)
        lines = iter(check.stderr.readline, "")
        self.assertTrue(any(line.startswith("point 200/2000") for line in lines))
        check.send_signal(signal.SIGINT)
        rest = check.communicate(timeout=60)
        self.assertEqual(check.returncode, 1, rest)
        found = re.search(r"cancelled after (\d+) points, (\d+) of them unreachable", rest[1])
        self.assertTrue(found, rest)
        self.assertGreaterEqual(int(found.group(1)), 200)
        if int(found.group(2)) > 0:
            self.assertRegex(rest[1], r"the first: point \d+: arm a: ")

    def test_bad_input_ends_with_2_and_names_the_place(self):
        self.far.write_text(FAR.replace("displacement_mm: [0, 0, 200]", "displacement_mm: [0, 0]"))
        answer, _ = plan("check", self.far)
        self.assertEqual(answer.returncode, 2)
        self.assertRegex(answer.stderr, re.escape(str(self.far)) + r":6:\d+: .*displacement_mm")
        for arguments, words in ((("check", "nowhere"), "nowhere"), (("ik", "--tip", "a=1,2"), "--tip"),
                                 (("ik", "--tip", "c=1,2,3"), "arm_a, arm_b"),
                                 (("check", self.near, "--from", "table3:9"), "expected a configuration"),
                                 (("check", self.near, "--joints", "1,2,3"), "--joints"),
                                 (("check", self.near, "--stability", "2"), "--stability")):
            answer, _ = plan(*arguments)
            self.assertEqual(answer.returncode, 2, arguments)
            self.assertIn(words, answer.stderr)

    def test_help_teaches(self):
        for name in ("check", "repair", "ik", "time", "start"):
            answer = system.run("plan", name, "--help")
            self.assertEqual(answer.returncode, 0)
            self.assertIn("--clearance-mm", answer.stdout)
        self.assertIn("tandem plan check circle", system.run("plan", "--help").stdout)


if __name__ == "__main__":
    system.main()
