# SPDX-License-Identifier: Apache-2.0
"""tandem validate, schema, topics, and the command line itself."""
import json
import pathlib
import re
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402

ROBOT = (system.PRESETS / "robots" / "ark2024.yaml").read_text()


def subcommands(*words):
    """All subcommands of `tandem WORDS` according to its help, each as a list of words."""
    text = system.run(*words, "--help").stdout
    section = re.search(r"^Subcommands:\n((?:  .*\n)+)", text, re.M)
    names = re.findall(r"^  (\S+)", section.group(1), re.M) if section else []
    return [found for name in names for found in ([*words, name], *subcommands(*words, name))]


def swapped(text):
    """The robot file with its first two tubes exchanged."""
    found = re.search(r"(      - \{outer_diameter_mm: 1\.524.*?\}\n)(      - \{outer_diameter_mm: 1\.8,.*?\}\n)",
                      text, re.S)
    return text.replace(found.group(0), found.group(2) + found.group(1), 1)


class Validate(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        self.addCleanup(folder.cleanup)
        self.file = pathlib.Path(folder.name) / "robot.yaml"

    def refused(self, text):
        """Line, column, and message of a refused robot file, as text and as JSON."""
        self.assertNotEqual(text, ROBOT, "the substitution did not take")
        self.file.write_text(text)
        answer = system.run("validate", self.file)
        self.assertEqual(answer.returncode, 2, answer.stdout + answer.stderr)
        found = re.match(re.escape(str(self.file)) + r":(\d+):(\d+): (.*)", answer.stderr)
        self.assertIsNotNone(found, answer.stderr)
        line, column, message = int(found.group(1)), int(found.group(2)), found.group(3)
        as_json = system.run("validate", self.file, "--json")
        self.assertEqual(as_json.returncode, 2)
        entry = json.loads(as_json.stdout)[0]
        self.assertFalse(entry["valid"])
        first = entry["errors"][0]
        self.assertEqual((first["line"], first["column"]), (line, column))
        self.assertIn(message, first["error"])
        return line, column, message

    def test_refusals_name_the_place_what_was_found_and_what_was_expected(self):
        cases = [  # text of the preset, its faulty replacement, text at the reported place, parts of the message
            ("name: ark2024\n", "name: ark2024\ncolour: red\n", "colour", ["colour", "expected"]),
            ("straight_length_mm: 387", "straight_length_mm: -387", "-387",
             ["straight_length_mm", "found -387", "expected"]),
            ("inner_diameter_mm: 1.3,", "inner_diameter_mm: 1.6,", "1.6",
             ["inner_diameter_mm", "found 1.6", "expected", "1.524"]),
            ("curvature_per_mm: 0.01}", "curvature_per_mm: .nan}", ".nan", ["curvature_per_mm", ".nan", "expected"]),
            ("curvature_per_mm: 0.01}", "curvature_per_mm: .inf}", ".inf", ["curvature_per_mm", ".inf", "expected"]),
            ("youngs_modulus_GPa: 58", "youngs_modulus_GPa: stiff", "stiff",
             ["youngs_modulus_GPa", "stiff", "expected"]),
            ("{outer_diameter_mm: 1.524", "{outer_diameter: 1.524", "outer_diameter:",
             ["outer_diameter", "unit", "outer_diameter_mm"]),
            ("name: arm_b", "name: arm_a", "arm_a", ["found 'arm_a'", "expected"]),
            ("tandem: robot/1", "tandem: robot/7", "robot/7", ["robot/7", "expected"]),
            ("beta_mm: [-150, -100, -50]", "beta_mm: [-150, -100]", "", ["beta_mm", "found", "expected"]),
            ("beta_mm: [-150, -100, -50]", "beta_mm: [-150, -160, -50]", "", ["expected"]),
        ]
        for before, after, there, words in cases:
            with self.subTest(after):
                text = ROBOT.replace(before, after, 1)
                line, column, message = self.refused(text)
                for word in words:
                    self.assertIn(word, message)
                self.assertTrue(text.splitlines()[line - 1][column - 1:].startswith(there),
                                f"{line}:{column} is not at '{there}'")

    def test_swapped_tubes(self):
        line, _, message = self.refused(swapped(ROBOT))
        self.assertIn("swapped", message)
        self.assertIn("found", message)
        self.assertIn("expected", message)
        self.assertIn("tubes[1]", message)
        self.assertEqual(line, 19)

    def test_broken_yaml(self):
        line, _, _ = self.refused(ROBOT.replace("tubes:\n", "tubes: [\n", 1))
        self.assertGreater(line, 0)

    def test_no_such_file(self):
        answer = system.run("validate", self.file)
        self.assertEqual(answer.returncode, 2)
        self.assertIn(str(self.file), answer.stderr)

    def test_presets_are_valid(self):
        files = sorted(system.PRESETS.glob("*/*.yaml"))
        self.assertGreater(len(files), 8)
        answer = system.run("validate", "--json", *files)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        entries = json.loads(answer.stdout)
        self.assertEqual([entry["file"] for entry in entries], [str(file) for file in files])
        for file, entry in zip(files, entries):
            self.assertTrue(entry["valid"])
            self.assertIn(file.parent.name, (entry["kind"], entry["kind"] + "s", "trajectories"))
        printed = next(e for e in entries if e["file"].endswith("ark2024.yaml"))
        self.assertTrue(any("poisson_ratio" in warning for warning in printed["warnings"]))
        overlap = "at home arm_a and arm_b overlap by 0.147 mm"
        for name in ("ark2024.yaml", "laptop.yaml"):
            entry = next(e for e in entries if e["file"].endswith(name))
            self.assertEqual([w.split(":")[0] for w in entry["warnings"] if "overlap" in w], [overlap], name)

    def test_one_bad_file_among_good_ones(self):
        self.file.write_text("tandem: robot/1\n")
        good = system.PRESETS / "robots" / "ark2024.yaml"
        answer = system.run("validate", good, self.file, good)
        self.assertEqual(answer.returncode, 2)
        self.assertEqual(answer.stdout.count(": ok: "), 2)


class CommandLine(unittest.TestCase):
    def test_schemas(self):
        for kind in ("robot", "experiment", "deployment", "trajectory"):
            answer = system.run("schema", kind)
            self.assertEqual(answer.returncode, 0)
            schema = json.loads(answer.stdout)
            self.assertEqual(schema["type"], "object")
            self.assertIn("tandem", schema["required"])
            stored = system.SOURCE / "config" / "presets" / "schemas" / f"{kind}.schema.json"
            self.assertEqual(schema, json.loads(stored.read_text()))
        self.assertEqual(system.run("schema", "poem").returncode, 2)
        self.assertEqual(system.run("schema").returncode, 2)

    def test_presets(self):
        presets = json.loads(system.run("presets", "--json").stdout)
        files = {str(path) for path in system.PRESETS.rglob("*.yaml")}
        self.assertEqual({str(pathlib.Path(preset["file"]).resolve()) for preset in presets}, files)
        for preset in presets:
            self.assertRegex(preset["description"], r"[.]$", f"{preset['file']}: the first line of the comment is a whole sentence")
            self.assertTrue(preset["description"], preset)
            self.assertNotIn("yaml-language-server", preset["description"])
        listed = system.run("presets", "trajectory").stdout
        self.assertIn("circle", listed)
        self.assertNotIn("laptop", listed)
        self.assertEqual(system.run("presets", "poem").returncode, 2)

    def test_misspelled_words_are_answered_with_the_nearest(self):
        for words, meant in ((["statsu"], "status"), (["robot", "enabel"], "enable"), (["presets", "--jsn"], "--json"),
                             (["plan", "chek", "circle"], "check"), (["topics", "--jason=1"], "--json")):
            answer = system.run(*words)
            self.assertEqual(answer.returncode, 2, words)
            self.assertIn(f"Did you mean `{meant}`?", answer.stderr, words)
        for words in (["sonnet"], ["presets", "--sonnet"], ["presets", "sonnet"], ["robot"]):
            self.assertNotIn("Did you mean", system.run(*words).stderr, words)
        answer = system.run("up", "laptop-1kz")
        self.assertEqual(answer.returncode, 2, answer.stderr)
        self.assertIn("(did you mean laptop-1khz?)", answer.stderr)

    def test_topics(self):
        answer = system.run("topics", "--json")
        self.assertEqual(answer.returncode, 0)
        topics = json.loads(answer.stdout)
        names = [topic["topic"] for topic in topics]
        self.assertEqual(len(names), len(set(names)))
        for name in ("actuation/state", "actuation/command", "planning/reference", "control/status", "stop",
                     "arm_a/measured_js", "arm_b/measured_cp", "arm_a/operating_state", "arm_b/state_command"):
            self.assertIn(f"/tandem/{name}", names)
        for topic in topics:
            self.assertEqual(topic["dds_topic"], "rt" + topic["topic"])
            package, middle, kind = topic["type"].split("/")
            self.assertEqual((middle, topic["dds_type"]), ("msg", f"{package}::msg::dds_::{kind}_"))
            self.assertTrue(topic["publisher"] and topic["description"] and topic["profile"])
        self.assertEqual(len(system.run("topics").stdout.splitlines()), len(topics))

    def test_topics_follow_the_prefix(self):
        with tempfile.TemporaryDirectory(prefix="tandem-test-") as folder:
            path = system.deployment(folder, "laptop", prefix="left_robot")
            topics = json.loads(system.run("topics", path, "--json").stdout)
        outside = {topic["topic"] for topic in topics if not topic["topic"].startswith("/left_robot/")}
        self.assertEqual(outside, {"/rosout"}, "where tools look for it")

    def test_status_of_nobody(self):
        with tempfile.TemporaryDirectory(prefix="tandem-test-") as folder:
            answer = system.run("status", system.deployment(folder, "laptop"))
        self.assertEqual(answer.returncode, 1)
        for word in ("sim", "control", "planning", "domain", "tandem up"):
            self.assertIn(word, answer.stderr)

    def test_every_subcommand_has_help_and_refuses_what_it_does_not_know(self):
        found = subcommands()
        self.assertGreater(len(found), 50)
        for words in found:
            answer = system.run(*words, "--help")
            self.assertEqual(answer.returncode, 0, words)
            self.assertIn("Usage:", answer.stdout, words)
            answer = system.run(*words, "--colour")
            self.assertEqual(answer.returncode, 2, (words, answer.stderr))
            self.assertNotEqual(answer.stderr, "", words)

    def test_version(self):
        version = re.search(r"^project\(tandem VERSION (\S+)", (system.SOURCE / "CMakeLists.txt").read_text(), re.M)[1]
        self.assertRegex(system.run("--version").stdout,
                         rf"^tandem {re.escape(version)}, wire [0-9a-f]+, commit (unknown|[0-9a-f]{{12}}\+?), "
                         r"Fast DDS 2\.\d+\.\d+, \w+ build\n$")

    def test_numbers_that_are_not_finite_are_refused(self):
        for words in (("status", "--wait"), ("cooperative", "reach", "--most-force"), ("cooperative", "payload", "--sag"),
                      ("plan", "check", "circle", "--clearance-mm"), ("jog", "--for")):
            for value in ("nan", "inf", "-inf"):
                answer = system.run(*words, value)
                self.assertEqual(answer.returncode, 2, (words, value, answer.stderr))
                self.assertIn(words[-1], answer.stderr)
                if value == "nan":
                    self.assertIn(f"{words[-1]}: found nan, expected a finite number", answer.stderr)

    def test_the_readme_lists_every_command(self):
        text = (system.SOURCE / "README.md").read_text()
        table = text[text.index("## Command line"):text.index("## Tests")]
        named = set(re.findall(r"[a-z]+", " ".join(re.findall(r"^\| (`.*?) \| ", table, re.M))))
        self.assertEqual([words[0] for words in subcommands() if len(words) == 1 and words[0] not in named], [])

    def test_services_have_help_too(self):
        for program in ("tandem-sim", "tandem-control", "tandem-planning", "tandem-recorder"):
            self.assertEqual(system.run("--help", program=program).returncode, 0)
            self.assertEqual(system.run("--colour", program=program).returncode, 2)
            self.assertEqual(system.run("--deployment", "/nowhere.yaml", program=program).returncode, 2)

    def test_wrong_use_ends_with_two(self):
        for words in [[], ["dance"], ["--colour"], ["validate"], ["up", "/nowhere.yaml"], ["status", "/nowhere.yaml"],
                      ["topics", "/nowhere.yaml"], ["experiment", "/nowhere.yaml"], ["robot"], ["robot", "run"],
                      ["robot", "move-jp", "0"], ["robot", "run", "/nowhere.yaml"]]:
            answer = system.run(*words)
            self.assertEqual(answer.returncode, 2, (words, answer.stderr))
            self.assertNotEqual(answer.stderr + answer.stdout, "", words)


if __name__ == "__main__":
    system.main()
