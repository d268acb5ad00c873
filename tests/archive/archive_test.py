# SPDX-License-Identifier: Apache-2.0
"""What older commits wrote still opens: a lab's archive is its work. Each folder beside this file is named after the commit whose
programs wrote it (README.md)."""
import csv
import hashlib
import json
import pathlib
import re
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "integration" / "harness")]
import keys  # noqa: E402
import system  # noqa: E402

OLD = HERE / "5e7986a"
RECORDINGS = sorted((OLD / "recordings").glob("*.mcap"))
# Files that are refused today: the sentence says what changed, since when, and what to write instead.
REFUSED = {"hardware/bench-fast-homing.yaml": r"homing\.fast_mm_per_s: found 2\.5 times `velocity` of the drive, expected at "
           r"most `velocity`: since 22 November 2026 homing runs go no faster than the axis\. Lower this speed, or raise"}
# Bounds that are narrower since: drives took what lay below for one millisecond. The refusal names key, found and expected.
NARROWED = {(f"hardware.{kind}.drive.following_time_{unit}", "minimum")
            for kind in ("translations", "rotations") for unit in ("s", "ms")}
# Defaults that are others since: clocks need not agree any more; the scale of hqp is that of its linear programme. A file that says
# nothing is safer, or exact, with the new one.
REPLACED = {("deployment.teleoperation.crtk.stamps", "default"), ("cooperative.control.hqp_zeta", "default"),
            ("robot.control.hqp_zeta", "default")}
# Members that have other names since; their values are kept.
RENAMED = {"placements": "joint_resets", "lease_holder": "lease_owner"}
# What has joined messages since, by type.
ADDED = {"ActuationState": "fingerprint, recovery, lost, homed, holds", "ActuationCommand": "fingerprint, without, commander, may_home",
         "PlanningReference": "fingerprint", "PlanningRequest": "fingerprint", "SimRequest": "fingerprint",
         "HalRequest": "fingerprint, joint, position",
         "ControlStatus": "fingerprint, recovery, idle, idle_left, paused_by, state_success, reference_success",
         "ControlRequest": "fingerprint, control_session, answers_control",
         "HalStatus": "fingerprint, snap_energy, snap_distance, emergency_stop, command_success, axis_lost, axis_limit_switch, axis_last, "
                      "axis_last_position, axis_jump_tolerance, hardware_count[16..23], "
                      "hardware_arm[16..23], "
                      "hardware_joint[16..23], bus_success", "Shape": "loaded, wrench"}


def added(topic_type):
    return ADDED.get(topic_type.removeprefix("tandem_msgs/msg/"), "")


def rows(file):
    """Columns of a CSV file, as texts."""
    with open(file, newline="", encoding="utf-8") as stream:
        table = list(csv.reader(stream))
    return {name: [row[i] for row in table[1:]] for i, name in enumerate(table[0])}


class Files(system.SystemTest):
    def test_every_yaml_file_is_valid_or_says_what_changed(self):
        files = sorted((OLD / "lab").rglob("*.yaml"))
        self.assertEqual({file.parent.name for file in files},
                         {"robots", "cooperative", "hardware", "deployments", "experiments", "trajectories", "paths"})
        for file in files:
            answer = system.run("validate", file)
            refusal = REFUSED.get(str(file.relative_to(OLD / "lab")))
            self.assertEqual(answer.returncode, 2 if refusal else 0, f"{file}: {answer.stdout}{answer.stderr}")
            self.assertRegex(answer.stderr, refusal or "^$")

    @staticmethod
    def permits(holds, words):
        """Whether a key takes all these words: by its list, or by a pattern that replaced it."""
        return all(word in holds.get("enum", []) or re.search(holds.get("pattern", "^$"), str(word)) for word in words)

    @staticmethod
    def alternatives(pattern):
        """Those of a pattern ^(one|other)$; any other pattern is one."""
        return set(pattern[2:-2].split("|")) if pattern.startswith("^(") and pattern.endswith(")$") else {pattern}

    def test_every_key_still_has_its_name_its_default_and_its_values(self):
        today = keys.keys(system.SOURCE / "config" / "presets" / "schemas")
        changed = set()
        for line in (OLD / "keys.txt").read_text().splitlines():
            name, then = line.split(" ", 1)
            then, now = json.loads(then), today.get(name)
            self.assertIsNotNone(now, f"{name} is gone: its error has to say what to write instead (and REFUSED here)")
            for word, what in then.items():
                kept = (self.permits(now, what) if word == "enum"
                        else self.alternatives(what) <= self.alternatives(now.get(word, "")) if word == "pattern"
                        else now.get(word, what) <= what if word.lower().endswith("minimum") or word.startswith("min")
                        else now.get(word, what) >= what if word.startswith("max") else now.get(word) == what)
                if not kept and (name, word) in NARROWED | REPLACED:
                    changed.add((name, word))
                    continue
                self.assertTrue(kept, f"{name}: {word} was {what}, and is {now.get(word)}")
        self.assertEqual(changed, NARROWED | REPLACED)


