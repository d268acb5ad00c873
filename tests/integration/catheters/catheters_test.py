# SPDX-License-Identifier: Apache-2.0
"""Catheters over DDS: lock-step runs equal to those in one process, and operator commands in real time."""
import csv
import json
import math
import os
import pathlib
import signal
import subprocess
import sys
from unittest import mock

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

COOPERATIVE = system.PRESETS / "cooperative"
SAME = 1e-9  # m, rad: permitted difference between the equilibria of two processes, which reach them along different iterations


class Test(system.SystemTest):
    def path(self, name, **keys):
        file = self.folder / f"{name}.yaml"
        keys = {"shape": "line", "along": "[z]", "size_mm": 3, "duration_s": 4, "hold": "none", **keys}
        file.write_text("\n".join(["tandem: path/1", f"name: {name}"] + [f"{k}: {v}" for k, v in keys.items()]) + "\n")
        return file

    def record(self, deployment):
        """Starts a recording. @return its file, and a function that ends it"""
        file = self.folder / "run.mcap"
        process = subprocess.Popen([system.executable(), "record", str(deployment), "-o", str(file)],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(system.reap, process)
        system.until(lambda: file.exists() and file.stat().st_size > 0, 20, "a recording has begun")

        def end():
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.wait(20), 0, process.stderr.read())

        return file, end


class LockStep(Test):
    def run_both(self, command, *options):
        """One run over DDS and one in a single process. @return exit code, JSON and rows of each"""
        found = []
        for offline in ([], ["--offline"]):
            rows = self.folder / f"{command}{len(found)}.csv"
            with mock.patch.dict(os.environ, TMPDIR=str(self.folder)):
                answer = system.run("cooperative", command, "--json", "--csv", rows, *offline, *options, timeout=200)
            self.assertTrue(answer.stdout, answer.stderr)
            with open(rows, newline="", encoding="utf-8") as file:
                found.append((answer.returncode, json.loads(answer.stdout), list(csv.DictReader(file))))
        return found

    def assert_same(self, command, *options):
        (code, over_dds, rows), (_, offline, wanted) = self.run_both(command, *options)
        self.assertEqual(code, 0, over_dds)
        self.assertEqual((over_dds.pop("offline"), offline.pop("offline")), (False, True))
        for name, value in offline.items():
            if isinstance(value, float):
                self.assertAlmostEqual(over_dds[name], value, delta=SAME, msg=name)
            elif name == "facts":
                for fact, ends in value.items():
                    for one, other in zip(over_dds[name][fact], ends):
                        self.assertTrue(math.isclose(one, other, rel_tol=1e-5, abs_tol=1e-7), (fact, one, other))
            else:
                self.assertEqual(over_dds[name], value, name)
        self.assertEqual(len(rows), len(wanted))
        self.assertGreater(max(float(row["time"]) for row in rows), offline["periods"] * 0.009)
        moved = 0.0
        for row, other in zip(rows, wanted):
            for name in row:
                if name.startswith(("insertion", "roll", "bend", "time", "error", "x", "y", "z", "residual")):
                    self.assertAlmostEqual(float(row[name]), float(other[name]), delta=SAME, msg=(name, row["time"]))
            moved = max(moved, *(abs(float(row[axis]) - float(rows[0][axis])) for axis in "xyz"))
        self.assertGreater(moved, 0.9 * offline["size_m"])
        self.assertEqual(system.processes_of(str(self.folder)), [])
        self.assertEqual([path for path in self.folder.iterdir() if path.is_dir()], [], "a folder is left behind")

    def test_a_held_object_is_moved_as_in_one_process(self):
        self.assert_same("co-manipulate")

    def test_a_gripped_load_is_moved_as_in_one_process(self):
        file = self.folder / "loaded.yaml"
        text = (COOPERATIVE / "ablation-pair.yaml").read_text(encoding="utf-8")
        self.assertIn("  size_mm: 14\n", text)
        file.write_text(text.replace("  size_mm: 14\n", "  size_mm: 14\n  load_N: [0, 0, -1e-3]\n"), encoding="utf-8")
        self.assert_same("co-manipulate", "--robot", file, "--along", "z", "--duration", 3)

    def test_an_assisted_tip_is_moved_as_in_one_process(self):
        self.assert_same("target-assist", "--duration", 5)

    def test_what_cannot_be_moved_is_refused_in_the_same_words(self):
        circle = ("--shape", "circle", "--along", "x,z")
        (code, over_dds, rows), (other, offline, _) = self.run_both("co-manipulate", *circle)
        self.assertEqual((code, other), (1, 1))
        self.assertEqual(over_dds["refused"], offline["refused"])
        self.assertIn("the path requires translation along x", over_dds["refused"])
        self.assertIn("not possible: ", over_dds["refused"])
        self.assertEqual(rows, [])

    def test_a_recorded_run_is_simulated_again_to_the_last_bit(self):
        path = system.deployment(self.folder, "lockstep", robot=COOPERATIVE / "ablation-pair.yaml",
                                 control_period_s=0.01)
        file, end = self.record(path)
        running = system.System(path)
        self.addCleanup(running.close)
        answer = self.assert_ok(running.robot("run", self.path("short", duration_s=1, size_mm=1), timeout=100))
        self.assertIn("finished: 100 points", answer.stdout)
        running.close()
        end()
        again = self.assert_ok(system.run("replay", file, "--simulate"))
        self.assertRegex(again.stdout, r"[1-9]\d\d+ states simulated again, 0 differ; largest difference .* 0 m or rad")


