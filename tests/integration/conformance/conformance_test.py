# SPDX-License-Identifier: Apache-2.0
"""`tandem conformance hal` against tandem-sim, and against tandem-hal on simulated drives; what the command refuses."""
import json
import pathlib
import signal
import subprocess
import sys

FOLDER = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER.parent / "hal")]
from hardware import HalTest, system  # noqa: E402

TESTS = 23


def start(test, path, program, environment=None):
    """A process of the role hal, alone; ends with the test."""
    process = subprocess.Popen([str(program), "--deployment", str(path), "--log", "warn"], start_new_session=True, env=environment)
    test.addCleanup(process.wait)
    test.addCleanup(process.terminate)
    return process


def conformance(path, *words, timeout=200):
    return system.run("conformance", "hal", "-d", path, *words, timeout=timeout)


def assert_all_pass(test, path, *words):
    answer = conformance(path, *words)
    print(answer.stdout, answer.stderr, flush=True)
    test.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
    lines = answer.stdout.splitlines()
    test.assertEqual(lines[-1], f"{TESTS} of {TESTS} tests passed")
    test.assertEqual([line.split()[0] for line in lines[:-1]], TESTS * ["pass"])


def assert_moves_and_stops(test, robot):
    """A complete system enables the robot, follows a short trajectory, and stops it."""
    test.assert_ok(robot.robot("enable"))
    before = robot.joints()
    test.assert_ok(robot.robot("run", test.trajectory("short", [0, 2, 0], points=4)))
    test.assertNotEqual(robot.joints(), before)
    test.assert_ok(robot.robot("stop"))
    test.assertEqual(robot.states(), ["FAULT", "FAULT"])


class Simulator(system.SystemTest):
    def test_the_simulator_passes(self):
        path = system.deployment(self.folder, "laptop", **system.real_time())
        start(self, path, system.executable("tandem-sim"))
        assert_all_pass(self, path)

    def test_at_1_khz_a_stream_of_wrong_commands_does_not_count_as_loss_later(self):
        path = system.deployment(self.folder, "laptop-1khz", **system.real_time())
        start(self, path, system.executable("tandem-sim"))
        answer = self.assert_ok(conformance(path, "--only", "silence,repeated,fingerprint"))
        self.assertIn("3 of 3 tests passed, 20 left out", answer.stdout)


class Drives(HalTest):
    # As in the preset: simulated drives share the processor with everything else.
    budgets = "{drive_heartbeat_ms: 600}"
    feedback_budget_ms = 300

    def test_the_hal_passes_on_simulated_drives(self):
        for bus in "ab":
            self.drive_sim(bus)
        path = self.deployment(with_drives=True)  # names the drives, which run already
        start(self, path, system.executable("tandem-hal"))

        def ready():
            answer = system.run("can", "monitor", path, "--once", "--json")
            return answer.returncode == 0 and all(arm["homed"] for arm in json.loads(answer.stdout)["arms"])

        system.until(ready, 30, "all axes know where they are")
        assert_all_pass(self, path)


class Command(system.SystemTest):
    def test_it_refuses_to_run_beside_control(self):
        robot = self.start("laptop", **system.real_time())
        self.assert_ok(robot.robot("enable"))
        answer = conformance(robot.path)
        self.assert_refused(answer, "found control (pid", "expected no control", "no command has been sent")
        self.assertEqual(robot.states(), ["ENABLED", "ENABLED"], "the running robot is not disturbed")

    def test_lines_that_are_wrong(self):
        path = system.deployment(self.folder, "laptop")
        answer = conformance(path, "--only", "enabel")
        self.assertEqual(answer.returncode, 2)
        self.assertIn("--only: found 'enabel', expected one of identity,states,start,", answer.stderr)
        path = system.deployment(self.folder, "lockstep")
        answer = conformance(path)
        self.assertEqual(answer.returncode, 2)
        self.assertIn("clock: found lock_step, expected real_time", answer.stderr)

    def test_nobody_answers(self):
        answer = conformance(system.deployment(self.folder, "laptop"))
        self.assert_refused(answer, "no identity of a process 'hal' or 'sim'", "start the process of the role hal first")

    def test_another_robot_is_named(self):
        (self.folder / "other").mkdir()
        path = system.deployment(self.folder, "laptop")
        other = self.folder / "other" / "laptop.yaml"
        other.write_text(path.read_text().replace("tip_gain_per_s: 3", "tip_gain_per_s: 4"))
        start(self, other, system.executable("tandem-sim"))
        self.assert_refused(conformance(path), "no actuation/state with this deployment's fingerprint", "tip_gain: 3")

    def running(self):
        """A simulator, and a conformance test that has begun to command it."""
        path = system.deployment(self.folder, "laptop", **system.real_time())
        simulator = start(self, path, system.executable("tandem-sim"))
        test = subprocess.Popen([system.executable(), "conformance", "hal", "-d", str(path)], stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True, start_new_session=True)
        self.addCleanup(system.reap, test)
        for line in test.stdout:
            if line.startswith("pass  enable"):
                return path, simulator, test
        raise AssertionError(f"the test ended early: {test.stderr.read()}")

    def assert_ends(self, test, reason):
        _, errors = test.communicate(timeout=30)
        self.assertEqual(test.returncode, 1, errors)
        self.assertIn(reason, errors)
        self.assertIn("the drives have been stopped, the remaining tests have not run", errors)

    def test_an_interruption_stops_the_robot(self):
        path, _, test = self.running()
        test.send_signal(signal.SIGINT)
        self.assert_ends(test, "interrupted")
        again = conformance(path, "--only", "start")
        self.assertEqual(again.returncode, 1)
        self.assertIn("found arm_a FAULT, expected DISABLED", again.stdout)

    def test_a_process_that_ends_ends_the_test(self):
        _, simulator, test = self.running()
        simulator.kill()
        self.assert_ends(test, "found no actuation/state for 5")

    def test_json(self):
        path = system.deployment(self.folder, "laptop", **system.real_time())
        start(self, path, system.executable("tandem-sim"))
        answer = json.loads(self.assert_ok(conformance(path, "--only", "identity,start,limit", "--no-limits", "--json")).stdout)
        self.assertEqual((answer["passed"], answer["left_out"]), (2, TESTS - 2))
        self.assertEqual([row["test"] for row in answer["tests"]], ["identity", "start"])
        self.assertTrue(all(row["pass"] and row["found"] for row in answer["tests"]))


if __name__ == "__main__":
    system.main()