class Readers(system.SystemTest):
    def test_info_says_what_changed(self):
        for file in RECORDINGS:
            answer = self.assert_ok(system.run("info", file, "--json", "--check"))
            info = json.loads(answer.stdout)
            self.assertEqual((info["finished"], info["damage"], info["metadata"]["tandem"]["version"]), (True, [], "0.1.0"))
            for name, topic in info["topics"].items():
                wanted = added(topic["type"])
                self.assertEqual(topic["changes"], f"members missing in the recording: {wanted}: set to 0 or empty" if wanted else "",
                                 f"{file.name}: {name}")

    def test_exported_numbers_are_those_of_the_old_program(self):
        """export.json has the digest of each table that the old program made of the same file."""
        digests = json.loads((OLD / "export.json").read_text())
        self.assertEqual(set(digests), {file.name for file in RECORDINGS})
        for file in RECORDINGS:
            folder = self.folder / file.stem
            answer = self.assert_ok(system.run("export", file, "--indices", "--csv", folder, "--mat", f"{folder}.mat", "--hdf5",
                                               f"{folder}.h5"))
            self.assertEqual(answer.stderr, "")
            found = {table.name: hashlib.sha256(table.read_bytes()).hexdigest() for table in folder.iterdir()}
            self.assertEqual(found, digests[file.name], file.name)

    def test_columns_by_the_names_of_the_robot(self):
        """The values of the columns by index, without those of slots that the robot does not have."""
        tubes = [f"{joint}_{tube}_{unit}" for joint, unit in (("beta", "m"), ("alpha", "rad")) for tube in (1, 2, 3)]
        for name, joints in (("lock-step", tubes), ("catheters-lock-step", ["insertion_m", "roll_rad", "bend_rad"])):
            file, named, indexed = OLD / "recordings" / f"{name}.mcap", self.folder / name, self.folder / f"{name}-indices"
            self.assertEqual(self.assert_ok(system.run("export", file, "--csv", named)).stderr, "")
            self.assert_ok(system.run("export", file, "--indices", "--csv", indexed))
            found, before = rows(named / "actuation_state.csv"), rows(indexed / "actuation_state.csv")
            self.assertEqual([column for column in found if column.startswith("position")],
                             [f"position.{arm}.{joint}" for arm in ("arm_a", "arm_b") for joint in joints])
            for k, arm in enumerate(("arm_a", "arm_b")):
                for j, joint in enumerate(joints):
                    self.assertEqual(found[f"position.{arm}.{joint}"], before[f"position[{8 * k + j}]"], (name, arm, joint))
                self.assertEqual(found[f"operating_state.{arm}"], before[f"operating_state[{k}]"])
            status = rows(named / "control_status.csv")
            self.assertEqual([column for column in status if column.startswith("task_error")],
                             [f"task_error.task_{i + 1}_m" for i in range(max(map(int, status["task_count"])))])

    def test_figures(self):
        for file in RECORDINGS:
            self.assert_ok(system.run("plot", file, "--figures", self.folder / file.stem))
            self.assertTrue(list((self.folder / file.stem).glob("*.png")), file.name)

    def test_python(self):
        sys.path.insert(0, str(pathlib.Path(system.executable()).parents[1] / "python"))
        import numpy  # pylint: disable=import-outside-toplevel
        import tandem  # pylint: disable=import-error,import-outside-toplevel
        for file in RECORDINGS:
            recording = tandem.Recording(str(file))
            self.assertEqual((recording.finished, recording.damage), (True, []))
            self.assert_ok(system.run("export", file, "--indices", "--csv", self.folder / file.stem))
            for topic in recording.topics:
                table = recording[topic]
                name = topic.removeprefix("/").removeprefix("arch/").replace("/", "_")
                exported = rows(self.folder / file.stem / f"{name}.csv")
                self.assertEqual([int(n) for n in exported["log_time_ns"]], list(table["log_time_ns"]), topic)
                for column, values in table.items():
                    if isinstance(values, numpy.ndarray) and values.ndim == 1 and column in exported:
                        numpy.testing.assert_array_equal(values, numpy.array(exported[column], values.dtype), topic)


