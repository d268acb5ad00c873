# SPDX-License-Identifier: Apache-2.0
"""Situations of a new user (situations.yaml): each command is refused with a message that names the way out, and nothing moves."""
import pathlib
import shlex
import socket
import sys

import yaml

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

TABLE = yaml.safe_load(pathlib.Path(__file__).with_name("situations.yaml").read_text())


class Situations(system.SystemTest):
    def refused(self, case):
        words = [word.format(**self.names) for word in shlex.split(case["command"])]
        answer = system.run(*words, timeout=60)
        self.assertEqual(answer.returncode, 1, answer.stdout + answer.stderr)
        for text in case["says"]:
            self.assertIn(text, answer.stdout + answer.stderr)

    def test_all(self):
        self.assertGreaterEqual(sum(map(len, TABLE.values())), 10)
        path = system.deployment(self.folder, "laptop", **system.real_time())
        other = self.folder / "other.yaml"
        robot = system.PRESETS / "robots" / "ark2024-as-printed.yaml"
        other.write_text("\n".join(f"robot: {robot}" if line.startswith("robot:") else line for line in path.read_text().splitlines()))
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            self.all_refused(path, other, taken.getsockname()[1])

    def all_refused(self, path, other, port):
        (self.folder / "console").mkdir()
        others = ["sim", "control", "planning", "recorder"]
        console = system.deployment(self.folder / "console", "laptop", without=others, console=f"{{port: {port}}}")
        console.write_text(console.read_text().replace(", essential: false", ""))
        self.trajectory("third", [5, 0, 0], tasks="[{tip: c}]")
        self.trajectory("hasty", [0, 40, 0], points=4, following="timed", speed_mm_per_s=400, acceleration_mm_per_s2=10000)
        self.names = {"D": path, "OTHER": other, "CONSOLE": console, "FOLDER": self.folder,
                      "RECORDING": system.SOURCE / "tests" / "archive" / "5e7986a" / "recordings" / "lock-step.mcap"}
        (self.folder / "a-file").touch()
        for case in TABLE["without_a_system"]:
            with self.subTest(command=case["command"]):
                self.refused(case)
        with system.System(path) as robot:
            for case in TABLE["with_a_system"]:
                with self.subTest(command=case["command"]):
                    self.assert_ok(robot.robot("disable"))
                    for command in case.get("before", []):
                        self.assert_ok(system.run(*[word.format(**self.names) for word in shlex.split(command)]))
                    before = robot.joints()
                    self.refused(case)
                    if "missed" not in case["says"]:
                        self.assertEqual(robot.joints(), before, "an arm moved")


if __name__ == "__main__":
    system.main()
