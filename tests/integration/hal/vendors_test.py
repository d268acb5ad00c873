# SPDX-License-Identifier: Apache-2.0
"""Drives of several vendors in one robot, by their profiles: simulated with their data sheets in tests/sheets.

Each group of axes names a profile and a mode; the other axes have the built-in drives. The same session for both arms: configuration 2 of
Table 3 (a twelfth of its length), boot, enable, jog, a circle, a node that is lost, recovery after its return."""
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
MIXED = {"arm_a": {1: ("epos4", "csp"), 2: ("gold", "csv"), 3: ("mc3", "pv")}, "arm_b": {3: ("ipos", "pv")}}
# What the sheet of a drive forces somebody to accept.
ACCEPTED = {"ipos": ["connection_reaction", "quick_stop_ramp"]}


class Vendors(HalTest):
    # What stops in time is tested elsewhere; here a process of a busy host may be late.
    feedback_budget_ms = 900
    budgets = ("{drive_heartbeat_ms: 1500, minimum_age_ms: 1000, planning_reference_ms: 2000, lease_ms: 5000, "
               "teleoperation_ms: 1000}")

    def mix(self):
        """The preset with each joint of MIXED in a group of its own; the drives' options on each bus."""
        hardware = yaml.safe_load(self.hardware.read_text())
        for kind in ("translations", "rotations"):
            group = hardware[kind][0]
            mine = [axis for axis in group["axes"] if axis["tube"] in MIXED[axis["arm"]]]
            group["axes"] = [axis for axis in group["axes"] if axis not in mine]
            for axis in mine:
                profile, mode = MIXED[axis["arm"]][axis["tube"]]
                if profile in ACCEPTED:
                    axis["accept"] = [{"protection": loss, "reason": "a test"} for loss in ACCEPTED[profile]]
                drive = {**group["drive"], "profile": profile, "mode": mode}
                del drive["temperature_object"]
                hardware[kind].append({"drive": drive, "encoder": group["encoder"], "axes": [axis]})
        # The simulated chain of the emergency stop is no object of every sheet.
        hardware["emergency_stop"] = [entry for entry in hardware["emergency_stop"] if entry["bus"] == "bus_b"]
        # Two drives that need twice as many PDOs.
        next(bus for bus in hardware["buses"] if bus["name"] == "bus_b")["load_limit"] = 0.7
        self.hardware.write_text(yaml.safe_dump(hardware, sort_keys=False))
        self.assert_ok(system.run("validate", self.hardware))
        return [[word for tube, (profile, _) in tubes.items()
                 for word in ("--drive-eds", f"{tube},{tube + 3}={SHEETS / profile}-like.eds")] for tubes in MIXED.values()]

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

    def lose_and_recover(self, running, arm, node):
        """A node of this arm goes silent: only its arm stops. It comes back: the arm can be enabled again."""
        bus = "ab"[arm]
        self.tell(bus, f"inject {node} off")
        system.until(lambda: running.states()[arm] == "FAULT", 10, f"arm {bus} is in FAULT")
        self.assertEqual(running.states()[1 - arm], "ENABLED")
        self.assert_refused(running.robot("enable"), "FAULT")
        self.tell(bus, f"clear {node}")
        self.assert_ok(running.robot("disable", timeout=60))
        self.await_ready(running)
        self.assert_ok(running.robot("enable"))

    def test_arms_of_four_vendors(self):
        for bus, options in zip("ab", self.mix()):
            self.drive_sim(bus, *options)
        self.run_table3()
        running = self.start_hal()
        self.await_ready(running)
        lost = json.dumps(running.status()["lost_protections"])
        self.assertNotIn("heartbeat_watch", lost)
        for protection in ("command_deadline", "connection_reaction"):
            self.assertIn(protection, lost)
        self.assert_ok(running.robot("enable"))
        for arm in (0, 1):
            before = running.joints()[arm]
            self.assert_ok(system.run("jog", "-d", running.path, "ab"[arm], "beta_3", "--for", "1", "--", "-2"))
            self.assertLess(running.joints()[arm][2], before[2] - 1e-3)
        self.assert_ok(running.robot("run", "circle", timeout=90))
        for bus in "ab":
            self.assertEqual({drive["limit_hits"] for drive in self.drives(bus)}, {0}, "targets outside their limits")
        self.assert_ok(running.robot("enable"))  # a run ends with power off
        self.lose_and_recover(running, 0, 5)  # the second rotation, a drive of the second vendor
        self.lose_and_recover(running, 1, 6)  # the third rotation, a drive of the fourth
        self.assert_ok(running.robot("run", self.trajectory("short", [0, 2, 0], points=4), timeout=60))
        self.assert_ok(running.robot("stop"))
        self.assertEqual(set(running.states()), {"FAULT"})


if __name__ == "__main__":
    system.main()
