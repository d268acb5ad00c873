# SPDX-License-Identifier: Apache-2.0
"""Identification of the robot: processes with another robot or deployment than the running ones, and a second system with the same
domain."""
import filecmp
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402


class Commanders(system.SystemTest):
    def setUp(self):
        super().setUp()
        self.system = self.start("laptop", **system.real_time())
        self.home = self.system.joints()

    def changed(self, name, old, new):
        """A copy of the running deployment with some text replaced."""
        text = self.system.path.read_text()
        self.assertIn(old, text)
        path = self.folder / f"{name}.yaml"
        path.write_text(text.replace(old, new))
        return path

    def quicker(self):
        return self.changed("quicker", "control_period_s: 0.1", "control_period_s: 0.05")

    def assert_still_home(self):
        self.assertEqual(self.system.joints(), self.home)

    def mover(self, program, path):
        """A further service with the domain and prefix of the running ones."""
        process = subprocess.Popen([system.executable(program), "--deployment", path], stderr=subprocess.PIPE, text=True)
        self.addCleanup(system.reap, process)
        return process

    def mismatches(self):
        return [process["mismatch"] for process in self.system.status()["processes"] if process["mismatch"]]

    def test_a_client_with_another_deployment_moves_nothing(self):
        for words in (["enable"], ["home"], ["jog", "a", "beta_1", "1"], ["run", "rectangle"]):
            answer = system.run(*(words if words[0] == "jog" else ["robot", *words]), "--deployment", self.quicker())
            self.assert_refused(answer, "uses another robot or deployment", "control_period: 0.05 here, 0.1 there")
        # Nor do other tubes of the same name.
        robot = self.folder / "robot.yaml"
        text = (system.PRESETS / "robots" / "ark2024.yaml").read_text()
        robot.write_text(text.replace("straight_length_mm: 387", "straight_length_mm: 388", 1))
        self.assertNotEqual(robot.read_text(), text)
        other = self.changed("tubes", str(system.PRESETS / "robots" / "ark2024.yaml"), str(robot))
        self.assert_refused(system.run("robot", "--deployment", other, "enable"), "robot.arms[0].tubes[")
        self.assertEqual(self.system.states(), ["DISABLED", "DISABLED"])
        self.assert_still_home()
        # Every client may stop it, and another name, comment or order of keys is the same robot.
        self.assert_ok(self.system.robot("enable"))
        self.assert_ok(system.run("robot", "--deployment", self.quicker(), "stop"))
        self.assertEqual(self.system.states(), ["FAULT", "FAULT"])
        shutil.copy(system.PRESETS / "robots" / "ark2024.yaml", robot)
        same = self.changed("same", str(system.PRESETS / "robots" / "ark2024.yaml"), f"{robot}  # of our own")
        self.assert_ok(system.run("robot", "--deployment", same, "disable"))
        self.assertEqual(self.system.states(), ["DISABLED", "DISABLED"])

    def stops_when_appears(self, program, gains):
        self.assert_ok(self.system.robot("enable"))
        run = self.start_run(self.system, self.long_line())
        self.system.await_motion(run)
        other = self.mover(program, self.changed("other", "relative_gain_per_s: 5", f"relative_gain_per_s: {gains}"))
        system.until(lambda: self.system.states() == ["FAULT", "FAULT"], 10, "the arms stop")
        self.assertTrue(all("mismatch" in arm["faults"] for arm in self.system.status()["arms"]))
        system.until(self.mismatches, 5, "status names it")
        self.assertIn(f"relative_gain: 5 here, {gains} there", self.mismatches()[0])
        self.assertIn(f"pid {other.pid}", self.mismatches()[0])
        self.assertEqual(run.wait(20), 1)
        self.system.robot("disable")  # DDS may deliver only the commands of the other control to the drives, which have no power
        self.assert_refused(self.system.robot("enable"), "uses another robot or deployment", f"pid {other.pid}", "relative_gain")
        self.system.assert_still(self)
        other.send_signal(signal.SIGINT)
        self.assertIn(": ignored: ", other.communicate(timeout=20)[1])
        # After it has ended, the robot accepts commands again.
        system.until(lambda: self.system.robot("disable").returncode == 0, 20, "disable is obeyed")
        system.until(lambda: self.system.robot("enable").returncode == 0, 10, "enable is accepted")
        self.assert_ok(self.system.robot("disable"))

    def test_an_arm_stops_when_another_control_appears(self):
        self.stops_when_appears("tandem-control", gains=4)

    def test_an_arm_stops_when_another_robot_appears(self):
        self.stops_when_appears("tandem-sim", gains=6)

    def test_one_system_per_domain_and_prefix(self):
        pid = self.system.pids["control"]
        answer = system.run("up", self.system.path)
        self.assert_refused(answer, "in use by ", "pid ", f"on {os.uname().nodename}", "deployment laptop", "since ",
                            "--domain or --prefix")
        self.assertNotIn("ready", answer.stdout)
        self.assert_refused(system.run("up", self.quicker()), "in use by ")
        # An experiment uses an unused domain and prefix.
        experiment = system.short_experiment(self.folder, "nspqp")
        before = self.system.joints()
        self.assert_ok(system.run("experiment", experiment, "--only", "rectangle"))
        self.assertEqual(self.system.joints(), before)
        place = {"TANDEM_DOMAIN": str(self.key("domain")), "TANDEM_PREFIX": self.key("prefix")}
        self.assert_refused(system.run("experiment", experiment, environment=place), "in use by ")
        self.assertEqual(self.system.states(), ["DISABLED", "DISABLED"])
        self.assert_still_home()
        os.kill(pid, 0)

    def key(self, name):
        return next(line.split(": ")[1] for line in self.system.path.read_text().splitlines() if line.startswith(f"{name}:"))

    def test_every_command_uses_domain_and_prefix_of_the_environment(self):
        place = {"TANDEM_DEPLOYMENT": str(self.system.path)}
        self.assertIn(f"domain {self.key('domain')}, prefix {self.key('prefix')}",
                      self.assert_ok(system.run("status", environment=place)).stdout)
        elsewhere = system.run("status", "--prefix", "nobody", environment=place)
        self.assert_refused(elsewhere, "prefix nobody")
        for wrong in ({"TANDEM_DOMAIN": "300"}, {"TANDEM_PREFIX": "../x"}):
            answer = system.run("status", environment={**place, **wrong})
            self.assertEqual(answer.returncode, 2)
            self.assertIn(f"{next(iter(wrong))}:", answer.stderr)


