# SPDX-License-Identifier: Apache-2.0
"""The page is the one that the list gives, and a hazard whose control is not shown is noticed."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(HERE))
import trace as hazards  # noqa: E402  (the one beside this file)


def junit(**cases):
    """What ctest writes: name -> run, fail, notrun."""
    body = "".join(f'<testcase name="{name}" status="{status}">{"<failure/>" if status == "fail" else ""}</testcase>'
                   for name, status in cases.items())
    return f"<testsuite>{body}</testsuite>"


class Trace(unittest.TestCase):
    def judge(self, tests, **cases):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "results.xml"
            path.write_text(junit(**cases))
            return hazards.judge([{"id": "H1", "hazard": "it burns", "tests": tests}], hazards.outcomes([path]))

    def test_passing_tests_are_enough(self):
        self.assertEqual(self.judge(["a", "b*"], a="run", b1="run", b2="run", c="fail"), [])

    def test_what_failed_did_not_run_or_is_not_there_is_named(self):
        self.assertEqual(self.judge(["a"], a="fail"), ["H1 (it burns): a failed"])
        self.assertEqual(self.judge(["b*"], b1="run", b2="notrun"), ["H1 (it burns): b2 skipped"])
        self.assertEqual(self.judge(["d"], a="run"), ["H1 (it burns): no test is called d"])

    def test_docs_match_the_hazard_list(self):
        self.assertEqual((ROOT / "docs/hazards.md").read_text(), hazards.page(hazards.load()))

    def test_a_list_with_a_hole_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "hazards.yaml"
            path.write_text((HERE / "hazards.yaml").read_text().replace("severity: 4", "severity: 9", 1))
            with self.assertRaisesRegex(SystemExit, "H01: severity: found 9, expected 1 to 5"):
                hazards.load(path)

    def test_the_program_ends_with_1_where_a_control_is_not_shown(self):
        with tempfile.NamedTemporaryFile("w", suffix=".xml") as results:
            results.write(junit(table3="run"))
            results.flush()
            answer = subprocess.run([sys.executable, HERE / "trace.py", "--results", results.name], capture_output=True, text=True)
        self.assertEqual(answer.returncode, 1)
        self.assertIn("H02 (The robot continues to move after a stop request): no test is called fault_default_budgets", answer.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
