# SPDX-License-Identifier: Apache-2.0
"""deploy/renew.py detects a changed number of the real pages, and names file, line, command, found and expected; with small pages of its
own: what it writes, and how it reports entries that do not fit."""

import contextlib
import io
import pathlib
import shutil
import sys
import tempfile
import textwrap
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "deploy"))

import renew  # noqa: E402

BINARIES = sys.argv.pop() if len(sys.argv) > 1 and pathlib.Path(sys.argv[-1]).is_dir() else str(ROOT / "build/release/bin")
PAGE = """\
# Page

The arm takes 12 iterations and
leaves 0.250 mm of error. Nothing else.

<!-- table: made by deploy/renew.py -->
| method | error |
|---|---|
| a | 0.25 |
| b | 1.50 |
<!-- end -->

<!-- text: made by deploy/renew.py -->
```
done
```
<!-- end -->
"""
DATA = """\
commands:
  run: {run: "echo '{\\"n\\": 12, \\"rows\\": [{\\"m\\": \\"a\\", \\"e\\": 0.25}, {\\"m\\": \\"b\\", \\"e\\": 1.5}]}'"}
  text: {run: "test -f $PRESETS/robots/ark2024.yaml && echo done"}
  hours: {run: "exit 3", long: true}
texts: {error: "{x.e:.2f}"}
blocks:
  - {file: docs/page.md, name: text, printed: text}
  - {file: docs/page.md, name: table, head: "| method | error |\\n|---|---|", each: run.rows, row: "| {r.m} | {error(r)} |"}
sentences:
  - {file: docs/page.md, text: "takes {run.n} iterations and leaves {row(run.rows, m='a').e:.3f} mm of error"}
  - {file: docs/page.md, text: "never {hours} run"}
"""


def called(*arguments):
    """Exit code, and the text on both streams."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        code = renew.main([str(argument) for argument in arguments])
    return code, out.getvalue()


class Pages(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        (self.root / "docs").mkdir()
        (self.root / "deploy").mkdir()
        self.page = self.root / "docs/page.md"
        self.write(PAGE, DATA)

    def write(self, page, data):
        self.page.write_text(page, encoding="utf-8")
        (self.root / "deploy/numbers.yaml").write_text(textwrap.dedent(data), encoding="utf-8")

    def check(self, *more):
        return called("--check", "--root", self.root, "--bin", BINARIES, *more)

    def test_intervals_are_those_that_newcombe_printed(self):
        """Newcombe, Two-sided confidence intervals for the single proportion, Statistics in Medicine 17, 1998, table I, method 3."""
        for count, total, *ends in ((81, 263, 25.53, 36.62), (15, 148, 6.24, 16.05), (0, 20, 0.0, 16.11), (1, 29, 0.61, 17.18)):
            for found, printed in zip(renew.interval(count, total).rstrip(" %").split(" to "), ends):
                self.assertAlmostEqual(float(found), printed, delta=0.056)

    def test_numbers_that_agree(self):
        code, text = self.check()
        self.assertEqual(code, 0, text)
        self.assertIn("3 blocks and sentences, 0 numbers or lines differ, 2 commands", text)

    def test_each_changed_number_is_named_and_written(self):
        for was, wrong, message in (
                ("takes 12", "takes 13", 'docs/page.md:3: found "13", expected "12"'),
                ("0.250", "0.2501", 'docs/page.md:4: found "0.2501", expected "0.250"'),
                ("| b | 1.50 |", "| b | 1.51 |", 'docs/page.md:10: found "| b | 1.51 |", expected "| b | 1.50 |"'),
                ("| b | 1.50 |\n", "", 'docs/page.md:7: found "| method'),
                ("\ndone", "\ndome", 'docs/page.md:15: found "dome", expected "done"')):
            with self.subTest(wrong=wrong):
                self.write(PAGE.replace(was, wrong), DATA)
                code, text = self.check()
                self.assertEqual(code, 1, text)
                self.assertIn(message, text)
                self.assertRegex(text, r"\((echo|test)")  # the command
                self.assertIn(", 1 numbers or lines differ", text)
                self.assertEqual(called("--root", self.root, "--bin", BINARIES)[0], 0)
                self.assertEqual(self.page.read_text(encoding="utf-8"), PAGE)

    def test_long_commands_run_on_request(self):
        self.write(PAGE.replace("Nothing else.", "It will never 5 run."), DATA)
        code, text = self.check("--all")
        self.assertEqual(code, 2)
        self.assertIn("command 'hours' (exit 3): exit code 3, expected 0", text)

    def test_entries_that_do_not_fit(self):
        for was, wrong, message in (
                ("takes {run.n}", "needs {run.n}", 'docs/page.md contains this sentence 0 times, expected once: "needs'),
                ("takes {run.n}", "{run.n}", "the sentence starts or ends with a number"),
                ("m='a'", "m='c'", "0 objects have {'m': 'c'}, expected one"),
                ("takes {run.n}", "takes {run.k}", "{run.k}: KeyError: 'k'"),
                ("takes {run.n}", "takes {ran.n}", "{ran.n}: NameError"),
                ("{run.n}", "{run.n:.1x}", "{run.n:.1x}: "),
                ("{run.n}", "{run.}", "sentences[0]: SyntaxError"),
                ("name: table, head", "name: tabel, head", "contains '<!-- tabel: made by deploy/renew.py -->' 0 times"),
                ("row: ", "rows: ", "unknown key rows")):
            with self.subTest(wrong=wrong):
                self.write(PAGE, DATA.replace(was, wrong, 1))
                code, text = self.check()
                self.assertEqual(code, 2, text)
                self.assertIn(message, text)


class RealPages(unittest.TestCase):
    def test_a_changed_digit(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "deploy").mkdir()
            shutil.copy(ROOT / renew.DATA, root / renew.DATA)
            page = (ROOT / "README.md").read_text(encoding="utf-8")
            line = next(line for line in page.splitlines() if line.startswith("| lissajous | nspwln |"))
            wrong = line.replace("443", "444")
            self.assertNotEqual(line, wrong)
            (root / "README.md").write_text(page.replace(line, wrong), encoding="utf-8")
            code, text = called("--check", "--root", root, "--bin", BINARIES, "--only", "README.md")
            self.assertEqual(code, 1, text)
            place = page.splitlines().index(line) + 1
            self.assertIn(f'README.md:{place}: found "{wrong}", expected "{line}" (tandem experiment table3 --offline', text)


if __name__ == "__main__":
    unittest.main()
