# SPDX-License-Identifier: Apache-2.0
"""tandem-hal with the library of docs/own-hardware.md in the place of its CAN buses: no CAN, no drive simulator."""
import json
import os
import pathlib
import re
import subprocess
import sys

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1] / "hal")]
from conformance_test import assert_all_pass, assert_moves_and_stops, start, system  # noqa: E402
from hardware import HalTest  # noqa: E402

BOARD = os.environ["TANDEM_MY_BOARD"]


class OwnDriver(HalTest):
    budgets = "{minimum_age_ms: 500, planning_reference_ms: 2000, lease_ms: 10000}"  # this test is not about time
    feedback_budget_ms = 300

    def setUp(self):
        """The preset's axes on the board: without encoders, each drive knows where it is."""
        super().setUp()
        text = self.hardware.read_text()
        text = re.sub(r"  - \{name: bus_a.*\n  - \{name: bus_b.*\n",
                      f"  - {{name: board, interface: 'library:{BOARD},/dev/ttyUSB0'}}\n", text)
        text = re.sub(r"\n    encoder: .*", "", text).replace("reference: absolute_encoder", "reference: drive")
        accepted = "accept: [{protection: command_deadline, reason: simulated}]"
        text = re.sub(r"encoder_node: \d+,\s+encoder_offset_", f"{accepted}, offset_", text)
        text = re.sub(r"bus: bus_b, node: (\d)", lambda node: f"bus: bus_b, node: {int(node[1]) + 6}", text)
        self.hardware.write_text(re.sub(r"bus: bus_[ab]", "bus: board", text))

    def test_the_hal_passes_the_conformance_test(self):
        path = self.deployment()
        self.assertIn("board on library:", self.assert_ok(system.run("validate", self.hardware)).stdout)
        start(self, path, system.executable("tandem-hal"))

        def ready():
            answer = system.run("can", "monitor", path, "--once", "--json")
            return answer.returncode == 0 and all(arm["homed"] for arm in json.loads(answer.stdout)["arms"])

        system.until(ready, 30, "all axes know where they are")
        assert_all_pass(self, path, "--yes")

    def test_it_moves_under_the_complete_system(self):
        robot = self.start_hal()
        self.await_ready(robot)
        assert_moves_and_stops(self, robot)

    def test_a_library_that_is_missing_is_named(self):
        self.hardware.write_text(self.hardware.read_text().replace(BOARD, "/nowhere/libboard.so"))
        path = self.deployment()
        answer = subprocess.run([str(system.executable("tandem-hal")), "--deployment", str(path)], capture_output=True, text=True,
                                timeout=60, check=False)
        self.assertNotEqual(answer.returncode, 0)
        self.assertIn("bus board: /nowhere/libboard.so: cannot open shared object file", answer.stdout + answer.stderr)


if __name__ == "__main__":
    system.main()
