#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The operator's page in headless Chromium, with `tandem up` and tandem-console: page.js and catheters.js simulate the operator.

TANDEM_PAGE is the folder of the built page, TANDEM_ARTIFACTS the folder for screenshots."""
import json
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "integration" / "harness"))
import system  # noqa: E402  pylint: disable=wrong-import-position


class Operated(system.SystemTest):
    """Only sim, control and planning run; the script starts and kills the console."""

    def operate(self, script, preset, *words, drives="", more=None, **changes):
        """`drives`: hardware file of simulated drives, instead of the preset's; `more`: what the script gets in addition."""
        artifacts = pathlib.Path(os.environ.get("TANDEM_ARTIFACTS", self.folder / "artifacts"))
        artifacts.mkdir(parents=True, exist_ok=True)
        # Software rendering occupies both cores of a small machine. Watchdogs have separate tests with default budgets; here only the page
        # is tested.
        path = system.deployment(self.folder, preset, budgets="{minimum_age_ms: 1000, lease_ms: 3000, drive_heartbeat_ms: 2000, "
                                 "planning_reference_ms: 1000, teleoperation_ms: 500}", **changes)
        others = ("executable: tandem-recorder", "executable: tandem-console")
        lines = [line for line in path.read_text().splitlines() if not any(other in line for other in others)]
        path.write_text("\n".join(lines).replace("[--hardware, handheld,", f"[--hardware, {drives},") + "\n")
        robot = system.System(path)
        self.addCleanup(robot.close)
        setting = {"bin": str(pathlib.Path(system.executable()).parent), "deployment": str(robot.path),
                   "port": system.free_port(), "spare": system.free_port(), "page": os.environ["TANDEM_PAGE"],
                   "artifacts": str(artifacts), "pids": robot.pids,
                   "one_arm": str(system.PRESETS / "robots" / "timc2024.yaml"),
                   "other": str(system.PRESETS / "robots" / "ark2024-as-printed.yaml"),
                   "browser": os.environ.get("TANDEM_CHROMIUM", "/usr/bin/chromium"), **(more or {})}
        operator = subprocess.run(["node", str(HERE / script), json.dumps(setting), *words], timeout=560, check=False)
        self.assertEqual(operator.returncode, 0, f"the operator was not content; screenshots are in {artifacts}")


class Page(Operated):
    def test_the_operators_page(self):
        self.operate("page.js", "laptop", *os.environ.get("TANDEM_SCENES", "").split())


class Situations(Operated):
    def test_what_the_robot_does_and_what_the_page_says(self):
        self.operate("page.js", "laptop", "situations")


class Window(Operated):
    def test_input_of_the_x_server_in_a_window(self):
        self.operate("window.js", "laptop", *os.environ.get("TANDEM_SCENES", "").split())


class Rates(Operated):
    def test_the_page_asks_for_the_rates_that_it_draws(self):
        self.operate("rates.js", "laptop-1khz")


class Access(Operated):
    def test_the_page_is_accessible(self):
        self.operate("page.js", "laptop", *os.environ.get("TANDEM_SCENES", "access devices charts").split())


class Preview(Operated):
    def test_what_is_seen_before_a_run(self):
        regions = ("{crtk: {clients: ['*']}, workspace: {min_mm: [-40, -40, 240], max_mm: [40, 40, 360]}, forbidden: ["
                   "{name: vessel, sphere: {center_mm: [0, 30, 320], radius_mm: 6}}, "
                   "{name: wall, half_space: {point_mm: [0, 0, 355], normal: [0, 0, -1]}}]}")
        self.operate("page.js", "laptop", "preview", teleoperation=regions)


class Replay(Operated):
    def recording(self, preset, robot):
        """Of another robot."""
        file = self.folder / f"{robot.stem}.mcap"
        path = system.deployment(self.folder, preset, robot=robot)
        with system.System(path):
            done = system.run("record", str(path), "-o", str(file), "--for", "2")
        self.assertIn(done.returncode, (0, 1), done.stderr)  # 1: a busy machine has lost samples
        return str(file)

    def test_recordings_are_shown_as_such(self):
        self.operate("page.js", "laptop", *os.environ.get("TANDEM_SCENES", "replay").split(), more={
            "catheters": self.recording("ablation-pair", system.PRESETS / "cooperative" / "ablation-pair.yaml"),
            "one_arm_recording": self.recording("laptop", system.PRESETS / "robots" / "timc2024.yaml")})


class Orientation(Operated):
    def test_operators_turn_the_tip(self):
        self.operate("page.js", "teleop", *os.environ.get("TANDEM_SCENES", "orientation").split(),
                     teleoperation="{orientation: full, leash_mm: 1}")

    def test_operators_turn_the_tip_axis(self):
        self.operate("page.js", "teleop", "axis:", teleoperation="{orientation: axis, leash_mm: 1}")


class Catheters(Operated):
    def test_catheters_and_what_they_hold(self):
        robot = self.folder / "loaded.yaml"
        text = (system.PRESETS / "cooperative" / "ablation-pair.yaml").read_text()
        robot.write_text(text.replace("\nobject:\n", "\nobject:\n  load_N: [0, 0, -0.002]\n"))
        self.operate("catheters.js", "ablation-pair", robot=robot)


class Arms(Operated):
    """The arms of the preset twice, side by side: four in all."""

    def test_four_arms_are_seen_and_nothing_moves(self):
        text = (system.PRESETS / "robots" / "ark2024.yaml").read_text().replace("name: ark2024\n", "name: four-arms\n")
        begin, end = text.index("  - name: arm_a"), text.index("\ncontrol:")
        arms = text[begin:end]
        more = arms.replace("name: arm_a", "name: arm_c").replace("name: arm_b", "name: arm_d")
        for arm, (was, y) in {"c": (5, 15), "d": (-5, -15)}.items():
            begin_of_arm = more.index(f"name: arm_{arm}")
            more = more[:begin_of_arm] + more[begin_of_arm:].replace(f"position_mm: [0, {was}, 0]", f"position_mm: [0, {y}, 0]", 1)
        robot = self.folder / "four-arms.yaml"
        robot.write_text(text[:end] + "\n" + more + text[end:])
        self.operate("arms.js", "laptop", robot=robot)


class Positions(Operated):
    """With drives behind tandem-hal: the joints' absolute positions have to be confirmed."""

    def test_what_has_to_be_confirmed(self):
        os.environ["XDG_STATE_HOME"] = str(self.folder / "state")
        robot = system.PRESETS / "robots" / "handheld.yaml"
        hardware = self.folder / "hardware.yaml"
        hardware.write_text((system.PRESETS / "hardware" / "handheld-absolute.yaml").read_text()
                            .replace("feedback_budget_ms: 300", "feedback_budget_ms: 900")
                            .replace("unix:/tmp/tandem-handheld-absolute", f"unix:{self.folder / 'bus'}")
                            .replace("../robots/handheld.yaml", str(robot)))
        self.operate("positions.js", "handheld", robot=robot, hardware=hardware, drives=str(hardware),
                     control_period_s=0.01)


if __name__ == "__main__":
    system.main()