class RealTime(Test):
    def start_pair(self):
        return self.start("ablation-pair", robot=COOPERATIVE / "ablation-pair.yaml", **system.real_time())

    def rise(self, robot):
        """Difference of both insertions from those of home, m."""
        return [joints[0] - home for joints, home in zip(robot.joints(), (0.060, 0.066))]

    def test_a_path_is_followed_or_refused(self):
        robot = self.start_pair()
        self.assertEqual(robot.states(), ["DISABLED", "DISABLED"])
        sideways = robot.robot("run", self.path("sideways", shape="circle", along="[x, z]"))
        self.assert_refused(sideways, "planning refused: the path requires translation along x", "not possible: ")
        self.assert_refused(robot.robot("run", "line"), "planning refused: planning/request:",
                            "found trajectory/1, expected path/1")
        for option in ("--check", "--planned"):
            answer = robot.robot("run", "lift", option)
            self.assertEqual(answer.returncode, 2, answer.stderr)
            self.assertIn(f"{option}: robot: found the catheters of ", answer.stderr)
        hasty = robot.robot("run", self.path("hasty", size_mm=20, duration_s=0.5))
        self.assertEqual(hasty.returncode, 1, hasty.stderr)
        self.assertRegex(hasty.stdout, r"failed: 100 points, \d+ iterations: at 0\.\d+ s: path error is .* mm, "
                         "allowed 1 mm")
        self.assert_ok(robot.robot("enable"))
        self.assert_ok(robot.robot("home"))
        run = self.start_run(robot, self.path("up", duration_s=3))
        system.until(lambda: min(self.rise(robot)) > 1e-3, 20, "both catheters are inserted by a millimetre")
        self.assertEqual(run.wait(30), 0, run.stderr.read())
        self.assertIn("finished: 100 points", run.stdout.read())
        self.assertEqual(robot.states(), ["DISABLED", "DISABLED"])
        self.assertLess(max(map(abs, self.rise(robot))), 2e-4, "the line ends where it began")

    def test_a_stop_latches_and_joints_are_moved_by_hand(self):
        robot = self.start_pair()
        run = self.start_run(robot, self.path("long", duration_s=60))
        robot.await_motion(run, 30)
        self.assert_ok(robot.robot("stop"))
        self.assertEqual(robot.states(), ["FAULT", "FAULT"])
        self.assertEqual(run.wait(10), 1)
        self.assertIn("stop_requested", run.stderr.read())
        robot.assert_still(self)
        self.assert_refused(robot.robot("run", "lift"), "FAULT")
        self.assert_ok(robot.robot("disable"))
        self.assertEqual(robot.states(), ["DISABLED", "DISABLED"])
        self.assert_ok(robot.robot("enable"))
        before = robot.joints()
        goal = [before[0][0] - 2e-4, before[0][1] + 0.01, before[0][2]]
        self.assert_ok(robot.robot("move-jp", "-a", "a", "--", *goal))
        for found, wanted in zip(robot.joints()[0], goal):
            self.assertAlmostEqual(found, wanted, delta=1e-5)
        self.assertEqual(robot.joints()[1], before[1])
        jogged = system.run("jog", "-d", robot.path, "b", "insertion", "0.5", "--for", "0.3")
        self.assert_ok(jogged)
        self.assertGreater(robot.joints()[1][0], before[1][0] + 2e-5)
        wrong = system.run("jog", "-d", robot.path, "b", "beta_1", "0.5")
        self.assertEqual(wrong.returncode, 2)
        self.assertIn("expected one of: insertion (mm/s), roll (deg/s), bend (deg/s)", wrong.stderr)
        self.assert_ok(robot.robot("home"))
        self.assertLess(max(map(abs, self.rise(robot))), 1e-5)

    def test_an_assisted_tip_follows_and_is_recorded(self):
        robot = self.start("ablation-assist", robot=COOPERATIVE / "ablation-assist.yaml", **system.real_time())
        file, end = self.record(robot.path)
        eight = self.path("eight", shape="lissajous", along="[x, y]", size_mm=2, duration_s=6, hold="places")
        answer = self.assert_ok(robot.robot("run", eight, timeout=90))
        self.assertIn("finished: 100 points", answer.stdout)
        end()
        info = json.loads(self.assert_ok(system.run("info", file, "--json")).stdout)
        self.assertEqual(info["metadata"]["tandem"]["joints"], "3,3")
        self.assert_ok(system.run("export", file, "--csv", self.folder / "csv"))
        for arm in ("target", "assist"):
            with open(self.folder / "csv" / f"{arm}_measured_js.csv", newline="", encoding="utf-8") as rows:
                names = next(row for row in csv.DictReader(rows))
            self.assertEqual([names[f"name[{j}]"] for j in range(3)],
                             [f"{arm}_{joint}" for joint in ("insertion", "roll", "bend")])
        tips = self.tips("target")
        for axis in (0, 1):  # on a slow machine, references lead too far
            self.assertAlmostEqual(max(p[axis] for p in tips) - min(p[axis] for p in tips), 4e-3, delta=7e-4)
        self.assert_ok(system.run("plot", file, "--figures", self.folder / "figures"))
        self.assertGreater((self.folder / "figures" / "joints.png").stat().st_size, 10000)

    def tips(self, arm):
        with open(self.folder / "csv" / f"{arm}_measured_cp.csv", newline="", encoding="utf-8") as rows:
            return [[float(row[f"pose.position.{axis}_m"]) for axis in "xyz"] for row in csv.DictReader(rows)]


if __name__ == "__main__":
    system.main()
