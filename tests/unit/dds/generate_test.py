# SPDX-License-Identifier: Apache-2.0
"""The generator of idl/: its output, changes that alter the wire version, and refused input."""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "idl"))

IDL = """// SPDX-License-Identifier: Apache-2.0
module tandem_msgs {
module msg {
// How warm it is.
typedef octet Warmth;
module Warmth_Constants {
  const octet COLD = 0;
  const octet TOO_HOT = 1;  // "too hot": take it off
};
// Of one kettle.
@final
struct Kettle {
  Warmth warmth[2];   // of body and lid
  @default(3) octet count;  // [0, 8] or 255 = all
  string note;
};
};
};
"""


class Generate(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = pathlib.Path(self.folder.name)

    def run_with(self, idl, what="build"):
        """(exit code, standard error, output folder) of the generator for one file."""
        (self.path / "kettle.idl").write_text(idl)
        out = self.path / "out"
        done = subprocess.run(
            [sys.executable, "-B", ROOT / "idl/generate.py", what, "--idl", self.path / "kettle.idl", "--out", out],
            capture_output=True,
            text=True,
        )
        return done.returncode, done.stderr, out

    def version(self, idl):
        code, error, out = self.run_with(idl)
        self.assertEqual(code, 0, error)
        return re.search(r"kWireVersion = (0x\w+);", (out / "idl/version.h").read_text())[1]

    def test_one_message_everywhere(self):
        code, error, out = self.run_with(IDL)
        self.assertEqual(code, 0, error)
        cpp = (out / "idl/messages.h").read_text()
        for line in ["std::array<std::uint8_t, 2> warmth{};", "std::uint8_t count = 3;", 'kType = "tandem_msgs/msg/Kettle"']:
            self.assertIn(line, cpp)
        self.assertIn('f("count", m.count, Range{8, 255, "count above 8"});', cpp)
        self.assertIn("kTooHot = 1,", (out / "idl/enumerations.h").read_text())
        self.assertIn("f(m.warmth, w.warmth());", (out / "idl/wire_members.h").read_text())
        self.assertIn("export const Warmth = { cold: 0, tooHot: 1 } as const;", (out / "messages.ts").read_text())
        python = {}
        exec((out / "wire.py").read_text(), python)
        self.assertEqual([(w.name, w.label) for w in python["Warmth"]], [("COLD", "cold"), ("TOO_HOT", "too hot")])
        words = json.loads((out / "descriptions.json").read_text())
        self.assertEqual(words["Warmth"][1], {"value": 1, "name": "too hot", "meaning": "take it off"})
        code, error, out = self.run_with(IDL, "msg")
        twin = (out / "tandem_msgs/Kettle.msg").read_text()
        self.assertIn("uint8 WARMTH_TOO_HOT=1", twin)
        self.assertIn("uint8[2] warmth  # Warmth: of body and lid", twin)

    def test_which_changes_change_the_wire_version(self):
        before = self.version(IDL)
        for same in [("of body and lid", "of both"), ("take it off", "wait"), ("string note;", "string note;  // of the cook")]:
            self.assertEqual(self.version(IDL.replace(*same)), before, same)
        for other in [
            ("octet count", "unsigned short count"),
            ("warmth[2]", "warmth[3]"),
            ("string note;", "string remark;"),
            ("string note;", "string note;\n  octet more;"),
            ("TOO_HOT = 1", "TOO_HOT = 2"),
            ("TOO_HOT", "HOT"),
        ]:
            self.assertNotEqual(self.version(IDL.replace(*other)), before, other)

    def test_what_is_refused(self):
        for line, change, words in [
            (11, ("@final\n", ""), "every struct is @final"),
            (13, ("Warmth warmth", "Heat warmth"), "'Heat' is neither basic nor defined above"),
            (15, ("string note;", "string Note;"), "no field name"),
            (15, ("string note;", "string note"), "not understood"),
            (8, ("TOO_HOT = 1", "TOO_HOT = 0"), "for the second time"),
            (8, ("TOO_HOT = 1", "TooHot = 1"), "upper case"),
            (6, ("Warmth_Constants", "Cold_Constants"), "no typedef Cold"),
            (13, ("Warmth warmth[2]", "other_msgs::msg::Pot warmth"), "other_msgs::msg::Pot is in none of the files"),
        ]:
            with self.subTest(change=change):
                code, error, _ = self.run_with(IDL.replace(*change))
                self.assertEqual(code, 2)
                self.assertIn(f"kettle.idl:{line}:", error)
                self.assertIn(words, error)


if __name__ == "__main__":
    unittest.main()
