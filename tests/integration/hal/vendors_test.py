# SPDX-License-Identifier: Apache-2.0
"""Drives of several vendors in one arm, by their profiles: simulated with their data sheets in tests/sheets.

Each group of axes names a profile and a mode; the other arm has the built-in drives. The same session for every mixture: configuration 2 of
Table 3 (a twelfth of its length), boot, enable, jog, a node that is lost, recovery after its return."""
import csv
import json
import pathlib
import sys

import yaml

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from hardware import HalTest, system  # noqa: E402

SHEETS = system.SOURCE / "tests" / "sheets"
TOLERANCE_MM = 0.88
# Profile, its data sheet, and the mode of each tube's translation and rotation.
MIXED = {1: ("epos4", "csp"), 2: ("gold", "csv"), 3: ("mc3", "pv")}


class Vendors(HalTest):
    # What stops in time is tested elsewhere; here a process of a busy host may be late.
    feedback_budget_ms = 900
    budgets = ("{drive_heartbeat_ms: 1500, minimum_age_ms: 1000, planning_reference_ms: 2000, lease_ms: 5000, "
               "teleoperation_ms: 1000}")

    def mix(self):
        """The preset with each joint of arm A in a group of its own; the drives' options on bus A."""
        hardware = yaml.safe_load(self.hardware.read_text())
        for kind in ("translations", "rotations"):
            group = hardware[kind][0]
            mine = [axis for axis in group["axes"] if axis["arm"] == "arm_a"]
            group["axes"] = [axis for axis in group["axes"] if axis["arm"] != "arm_a"]
            for axis in mine:
                profile, mode = MIXED[axis["tube"]]
                drive = {**group["drive"], "profile": profile, "mode": mode}
                del drive["temperature_object"]
                hardware[kind].append({"drive": drive, "encoder": group["encoder"], "axes": [axis]})
        # The simulated chain of the emergency stop is no object of every sheet.
        hardware["emergency_stop"] = [entry for entry in hardware["emergency_stop"] if entry["bus"] == "bus_b"]
        self.hardware.write_text(yaml.safe_dump(hardware, sort_keys=False))
        self.assert_ok(system.run("validate", self.hardware))
        options = []
        for tube, (profile, _) in MIXED.items():
            options += ["--drive-eds", f"{tube},{tube + 3}={SHEETS / profile}-like.eds"]
        return options

    def run_table3(self):
        experiment = system.short_experiment(self.folder, "nspqp", "snsqp")
        answer = system.run("experiment", experiment, "--deployment", self.deployment(), "--csv", self.folder / "csv", "--json",
                            timeout=150)
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        with open(self.folder / "csv" / "summary.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), 4)
        for row in rows:
            self.assertEqual((row["converged"], row["limit_violations"]), (row["points"], "0"), row)
            self.assertLessEqual(max(float(row["max_ab"]), float(row["max_a"])), TOLERANCE_MM, row)

    def test_an_arm_of_three_vendors(self):
        self.drive_sim("a", *self.mix())
        self.drive_sim("b")
        self.run_table3()
        running = self.start_hal()
        self.await_ready(running)
        self.assertIn("command_deadline", json.dumps(running.status()["lost_protections"]))
        self.assert_ok(running.robot("enable"))
        before = running.joints()[0]
        self.assert_ok(system.run("jog", "-d", running.path, "a", "beta_3", "--for", "1", "--", "-2"))
        self.assertLess(running.joints()[0][2], before[2] - 1e-3)
        self.assertEqual({drive["limit_hits"] for drive in self.drives("a")}, {0}, "targets outside their limits")
        self.tell("a", "inject 5 off")  # the second rotation, a drive of the second vendor
        system.until(lambda: running.states()[0] == "FAULT", 10, "arm_a is in FAULT")
        self.assertEqual(running.states()[1], "ENABLED")
        self.assert_refused(running.robot("enable"), "FAULT")
        self.tell("a", "clear 5")
        self.assert_ok(running.robot("disable", timeout=60))
        self.await_ready(running)
        self.assert_ok(running.robot("enable"))
        self.assert_ok(running.robot("run", self.trajectory("short", [0, 2, 0], points=4), timeout=60))
        self.assert_ok(running.robot("stop"))
        self.assertEqual(set(running.states()), {"FAULT"})


if __name__ == "__main__":
    system.main()