class Ends(system.SystemTest):
    def test_a_terminal_that_is_closed_is_ctrl_c(self):
        robot = self.start("laptop", **system.real_time())
        run = self.start_run(robot, self.long_line())
        robot.await_motion(run)
        run.send_signal(signal.SIGHUP)
        self.assertIn("interrupted", run.communicate(timeout=20)[1])
        self.assertEqual(robot.states(), ["PAUSED", "PAUSED"])
        robot.up.send_signal(signal.SIGHUP)
        robot.event("stopped", 10)
        self.assertEqual(robot.up.wait(10), 0)


class LockStep(system.SystemTest):
    """In lock-step, lock_step_s is the only time limit."""

    def experiment(self, *words, **keys):
        path = system.deployment(self.folder, "lockstep", **keys)
        process = subprocess.Popen([system.executable(), "experiment", "table3", "--deployment", path, "--only", "nspqp", "--log", "info",
                                    *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(system.reap, process)
        return process

    def freeze_planning(self, process):
        """Freezes planning during a run. @return its pid"""
        for line in process.stderr:
            if "'rectangle'" in line:
                break
        planning = [pid for pid in system.processes_of(str(self.folder)) if "planning" in pathlib.Path(f"/proc/{pid}/cmdline").read_text()]
        self.assertEqual(len(planning), 1)
        os.kill(planning[0], signal.SIGSTOP)
        self.addCleanup(subprocess.run, ["kill", "-CONT", str(planning[0])], stderr=subprocess.DEVNULL, check=False)
        return planning[0]

    def test_a_process_that_gets_no_time_changes_no_digit(self):
        self.assertEqual(self.experiment("--csv", self.folder / "a").wait(60), 0)
        process = self.experiment("--csv", self.folder / "b")
        planning = self.freeze_planning(process)
        time.sleep(8)  # longer than all real-time budgets
        self.assertIsNone(process.poll())
        os.kill(planning, signal.SIGCONT)
        self.assertEqual(process.wait(60), 0, process.stderr.read())
        names = sorted(file.name for file in (self.folder / "a").iterdir())
        self.assertEqual(filecmp.cmpfiles(self.folder / "a", self.folder / "b", names, shallow=False), (names, [], []))

    def test_a_process_that_is_silent_beyond_its_bound_is_named(self):
        process = self.experiment(budgets="{lock_step_s: 6}")
        self.freeze_planning(process)
        _, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1)
        self.assertIn("no progress for 6 s", errors)
        self.assertIn("no recent message from planning", errors)


if __name__ == "__main__":
    system.main()
