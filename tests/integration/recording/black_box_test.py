# SPDX-License-Identifier: Apache-2.0
"""The black box of a running robot: faults are on disk with the time before them, the number of files is limited, a disk error is
reported, and the robot is not affected."""
import json
import os
import pathlib
import queue
import re
import resource
import signal
import subprocess
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

BEFORE, AFTER, FILES = 5.0, 0.5, 3
LIMIT = 60_000  # bytes per file on the full disk


class Recorder:
    """A tandem-recorder of the test, and its log."""

    def __init__(self, path, preexec=None):
        self.process = subprocess.Popen([system.executable("tandem-recorder"), "--deployment", str(path)],
                                        stderr=subprocess.PIPE, text=True, preexec_fn=preexec, start_new_session=True)
        self._lines = queue.Queue()
        self._reader = threading.Thread(target=lambda: [self._lines.put(line) for line in self.process.stderr])
        self._reader.start()

    def await_line(self, text, seconds=30):
        deadline, seen = time.monotonic() + seconds, []
        while True:
            try:
                seen.append(self._lines.get(timeout=max(0.0, deadline - time.monotonic())))
            except queue.Empty:
                raise AssertionError(f"the recorder does not say '{text}', but {seen}") from None
            if text in seen[-1]:
                return seen[-1]

    def close(self):
        self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(20)
        self._reader.join()
        self.process.stderr.close()
        return code


