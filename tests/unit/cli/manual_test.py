# SPDX-License-Identifier: Apache-2.0
"""The manual pages of the Debian package, read by Debian's man."""
import os
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402

SCRIPT = pathlib.Path(__file__).resolve().parents[3] / "deploy" / "packaging" / "manual.sh"


class Manual(system.SystemTest):
    def test_each_command_and_program_has_a_page(self):
        programs = pathlib.Path(system.executable()).parent
        subprocess.run([SCRIPT, programs, "1.2.3", self.folder], check=True)
        commands = ["tandem"] + ["tandem-" + line.replace(" ", "-") for line in system.run("__commands").stdout.splitlines()]
        self.assertEqual(sorted(path.name for path in (self.folder / "man1").iterdir()), sorted(f"{name}.1" for name in commands))
        self.assertEqual(sorted(path.stem for path in (self.folder / "man8").iterdir()),
                         sorted(path.name for path in programs.glob("tandem-*")))
        for page in sorted(self.folder.glob("man?/*")):
            answer = subprocess.run(["man", "--warnings", "-l", page], capture_output=True, text=True, check=True,
                                    env={**os.environ, "MANWIDTH": "200", "LC_ALL": "C.UTF-8"})
            self.assertEqual(answer.stderr, "", page)
            # The name that `man` and `apropos` find it by.
            found = subprocess.run(["lexgrog", page], capture_output=True, text=True, check=True).stdout
            self.assertIn(f'"{page.stem} - ', found)
            self.assertIn("1.2.3", answer.stdout)
        run = subprocess.run(["man", "-l", self.folder / "man1" / "tandem-robot-run.1"], capture_output=True, text=True,
                             check=True, env={**os.environ, "MANWIDTH": "200", "LC_ALL": "C.UTF-8"}).stdout
        self.assertIn("TANDEM-ROBOT-RUN(1)", run)
        lines = [line.strip() for line in run.splitlines()]
        self.assertIn("tandem robot run circle", lines[lines.index("EXAMPLES"):], "an example has a line of its own")


if __name__ == "__main__":
    system.main()
