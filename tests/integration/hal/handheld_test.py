# SPDX-License-Identifier: Apache-2.0
"""The preset handheld with drives as the data sheet tests/sheets/mc3-like.eds says: profile velocity, rpm, 1/s^2, objects absent."""
import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

SHEET = system.SOURCE / "tests" / "sheets" / "mc3-like.eds"


class Handheld(system.SystemTest):
    def setUp(self):
        super().setUp()
        robot = system.PRESETS / "robots" / "handheld.yaml"
        self.hardware = self.folder / "hardware.yaml"
        self.hardware.write_text((system.PRESETS / "hardware" / "handheld.yaml").read_text()
                                 .replace("unix:/tmp/tandem-handheld", f"unix:{self.folder / 'bus'}")
                                 .replace("../robots/handheld.yaml", str(robot)))
        # Processes of a busy host are late; what stops in time is tested elsewhere.
        self.deployment = system.deployment(
            self.folder, "handheld", robot=robot, hardware=self.hardware,
            budgets="{drive_heartbeat_ms: 1500, minimum_age_ms: 500, planning_reference_ms: 1000, lease_ms: 5000}")
        text = self.deployment.read_text().replace(
            "[--hardware, handheld,", f"[--drive-eds, {SHEET}, --hardware, {self.hardware},")
        self.deployment.write_text(text)

    def test_the_sheet_makes_an_axis(self):
        imported = system.run("can", "import", SHEET, "--hardware", self.hardware, "--axis", "arm translation 1", "--json")
        self.assert_ok(imported)
        found = json.loads(imported.stdout)
        self.assertEqual(found["mode"], "pv")
        self.assertEqual(found["reasons"], [])
        for line in ("velocity_unit: rpm", "acceleration_unit: rev_per_s2", "mode: pv"):
            self.assertIn(line, found["yaml"])

    def test_an_arm_homes_and_follows_a_path(self):
        with system.System(self.deployment) as running:
            system.until(lambda: running.status()["arms"][0]["operating_state"] == "DISABLED", 60, "the drives have booted")
            self.assert_ok(system.run("home", self.deployment, timeout=120))
            status = running.status()
            self.assertEqual([entry["joints"] for entry in status["lost_protections"]], ["all"])
            self.assertIn("command_deadline (1400:05)", status["lost_protections"][0]["lost"])
            text = self.assert_ok(system.run("status", self.deployment)).stdout
            self.assertIn("drives (all) lack command_deadline (1400:05)", text)
            start = running.joints()[0]
            for joint, place in enumerate((-0.190, -0.095)):
                self.assertAlmostEqual(start[joint], place, delta=1e-3)
            # From the switches to where the tip can move in every direction.
            self.assert_ok(running.robot("enable"))
            self.assert_ok(system.run("jog", "-d", self.deployment, "arm", "beta_1", "5", "--for", "4", timeout=60))
            path = self.trajectory("short", [0, 2, 0], points=5, tasks="[{tip: arm}]")
            self.assert_ok(running.robot("run", path, timeout=120))
            self.assertGreater(running.joints()[0][0], start[0] + 0.01)
            self.assert_ok(running.robot("stop"))
            self.assertEqual(running.states(), ["FAULT"])


if __name__ == "__main__":
    system.main()
