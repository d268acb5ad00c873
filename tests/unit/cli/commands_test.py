# SPDX-License-Identifier: Apache-2.0
"""What all commands of `tandem` have: examples that are valid, and --json for results and refusals."""
import json
import pathlib
import re
import shlex
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402


def commands():
    return [line.split() for line in system.run("__commands").stdout.splitlines()]


def examples(help_text):
    """The command lines at the end of a help text."""
    lines = help_text.splitlines()
    return [line.strip() for line in lines[lines.index("Examples:") + 1:]]


class Commands(system.SystemTest):
    def test_there_are_all(self):
        self.assertGreater(len(commands()), 50)
        for words in (["robot", "run"], ["plan", "ik"], ["montecarlo"], ["montecarlo", "merge"], ["up"]):
            self.assertIn(words, commands())

    def test_each_has_examples_of_its_own_which_are_valid(self):
        for words in commands():
            text = system.run(*words, "--help").stdout
            found = examples(text)
            self.assertTrue(found, words)
            for example in found:
                line = shlex.split(re.search(r"(?<=\btandem )[^|>)]+", example)[0])
                deployment = line.index("-d") if "-d" in line[:2] else len(line)
                self.assertEqual([*line[:deployment], *line[deployment + 2:]][:len(words)], words, example)
                with self.subTest(example):
                    self.assert_ok(system.run("__parse", *line))
            self.assertNotIn("Start here", text, words)

    def test_a_line_that_is_not_valid_is_refused_as_text_and_as_json(self):
        for words in commands():
            plain = system.run(*words, "--no-such-option")
            self.assertEqual((plain.returncode, plain.stdout), (2, ""), words)
            answer = system.run(*words, "--json", "--no-such-option")
            refusal = json.loads(answer.stdout)
            self.assertEqual((answer.returncode, refusal["exit"], answer.stderr), (2, 2, plain.stderr), words)
            self.assertEqual(refusal["error"]["message"], plain.stderr.strip(), words)

    def test_presets_are_validated_by_name(self):
        answer = self.assert_ok(system.run("validate", "laptop", "ark2024", "--json"))
        self.assertEqual([each["kind"] for each in json.loads(answer.stdout)], ["deployment", "robot"])

    def test_refusals_have_the_place_in_the_file(self):
        file = self.folder / "bad.yaml"
        file.write_text("tandem: trajectory/1\nshape: circle\nradius_mm: -3\n")
        for words in (("plan", "check", file), ("robot", "run", file)):
            answer = system.run(*words, "--json")
            refusal = json.loads(answer.stdout)
            self.assertEqual((answer.returncode, refusal["error"]["file"]), (2, str(file)), answer)
            self.assertEqual([(each["line"], each["key"]) for each in refusal["error"]["errors"]],
                             [(1, "name"), (2, "shape"), (3, "radius_mm")], answer)

    def test_a_refusal_may_quote_what_is_no_text(self):
        file = self.folder / "bytes.yaml"
        file.write_bytes(b"tandem: trajectory/1\n\xff\xfe: 1\n")
        answer = subprocess.run([system.executable(), "plan", "check", file, "--json"], capture_output=True, check=False)
        self.assertIn(b"\xff", answer.stderr)
        self.assertEqual((answer.returncode, json.loads(answer.stdout.decode("utf-8"))["exit"]), (2, 2))

    def test_results(self):
        out = self.folder / "arm.yaml"
        made = json.loads(self.assert_ok(system.run("new", "robot", "arm", "-o", out, "--json")).stdout)
        self.assertEqual((made["file"], made["kind"]), (str(out), "robot"))
        folder = self.folder / "ca"
        made = json.loads(self.assert_ok(system.run("security", "init", folder, "--json")).stdout)
        self.assertEqual(made["folder"], str(folder))
        issued = json.loads(self.assert_ok(system.run("security", "issue", folder, "console-viewer", "--json")).stdout)
        self.assertEqual([each["role"] for each in issued], ["console-viewer"])
        self.assertTrue(pathlib.Path(issued[0]["folder"]).is_dir())
        revoked = json.loads(self.assert_ok(system.run("security", "revoke", folder, "console-viewer", "--json")).stdout)
        self.assertEqual(revoked["revoked"], 1)
        page = json.loads(self.assert_ok(system.run("console", "--url", "--json")).stdout)
        self.assertTrue(page["page"].startswith("http"))
        recording = pathlib.Path(__file__).resolve().parents[2] / "archive" / "5e7986a" / "recordings" / "lock-step.mcap"
        rows = json.loads(self.assert_ok(system.run("export", recording, "--csv", self.folder / "csv", "--json")).stdout)
        self.assertEqual(rows["rows"]["actuation/state"], 25)
        self.assertIn("complete", json.loads(self.assert_ok(system.run("completion", "--json")).stdout)["script"])


if __name__ == "__main__":
    system.main()
