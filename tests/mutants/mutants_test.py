# SPDX-License-Identifier: Apache-2.0
"""Each mutant has its place in the code and a test that kills it; what is wrong with the list or the page is named."""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import yaml

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(HERE))
import mutants  # noqa: E402

ROOMS = ("safety/", "hal/", "operation/", "services/dds/", "services/security/", "control/")


class Mutants(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_page_is_that_of_the_list(self):
        listed = mutants.load()
        self.assertGreaterEqual(len(listed), 100)
        for room in ROOMS:
            self.assertTrue(any(mutant["file"].startswith(room) for mutant in listed), room)
        mutants.check(ROOT / "docs/mutants.md")

    def test_what_is_wrong_with_the_list_is_named(self):
        good = {"name": "x", "hazard": "H08", "file": "safety/gate.cpp", "of": "limitPosition(last_setpoint, setpoint, report);", "to": ";"}
        for change, text in (({"of": "gone"}, "x: of: found 0 times in safety/gate.cpp, expected once: gone"),
                             ({"of": "double"}, "times in safety/gate.cpp, expected once"),
                             ({"hazard": "H99"}, "x: hazard: found H99"), ({"extra": 1}, "x: found the keys ['extra'")):
            path = self.folder / "list.yaml"
            path.write_text(yaml.safe_dump({"mutants": [good | change]}))
            with self.assertRaises(SystemExit) as refused:
                mutants.load(path)
            self.assertIn(text, str(refused.exception))

    def test_a_build_without_a_test_of_the_hazard_is_named(self):
        hazard = {"id": "H99", "tests": ["Gone.*"]}
        with self.assertRaises(SystemExit) as refused:
            mutants.candidates(hazard, {"Here.Test": ["unit"]}, False)
        self.assertIn("no test of H99: found none of Gone.*", str(refused.exception))

    def test_a_mutant_without_a_test_or_with_one_of_another_hazard_is_named(self):
        listed, page = mutants.load(), self.folder / "page.md"
        killed = mutants.written(ROOT / "docs/mutants.md")
        first = next(mutant["name"] for mutant in listed if mutant["name"] in killed)
        for test, text in ((None, "killed by no test"), ("Other.Test", "Other.Test is not a test of ")):
            page.write_text(mutants.page([mutant | {"alive": ""} for mutant in listed], killed | {first: test}))
            with self.assertRaises(SystemExit) as refused:
                mutants.check(page)
            self.assertIn(f"{first}: {text}", str(refused.exception))

    def test_one_program_has_all_mutants_of_a_place(self):
        source = self.folder / "some.cpp"
        condition = [{"number": 1, "of": "if (x > 3)", "to": "if (x > 30)"}, {"number": 2, "of": "if (x > 3)", "to": "if (true)"}]
        statement = [{"number": 3, "of": "x = -x;", "to": ";"}]
        (self.folder / "tests/mutants").mkdir(parents=True)
        (self.folder / mutants.HEADER).write_text(mutants.SELECTED)
        source.write_text(f'#include "{mutants.HEADER}"\nint main(int x, char**) {{\n'
                          f"  {mutants.choice(condition)}\n    return 1;\n  else\n    {mutants.choice(statement)}\n"
                          "  return x == -1 ? 0 : 2;\n}\n")
        subprocess.run([shutil.which("c++"), "-std=c++20", f"-I{self.folder}", source, "-o", self.folder / "some"], check=True)
        codes = [subprocess.run([self.folder / "some"], env={"TANDEM_MUTANT": str(number)}).returncode for number in range(4)]
        self.assertEqual(codes, [0, 0, 1, 2])


if __name__ == "__main__":
    unittest.main()
