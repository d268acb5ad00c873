# SPDX-License-Identifier: Apache-2.0
"""tandem new and the completion of command lines."""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402


def words(*line):
    return subprocess.run([system.executable(), "__complete", *line], capture_output=True, text=True, timeout=60, check=True).stdout.split()


class New(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def new(self, kind, name, *options):
        path = self.folder / f"{name}.yaml"
        answer = system.run("new", kind, name, "-o", path, *options)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        return path, answer

    def test_every_kind_is_valid_as_it_is_written(self):
        for arms in ("1", "2"):
            for kind in ("robot", "trajectory", "experiment", "deployment"):
                with self.subTest(kind=kind, arms=arms):
                    path, answer = self.new(kind, f"my-{kind}-{arms}", "--arms", arms)
                    self.assertEqual(system.run("validate", path).returncode, 0)
                    self.assertIn(f"{kind} my-{kind}-{arms}", answer.stdout)
                    self.assertIn("tandem validate", answer.stdout)
                    text = path.read_text()
                    self.assertNotIn("../", text, "files beside the preset")
                    if kind != "robot":
                        self.assertIn("# Further keys:", text)

    def test_names_that_look_like_other_values(self):
        for name in ("123", "null", "1e5"):
            path, answer = self.new("robot", name)
            self.assertIn(f"robot {name}:", answer.stdout)
            self.assertEqual(system.run("validate", path).returncode, 0)

    def test_comments_are_the_keys_that_are_left_and_can_be_used(self):
        path, _ = self.new("trajectory", "mine")
        line = next(line for line in path.read_text().splitlines() if line.startswith("# point_duration_s:"))
        self.assertIn("default: 10 s", line)
        path.write_text(path.read_text().replace(line, "point_duration_s: 3"))
        self.assertEqual(system.run("validate", path).returncode, 0)

    def test_from_robot_to_experiment(self):
        robot, _ = self.new("robot", "lab", "--arms", "1")
        experiment, _ = self.new("experiment", "first", "--arms", "1", "--robot", robot)
        answer = system.run("experiment", experiment, "--offline", "--only", "lissajous-home-nspqp")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertIn("100/100", answer.stdout)

    def test_refusals(self):
        path, _ = self.new("robot", "lab")
        before = path.read_text()
        for options, text in ((("robot", "x", "-o", path), "found a file of this name"), (("robto", "x"), "robot,trajectory"),
                              (("trajectory", "x", "--from", "crcle", "-o", "-"), "circle"), (("robot",), "name is required"),
                              (("robot", "x: y"), "found 'x: y', expected letters"), (("robot", "../x"), "expected letters")):
            with self.subTest(options=options):
                answer = system.run("new", *options)
                self.assertEqual(answer.returncode, 2, answer.stdout)
                self.assertIn(text, answer.stdout + answer.stderr)
        self.assertEqual(path.read_text(), before)

    def test_completion(self):
        self.assertEqual(words("exp"), ["experiment", "export"])
        self.assertEqual(words("plan", "che"), ["check"])
        self.assertIn("circle-one-arm", words("plan", "check", ""))
        self.assertEqual(words("up", "lap"), ["laptop", "laptop-1khz"])
        self.assertEqual(words("experiment", "-d", "lockstep-o"), ["lockstep-one-arm"])
        self.assertEqual(words("experiment", "--gate", ""), ["off", "on"])
        self.assertEqual(words("experiment", "table3", "--offl"), ["--offline"])
        self.assertEqual(words("fk", "--robot", "timc"), ["timc2024"])
        self.assertEqual(words("nonsense", "--x", ""), [])
        self.assertEqual(words("experiment", "--csv", ""), [], "a file name: the shell's own completion")

    def test_script_of_the_shell(self):
        script = system.run("completion").stdout
        asked = ("COMP_WORDS=(tandem up lap); COMP_CWORD=2; _tandem; printf '%s\\n' \"${COMPREPLY[@]}\"")
        path = str(pathlib.Path(system.executable()).parent)
        found = subprocess.run(["bash", "-c", f'PATH="{path}:$PATH"\n{script}\n{asked}'], capture_output=True, text=True, timeout=60,
                               check=True)
        self.assertEqual(found.stdout.split(), ["laptop", "laptop-1khz"], found.stderr)

    def test_help_lists_the_commands(self):
        text = system.run("--help").stdout
        self.assertTrue(re.search(r"^  new .*deployment file$", text, re.M) and re.search(r"^  completion ", text, re.M), text)


if __name__ == "__main__":
    system.main()
