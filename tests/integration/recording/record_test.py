# SPDX-License-Identifier: Apache-2.0
"""`tandem record`, info, replay, export and plot on running systems."""
import csv
import json
import pathlib
import queue
import re
import resource
import signal
import subprocess
import sys
import threading
import time

import h5py
import numpy
import scipy.io

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402


class Record:
    """A running `tandem record`, and its output."""

    def __init__(self, path, file, *options, preexec=None):
        self.file = file
        self.process = subprocess.Popen(
            [system.executable(), "record", str(path), "-o", str(file), "--json", *map(str, options)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=preexec, start_new_session=True)
        self._events = queue.Queue()
        self._reader = threading.Thread(target=lambda: [self._events.put(line) for line in self.process.stdout])
        self._reader.start()
        self.last = self.event()

    def event(self, seconds=30):
        self.last = json.loads(self._events.get(timeout=seconds))
        return self.last

    def await_messages(self, count):
        while self.last["messages"] < count:
            self.event()

    def end(self, sign=signal.SIGINT):
        """@param sign None: waits for its end @return exit code, the last event, stderr."""
        if sign is not None and self.process.poll() is None:
            self.process.send_signal(sign)
        code = self.process.wait(30)
        self._reader.join()
        while not self._events.empty():
            self.event()
        errors = self.process.stderr.read() if not self.process.stderr.closed else ""
        self.process.stdout.close()
        self.process.stderr.close()
        return code, self.last, errors

    def close(self):
        if not self.process.stdout.closed:
            self.end(signal.SIGKILL)


class Recording(system.SystemTest):
    def record(self, path, name, *options, **more):
        record = Record(path, self.folder / name, *options, **more)
        self.addCleanup(record.close)
        return record

    def info(self, file, *more):
        answer = system.run("info", file, "--json", *more)
        self.assertTrue(answer.stdout, answer.stderr)
        return json.loads(answer.stdout)

    def table(self, file, topic):
        """Columns of one topic, as texts."""
        folder = self.folder / "csv"
        self.assert_ok(system.run("export", file, "--csv", folder, "-t", topic))
        with open(folder / (topic.replace("/", "_") + ".csv"), newline="", encoding="utf-8") as stream:
            rows = list(csv.reader(stream))
        return {name: [row[i] for row in rows[1:]] for i, name in enumerate(rows[0])}


class LockStep(Recording):
    def test_a_run_is_simulated_again_to_the_last_bit(self):
        path = system.deployment(self.folder, "lockstep")
        # A second recording, by a process with another control period.
        (self.folder / "wrong").mkdir()
        wrong = self.folder / "wrong" / "lockstep.yaml"
        wrong.write_text(path.read_text().replace("control_period_s: 0.1", "control_period_s: 0.2"))
        record, other = self.record(path, "run.mcap"), self.record(wrong, "wrong.mcap")
        running = system.System(path)
        self.addCleanup(running.close)
        self.assert_ok(running.robot("run", self.trajectory("line", [0, 3, 0], points=30)))
        running.close()
        for each in (record, other):
            code, last, errors = each.end()
            self.assertEqual((code, last["lost"]), (0, 0), errors)
        states = self.table(record.file, "actuation/state")
        self.assertGreater(len(set(states["position.arm_a.beta_1_m"])), 10, "the robot moved")
        again = self.assert_ok(system.run("replay", record.file, "--simulate"))
        self.assertRegex(again.stdout, r"[1-9]\d* states simulated again, 0 differ; largest difference .* 0 m or rad")
        differs = system.run("replay", other.file, "--simulate")
        self.assertEqual(differs.returncode, 1, differs.stdout + differs.stderr)
        self.assertRegex(differs.stderr, r"state \d+ is the first one that differs")


class RealTime(Recording):
    def setUp(self):
        super().setUp()
        self.system = self.start("laptop", control_period_s=0.05,
                                 black_box=f"{{directory: {self.folder / 'box'}, memory_mb: 20}}")

    def test_all_steps_with_one_system(self):
        self.whole = self.folder / "whole.mcap"
        for step in ("whole_file", "death", "full_disk", "rotation", "refusals", "replay", "export", "plot"):
            print(f"  {step}", flush=True)
            getattr(self, step)()

    def whole_file(self):
        record = self.record(self.system.path, "whole.mcap")
        self.assert_ok(self.system.robot("run", self.trajectory("short", [0, 1, 0], points=2)))
        record.await_messages(3000)
        _, last, _ = record.end()
        info = self.info(self.whole, "--check")
        self.assertEqual((info["finished"], info["damage"]), (True, []))
        self.assertEqual(info["messages"], last["messages"])
        self.assertEqual(sum(topic["lost"] for topic in info["topics"].values()), last["lost"])
        names = {attachment["name"] for attachment in info["attachments"]}
        self.assertEqual(names, {"deployment.yaml", "robot.yaml"})
        # The robot's sequence numbers count computed states, the writer's count published ones: never more.
        state = self.table(self.whole, "actuation/state")
        inner, outer = (numpy.diff([int(number) for number in state[name]]) for name in
                        ("sequence", "sequence_of_writer"))
        self.assertTrue((outer > 0).all() and (inner >= outer).all())
        self.assertEqual((outer - 1).sum(), info["topics"]["actuation/state"]["lost"])
        text = self.assert_ok(system.run("info", self.whole)).stdout
        for part in ("actuation/state", "tandem_msgs/msg/ActuationState", "deployment: laptop", "robot.yaml, "):
            self.assertIn(part, text)

    def death(self):
        record = self.record(self.system.path, "killed.mcap")
        record.await_messages(1500)
        reported = record.last["messages"]
        record.event()  # 1 s later
        code, _, _ = record.end(signal.SIGKILL)
        self.assertEqual(code, -signal.SIGKILL)
        answer = system.run("info", record.file, "--json")
        self.assertEqual(answer.returncode, 1)
        self.assertIn("file is incomplete", answer.stderr)
        self.assertGreaterEqual(json.loads(answer.stdout)["messages"], reported)

    def full_disk(self):
        limit = 150_000
        record = self.record(self.system.path, "full.mcap",
                             preexec=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        while record.last["event"] != "failed":
            record.event()
        failed = record.last
        code, last, errors = record.end(sign=None)
        self.assertEqual((code, last["exit"]), (1, 1))
        self.assertRegex(last["error"]["message"], "full.mcap: cannot be written")
        self.assertRegex(errors, "full.mcap: cannot be written.*File too large.*; the part written before is complete")
        self.assertLessEqual(record.file.stat().st_size, limit)
        self.assertEqual(self.info(record.file)["messages"], failed["messages"])

    def rotation(self):
        record = self.record(self.system.path, "part.mcap", "--split-s", 1, "-t", "actuation/*", "hal/status")
        while len(record.last["files"]) < 3:
            record.event()
        _, last, _ = record.end()
        parts = [self.info(file, "--check") for file in last["files"]]
        self.assertTrue(all(part["finished"] and not part["damage"] for part in parts))
        self.assertEqual(sum(part["messages"] for part in parts), last["messages"])
        self.assertTrue(all(set(part["topics"]) <= {"actuation/state", "actuation/command", "actuation/limits",
                                                    "hal/status"} for part in parts))
        self.assertEqual(pathlib.Path(last["files"][1]).name, "part_2.mcap")

    def refusals(self):
        for words, reason in ((("record", self.system.path, "-o", self.whole), "is not overwritten"),
                              (("record", self.system.path, "-t", "no/such"), "expected a name that `tandem topics` lists"),
                              (("record", self.system.path, "-t", "control/statsu"), "did you mean control/status?"),
                              (("info", self.system.path), "is no MCAP file"),
                              (("export", self.whole), "expected at least one of"),
                              (("export", self.whole, "--csv", self.folder / "x", "-t", "nothing"), "pattern of one, among "),
                              (("replay", self.whole, "--remap", "x"), "expected OLD:=NEW"),
                              (("replay", self.whole, "--simulate"), "expected one of a deployment with clock: lock_step")):
            answer = system.run(*words)
            self.assertNotEqual(answer.returncode, 0, words)
            self.assertIn(reason, answer.stderr)
            self.assertFalse((self.folder / "x").exists())

    def replay(self):
        """Replay into another, empty domain: all topics arrive, with the same values."""
        (self.folder / "other").mkdir()
        path = system.deployment(self.folder / "other", "laptop")
        record = self.record(path, "again.mcap")
        began = time.monotonic()
        answer = self.assert_ok(system.run("replay", self.whole, "-d", path, "--rate", "2", "--remap",
                                           "arm_b/measured_js:=other/measured_js", "-t", "arm_*", "diagnostics",
                                           "actuation/command"))
        self.assertIn("replayed", answer.stdout)
        self.assertGreater(time.monotonic() - began, 0.5 * self.info(self.whole)["duration_s"])
        record.event()
        record.end()
        was, now = self.table(self.whole, "arm_a/measured_js"), self.table(record.file, "arm_a/measured_js")
        same = [name for name in was if name.startswith(("header", "name", "position", "velocity"))]
        self.assertGreater(len(same), 10)
        stamps = list(zip(was["header.stamp.sec"], was["header.stamp.nanosec"]))
        again = []  # ascending, without duplicates; a busy robot may have reported one state twice
        for stamp in zip(now["header.stamp.sec"], now["header.stamp.nanosec"]):
            again.append(stamps.index(stamp, again[-1] + 1 if again else 0))
        self.assertGreater(len(again), len(stamps) // 2)  # a busy machine may receive the replay late
        for name in same:
            self.assertEqual(now[name], [was[name][k] for k in again], name)
        self.assertNotIn("arm_b/measured_js", self.info(record.file)["topics"])

    def export(self):
        csv_folder, mat, hdf5 = self.folder / "all", self.folder / "run.mat", self.folder / "run.h5"
        self.assert_ok(system.run("export", self.whole, "--csv", csv_folder, "--mat", mat, "--hdf5", hdf5,
                                  "--resample", 100))
        matlab = scipy.io.loadmat(mat, squeeze_me=True)
        state = self.table(self.whole, "actuation/state")
        with h5py.File(hdf5) as file:
            group = file["actuation_state"]
            self.assertEqual(group.attrs["topic"], "actuation/state")
            self.assertEqual(file.attrs["tandem.deployment"], "laptop")
            for source in (group, matlab["actuation_state"]):
                def column(name, source=source):
                    return source[name][()] if source is group else source[name].item()
                for name in ("arm_a.beta_1_m", "arm_b.alpha_3_rad"):
                    numpy.testing.assert_array_equal(column("position_" + name.replace(".", "_")).ravel(),
                                                     numpy.array(state[f"position.{name}"], float))
                members = [*group] if source is group else source.dtype.names
                self.assertEqual(len([name for name in members if name.startswith("position_")]), 12)
                # All 64 bits of a session are preserved.
                self.assertEqual([int(number) for number in column("session")], [int(n) for n in state["session"]])
            names = file["arm_a_measured_js/name"][0]
            self.assertEqual(names[0].decode(), self.table(self.whole, "arm_a/measured_js")["name[0]"][0])
            time_s = file["aligned/time_s"][:]
            numpy.testing.assert_allclose(numpy.diff(time_s), 0.01, atol=1e-8)
            # The aligned table contains the latest values.
            aligned = file["aligned/actuation_state_position_arm_a_beta_1_m"][:]
            rows = numpy.searchsorted(group["log_time_ns"][:], file["aligned/log_time_ns"][:], side="right") - 1
            numpy.testing.assert_array_equal(aligned[rows >= 0], group["position_arm_a_beta_1_m"][:][rows[rows >= 0]])
        with open(csv_folder / "aligned.csv", encoding="utf-8") as stream:
            self.assertEqual(len(stream.readlines()), len(time_s) + 1)
        # The recipe of the page reads the same file, up to its plot.
        page = (pathlib.Path(__file__).resolve().parents[3] / "docs" / "recording.md").read_text()
        recipe = re.search(r"```python\n(import h5py.*?)plt\.plot", page, re.DOTALL)[1]
        found = {}
        exec(recipe.replace(", matplotlib.pyplot as plt", "").replace('"run.h5"', repr(str(hdf5))), found)
        self.assertEqual(found["beta_b1"].shape, found["t"].shape)
        self.assertTrue(numpy.isfinite(found["error"]).all() and not found["fault"].all())

    def plot(self):
        figures = self.folder / "figures"
        self.assert_ok(system.run("plot", self.whole, "--figures", figures))
        self.assertEqual({path.name for path in figures.iterdir()},
                         {"joints.png", "tracking.png", "timing.png", "tips.png", "states.png"})
        for path in figures.iterdir():
            self.assertGreater(path.stat().st_size, 10_000, path)


class Hardware(Recording):
    def test_commands_are_refused_where_a_hal_is(self):
        """Simulated drives on simulated buses: to all other processes a HAL with hardware."""
        path = system.deployment(self.folder, "drives",
                                 hardware=system.PRESETS / "hardware" / "ark2024-two-buses.yaml",
                                 black_box=f"{{directory: {self.folder / 'box'}, memory_mb: 20}}")
        running = system.System(path)
        self.addCleanup(running.close)
        record = self.record(path, "run.mcap")
        record.await_messages(200)
        record.end()
        before = running.joints()
        answer = system.run("replay", record.file, "-d", path)
        self.assert_refused(answer, "refused: a HAL with hardware", "actuation/command", "--topics")
        self.assert_ok(system.run("replay", record.file, "-d", path, "-t", "arm_*/measured_*"))
        self.assertEqual(running.states(), ["DISABLED", "DISABLED"])
        numpy.testing.assert_allclose(running.joints(), before, atol=1e-3)


if __name__ == "__main__":
    system.main()
