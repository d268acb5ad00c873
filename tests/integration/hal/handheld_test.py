# SPDX-License-Identifier: Apache-2.0
"""The preset handheld with drives as the data sheet tests/sheets/mc3-like.eds says: profile velocity, rpm, 1/s^2, objects absent."""
import json
import pathlib
import sys
import types

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from hardware import favour, system  # noqa: E402

SHEET = system.SOURCE / "tests" / "sheets" / "mc3-like.eds"


class Handheld(system.SystemTest):
    def setUp(self):
        super().setUp()
        robot = system.PRESETS / "robots" / "handheld.yaml"
        self.hardware = self.folder / "hardware.yaml"
        self.hardware.write_text((system.PRESETS / "hardware" / "handheld.yaml").read_text()
                                 .replace("feedback_budget_ms: 300", "feedback_budget_ms: 900")
                                 .replace("unix:/tmp/tandem-handheld", f"unix:{self.folder / 'bus'}")
                                 .replace("../robots/handheld.yaml", str(robot)))
        # Processes of a busy host are late; what stops in time is tested elsewhere.
        self.deployment = system.deployment(
            self.folder, "handheld", robot=robot, hardware=self.hardware,
            budgets="{drive_heartbeat_ms: 1500, minimum_age_ms: 500, planning_reference_ms: 1000, lease_ms: 5000}")
        text = self.deployment.read_text().replace(
            "[--hardware, handheld,", f"[--drive-eds, {SHEET}, --hardware, {self.hardware},")
        self.deployment.write_text(text)

    def booted(self):
        axes = json.loads(system.run("can", "monitor", self.deployment, "--once", "--json").stdout)["axes"]
        return {axis["state"] for axis in axes} == {"unhomed"}

    def test_a_drive_that_states_other_counts_does_not_move_and_the_reason_is_shown(self):
        sheet = self.folder / "counts.eds"
        numerator = b"[608fsub1]\nParameterName = Numerator\nObjectType = 0x7\nDataType = 7\nAccessType = rw\nDefaultValue = "
        self.assertIn(numerator + b"4096", SHEET.read_bytes())
        sheet.write_bytes(SHEET.read_bytes().replace(numerator + b"4096", numerator + b"2000"))
        self.deployment.write_text(self.deployment.read_text().replace(str(SHEET), str(sheet)))
        with system.System(self.deployment) as running:
            reasons = system.until(lambda: running.status()["failed"].get("tandem-hal"), 60, "the drives are refused")
            self.assertEqual(len(system.until(lambda: (lambda f: len(f) == 4 and f)(running.status()["failed"]["tandem-hal"]), 60,
                                              "all four")), 4, reasons)
            self.assertIn("the drive states 2000 counts per revolution of its motor", reasons["arm translation 1"])
            self.assertIn("the hardware file says 4096: correct counts_per_revolution", reasons["arm translation 1"])
            text = self.assert_ok(system.run("status", self.deployment)).stdout
            self.assertIn("arm translation 1 failed: arm translation 1 (node 1): the drive states 2000", text)
            self.assertIn("no answer", text)
            self.assertNotIn("EMERGENCY STOP pressed", text)
            for order in (["robot", "enable"], ["home"], ["jog", "arm", "beta_1", "5", "--for", "1"]):
                answer = system.run(*order[:1], "-d", self.deployment, *order[1:], timeout=60)
                self.assertEqual(answer.returncode, 1, f"{order}: {answer.stdout}{answer.stderr}")
            self.assertNotIn("ENABLED", running.states())

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
            favour(types.SimpleNamespace(pid=running.pids["drives"]))
            system.until(self.booted, 60, "the drives have booted")
            self.assert_ok(system.run("home", "-d", self.deployment, timeout=120))
            status = running.status()
            self.assertEqual([entry["joints"] for entry in status["lost_protections"]], ["all"])
            self.assertIn("command_deadline (1400:05)", status["lost_protections"][0]["lost"])
            text = self.assert_ok(system.run("status", self.deployment)).stdout
            self.assertIn("drives (all) lack command_deadline (1400:05)", text)
            start = running.joints()[0]
            for joint, place in enumerate((-0.190, -0.095)):
                self.assertAlmostEqual(start[joint], place, delta=1e-3)
            # From the switches to the home of the robot file, where the tip can move in every direction.
            self.assert_ok(running.robot("enable"))
            self.assert_ok(system.run("jog", "-d", self.deployment, "arm", "beta_1", "5", "--for", "1", timeout=60))
            self.assert_ok(running.robot("home", timeout=60))
            path = self.trajectory("short", [0, 3, 0], points=30, tasks="[{tip: arm}]", following="timed", speed_mm_per_s=1,
                                   acceleration_mm_per_s2=5)
            self.assert_ok(running.robot("run", path, timeout=120))
            self.assertGreater(running.joints()[0][0], start[0] + 0.01)
            self.assert_ok(running.robot("stop"))
            self.assertEqual(running.states(), ["FAULT"])


if __name__ == "__main__":
    system.main()
