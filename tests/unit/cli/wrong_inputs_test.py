# SPDX-License-Identifier: Apache-2.0
"""What new users get wrong (wrong_inputs.yaml): each wrong file and command line is refused with a message that names the cure."""
import os
import pathlib
import shlex
import subprocess
import sys
import tempfile
import unittest

import yaml

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402

TABLE = yaml.safe_load(pathlib.Path(__file__).with_name("wrong_inputs.yaml").read_text())


class WrongInputs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tandem-wrong-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def expect(self, arguments, says, code=2, stdin="", **environment):
        """The command ends with `code`, says each of the texts, and reports no other failure."""
        answer = subprocess.run([system.executable(), *arguments], cwd=self.folder, input=stdin, text=True, capture_output=True, timeout=60,
                                env={**os.environ, **environment})
        printed = answer.stdout + answer.stderr
        self.assertEqual(answer.returncode, code, printed)
        for text in says:
            self.assertIn(text, printed)
        self.assertLess(max(map(len, answer.stderr.splitlines()), default=0), 400, "a line that nobody reads")

    def write(self, case):
        text = case.get("text")
        if text is None:
            valid = (system.PRESETS / f"{case['of']}.yaml").read_text()
            self.assertIn(case["from"], valid, "the preset has no such text")
            text = valid.replace(case["from"], case["to"]).replace("../robots/", f"{system.PRESETS}/robots/")
        (self.folder / "wrong.yaml").write_text(text)

    def test_files(self):
        self.assertGreaterEqual(len(TABLE["files"]), 36)
        for case in TABLE["files"]:
            with self.subTest(**case):
                self.write(case)
                self.expect(["validate", "wrong.yaml"], ["wrong.yaml:", *case["says"]])

    def test_implausible_numbers(self):
        for case in TABLE["implausible"]:
            with self.subTest(**case):
                self.write(case)
                self.expect(["validate", "wrong.yaml"], ["warning: wrong.yaml:", *case["says"]], code=0)

    def test_presets_have_no_implausible_numbers(self):
        answer = system.run("validate", *system.PRESETS.glob("*/*.yaml"))
        self.assertNotIn("usually", answer.stdout)

    def test_command_lines(self):
        self.assertGreaterEqual(len(TABLE["commands"]), 20)
        for case in TABLE["commands"]:
            with self.subTest(**case):
                self.expect(shlex.split(case["command"]), case["says"], case.get("code", 2), case.get("stdin", ""))


if __name__ == "__main__":
    system.main()