class BlackBox(system.SystemTest):
    def setUp(self):
        super().setUp()
        self.box = self.folder / "box"
        self.system = self.start("laptop", control_period_s=0.05, black_box=self.keys(self.box))
        self.began = time.monotonic()

    def keys(self, directory):
        return (f"{{before_s: {BEFORE}, after_s: {AFTER}, files: {FILES}, memory_mb: 40, "
                f"directory: {directory}}}")

    def files(self):
        return sorted(self.box.glob("*.mcap"))

    def info(self, file, *more):
        answer = system.run("info", file, "--json", *more)
        return answer.returncode, json.loads(answer.stdout)

    def await_file(self, known):
        """The next complete file that is not in `known`."""

        def finished():
            fresh = [file for file in self.files() if file not in known]
            return fresh if fresh and self.info(fresh[-1])[0] == 0 else None

        return system.until(finished, 20, "a file of the black box")[-1]

    def clear(self):
        system.until(lambda: self.system.states() == ["FAULT", "FAULT"], 10, "the arms are in FAULT")
        self.assert_ok(self.system.robot("disable"))

    def test_all_steps_with_one_system(self):
        for step in ("a_fault", "stops", "death_of_the_recorder", "a_full_disk", "a_folder_that_is_none"):
            print(f"  {step}", flush=True)
            getattr(self, step)()
            self.assertIsNone(self.system.up.poll())

    def ended_by(self, name):
        pid = self.system.pids[name]
        os.kill(pid, signal.SIGKILL)
        self.system.event("stopped", 30)
        self.assertEqual(self.system.up.wait(10), 1)
        self.assertIn(f"tandem up: {name} (pid {pid}) was killed by signal 9", system.black_box(self.box))

    def test_the_death_of_control_is_kept(self):
        self.ended_by("control")

    def test_the_death_of_the_simulator_is_kept(self):
        self.ended_by("sim")

    def held(self):
        """Duration of the data in the black box, s."""
        recorder = self.system.status()["diagnostics"].get("tandem-recorder")
        return float(recorder["values"]["held_s"]) if recorder else 0.0

    def a_fault(self):
        system.until(lambda: self.held() > 1.0, 20, "the black box holds a second of all topics")
        run = self.start_run(self.system, self.long_line())
        self.system.await_motion(run)
        fault = time.monotonic()
        os.kill(self.system.pids["control"], signal.SIGSTOP)
        file = self.await_file([])
        os.kill(self.system.pids["control"], signal.SIGCONT)
        run.wait(20)
        code, info = self.info(file, "--check")
        self.assertEqual((code, info["damage"], info["finished"], info["profile"]), (0, [], True, "ros2"))
        self.assertIn("command_timeout", info["metadata"]["fault"]["fault"])
        self.assertIn("arm_a: command_timeout", info["metadata"]["fault"]["details"])
        box = info["metadata"]["black_box"]
        self.assertGreater(float(box["seconds_before"]), min(BEFORE, fault - self.began) - 0.5)
        self.assertLess(float(box["seconds_before"]), BEFORE + 0.1)
        self.assertGreater(float(box["seconds_after"]), 0.5 * AFTER)
        self.assertEqual(box["overwritten_while_writing"], "0")
        for topic in ("actuation/state", "actuation/command", "actuation/limits", "planning/reference",
                      "control/status", "hal/status", "diagnostics", "arm_a/measured_js"):
            self.assertGreater(info["topics"][topic]["messages"], 1, topic)
        self.assertGreater(info["topics"]["actuation/state"]["rate_hz"], 100)  # all samples, not the decimated ones
        run = info["metadata"]["tandem"]
        self.assertEqual((run["arms"], run["deployment"], run["host"]),
                         ("arm_a,arm_b", "laptop", os.uname().nodename))
        self.assert_configuration(file)
        self.assert_fault_is_in(file)
        self.clear()

    def assert_configuration(self, file):
        for name, original in (("deployment.yaml", self.system.path),
                               ("robot.yaml", system.PRESETS / "robots" / "ark2024.yaml")):
            self.assertEqual(system.run("info", file, "--attachment", name).stdout, original.read_text())
        self.assertIn("the file contains: deployment.yaml, robot.yaml",
                      system.run("info", file, "--attachment", "nothing").stderr)

    def assert_fault_is_in(self, file):
        self.assert_ok(system.run("export", file, "--csv", self.folder / "csv", "-t", "actuation/state"))
        rows = [line.split(",") for line in (self.folder / "csv" / "actuation_state.csv").read_text().splitlines()]
        column = rows[0].index("operating_state.arm_a")
        states = [row[column] for row in rows[1:]]
        self.assertEqual(states[-1], "3")  # FAULT
        self.assertIn("1", states)  # ENABLED, while it moved
        position = rows[0].index("position.arm_a.beta_1_m")
        self.assertGreater(len({row[position] for row in rows[1:]}), 20, "the motion before the fault is in it")

    def stops(self):
        for _ in range(FILES + 1):
            known = self.files()
            self.assert_ok(self.system.robot("stop"))
            file = self.await_file(known)
            self.assertIn("stop", self.info(file)[1]["metadata"]["fault"]["fault"])
            self.clear()
        self.assertEqual(len(self.files()), FILES)

    def death_of_the_recorder(self):
        os.kill(self.system.pids["recorder"], signal.SIGKILL)
        self.assertEqual(self.system.event("lost", 10)["process"], "recorder")
        self.assertEqual(self.system.states(), ["DISABLED", "DISABLED"])

    def a_full_disk(self):
        known = self.files()
        recorder = Recorder(self.system.path, lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, LIMIT)))
        self.addCleanup(recorder.close)
        recorder.await_line("ready")
        self.assert_ok(self.system.robot("stop"))
        line = recorder.await_line("not saved")
        self.assertRegex(line, re.escape(str(self.box)) + ".*cannot be written: File too large")
        file = [file for file in self.files() if file not in known][0]
        self.assertIn("stop", self.info(file)[1]["metadata"]["fault"]["fault"], "what has room is there")
        self.assertIsNone(recorder.process.poll())
        self.assertEqual(recorder.close(), 0)
        self.clear()

    def a_folder_that_is_none(self):
        obstacle = self.folder / "file"
        obstacle.write_text("")
        path = self.folder / "other.yaml"
        text = self.system.path.read_text()
        path.write_text(text.replace(str(self.box), str(obstacle / "box")))
        recorder = Recorder(path)
        self.addCleanup(recorder.close)
        self.assertIn("cannot be written: Not a directory", recorder.await_line("black box"))
        recorder.await_line("ready")
        self.assert_ok(self.system.robot("stop"))
        recorder.await_line("not saved")
        self.assertEqual(recorder.close(), 0)
        self.clear()


if __name__ == "__main__":
    system.main()
