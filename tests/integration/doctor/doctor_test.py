# SPDX-License-Identifier: Apache-2.0
"""`tandem doctor`: checks everything, gives advice, and its exit code is the worst level."""
import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

LEVELS = ["good", "warning", "bad"]


class Doctor(system.SystemTest):
    def examine(self, path):
        answer = system.run("doctor", path, "--for", "0.3", "--json")
        report = json.loads(answer.stdout)
        worst = max((finding["level"] for finding in report["findings"]), key=LEVELS.index)
        self.assertEqual(report["level"], worst)
        self.assertEqual(answer.returncode, 1 if worst == "bad" else 0, answer.stderr)
        for finding in report["findings"]:
            self.assertTrue(finding["found"], finding)
            self.assertEqual(finding["level"] == "good", not finding["advice"], "advice where it is needed, only there")
        return report["findings"]

    def about(self, findings, subject):
        return [finding for finding in findings if finding["subject"] == subject]

    def test_everything_is_looked_at(self):
        findings = self.examine(system.deployment(self.folder, "laptop"))
        self.assertEqual({finding["subject"] for finding in findings} - {"frequency"},
                         {"kernel", "cores", "rights", "clock", "network", "shared memory", "security", "CAN", "timer"})
        self.assertRegex(self.about(findings, "network")[0]["found"], r"round trip \d+ us")
        self.assertRegex(self.about(findings, "timer")[0]["found"], r"period 1 ms.*largest of \d+")

    def test_what_is_not_there_is_named(self):
        hosts = self.examine(system.deployment(self.folder, "two-hosts"))
        self.assertIn("expected one with an address of this machine", self.about(hosts, "network")[0]["found"])
        preset = (system.PRESETS / "hardware" / "ark2024-two-buses.yaml").read_text()
        hardware = self.folder / "hardware.yaml"
        hardware.write_text(preset.replace("unix:/tmp/tandem-bus-a", "can:nocan7").replace(
            "../robots/ark2024.yaml", str(system.PRESETS / "robots" / "ark2024.yaml")))
        findings = self.examine(system.deployment(self.folder, "drives", hardware=hardware))
        bus = self.about(findings, "CAN bus_a")[0]
        self.assertEqual((bus["level"], bus["found"]), ("bad", "CAN interface nocan7 was not found"))
        self.assertEqual(self.about(findings, "CAN bus_b")[0]["level"], "good")


if __name__ == "__main__":
    system.main()