class Replay(system.SystemTest):
    def test_a_lock_step_run_is_simulated_again(self):
        for name in ("lock-step.mcap", "catheters-lock-step.mcap"):
            answer = system.run("replay", OLD / "recordings" / name, "--simulate")
            self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
            self.assertRegex(answer.stdout, r"[1-9]\d+ states simulated again, 0 differ; largest difference .* 0 m or rad")
            self.assertIn("actuation/state: members missing in the recording: fingerprint, recovery, lost, homed, holds: set to 0 or empty",
                          answer.stderr)

    def test_onto_the_wire_as_the_messages_of_today(self):
        """Somebody of today records what is replayed: the same numbers, 0 where there were none, said once a topic."""
        path = system.deployment(self.folder, "laptop")
        for file in (OLD / "recordings" / "black-box.mcap", OLD / "recordings" / "drives.mcap"):
            again = self.folder / file.name
            record = subprocess.Popen([system.executable(), "record", str(path), "-o", str(again)], stdout=subprocess.PIPE,
                                      stderr=subprocess.PIPE, text=True)
            self.addCleanup(system.reap, record)
            system.until(lambda file=again: file.exists() and file.stat().st_size > 0, 20, "a recording has begun")
            answer = self.assert_ok(system.run("replay", file, "-d", path))
            record.terminate()
            self.assertEqual(record.wait(20), 0, record.stderr.read())
            folders = [self.folder / f"{file.stem}-{which}" for which in ("then", "now")]
            for source, folder in zip((file, again), folders):
                self.assertEqual(self.assert_ok(system.run("export", source, "--indices", "--csv", folder)).stderr, "")
            topics = json.loads(system.run("info", file, "--json").stdout)["topics"]
            said = "".join(f"{name}: members missing in the recording: {added(topic['type'])}: set to 0 or empty\n"
                           for name, topic in topics.items() if added(topic["type"]))
            self.assertEqual(sorted(answer.stderr.splitlines()), sorted(said.splitlines()))
            for name in ("actuation/state", "actuation/command", "control/status", "hal/status"):
                then, now = (rows(folder / f"{name.replace('/', '_')}.csv") for folder in folders)
                then = {RENAMED.get(column, column): values for column, values in then.items()}
                fresh = [column for column in now if column not in then]
                self.assertEqual({column.split("[")[0] for column in fresh},
                                 {word.split("[")[0] for word in added(topics[name]["type"]).split(", ")})
                self.assertEqual({float(value) for column in fresh for value in now[column]}, {0.0})
                # A busy machine may lose samples of the streams: those that came are in order and the same.
                columns = [column for column in then if column not in ("time_s", "log_time_ns", "publish_time_ns",
                                                                       "sequence_of_writer")]
                before = list(zip(*(then[column] for column in columns)))
                after = list(zip(*(now[column] for column in columns)))
                self.assertGreater(len(after), len(before) // 2, name)
                at = 0
                for row in after:
                    at = before.index(row, at) + 1


class Tables(system.SystemTest):
    def test_csv_folders_are_drawn_and_merged(self):
        self.assert_ok(system.run("montecarlo", "merge", *sorted((OLD / "csv").glob("shard-*.csv")), "--csv", self.folder / "all.csv"))
        merged, old = rows(self.folder / "all.csv"), rows(OLD / "csv" / "all.csv")
        self.assertEqual({name: merged[name] for name in old}, old)
        for name in merged.keys() - old.keys():  # added since: a source of error, or the reason of a refusal
            self.assertEqual(set(merged[name]), {"" if name in ("reason", "further") else "0"}, name)
        subprocess.run(["/usr/bin/python3", system.SOURCE / "experiments" / "figures.py", OLD / "csv" / "experiment",
                        self.folder / "figures"], check=True, capture_output=True)
        self.assertTrue(list((self.folder / "figures").glob("*.png")))


if __name__ == "__main__":
    system.main()
