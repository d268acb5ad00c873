# SPDX-License-Identifier: Apache-2.0
"""Tip orientations from the model or from a tracker, over DDS in lock-step and in one process: the model is rigid, the robot is not.

The first task keeps the axis of tip A. The errors are those of the true tips of the simulator."""
import csv
import pathlib
import sys
import tempfile
import unittest

import yaml

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "harness"))
import system  # noqa: E402

MODEL_IS_OFF, REACHED = 2.0, 0.2  # degrees
DEGREES = 57.29578


class Orientations(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        experiment = yaml.safe_load((system.PRESETS / "experiments" / "overlap.yaml").read_text())
        trajectory = experiment["trajectories"][0]
        trajectory.update(tasks=[{"axis": {"arm": "a", "tolerance_deg": REACHED}}, {"relative": ["a", "b"]}, {"tip": "a"}], points=10)
        experiment.update(robot=str(system.PRESETS / "robots" / "ark2024.yaml"), methods=["nspqp"], trajectories=[trajectory])
        self.experiment = self.folder / "axis.yaml"
        self.experiment.write_text(yaml.safe_dump(experiment, sort_keys=False))

    def errors(self, feedback, *options, tracker="rate_Hz: 40"):
        """Errors of the axis in the last iteration of each point, degrees; the file of rows."""
        folder = pathlib.Path(tempfile.mkdtemp(dir=self.folder))
        deployment = system.deployment(folder, "lockstep-compliant-sensor", orientation_feedback=feedback)
        deployment.write_text(deployment.read_text().replace("{rate_Hz: 40}", f"{{{tracker}}}"))
        answer = system.run("experiment", self.experiment, "--deployment", deployment, "--csv", folder, *options, timeout=150)
        self.assertIn(answer.returncode, (0, 1), answer.stderr)  # 1: a point was not reached
        path = folder / "rectangle-2-nspqp.csv"
        with open(path, newline="", encoding="utf-8") as file:
            last = {row["point"]: row for row in csv.DictReader(file)}
        return [DEGREES * float(row["err_axis_a"]) for row in last.values()], path.read_bytes()

    def test_the_tracker_corrects_what_the_model_does_not_know(self):
        off, _ = self.errors("model")
        self.assertEqual(len(off), 10)
        self.assertGreater(sum(off) / 10, MODEL_IS_OFF)
        reached, rows = self.errors("sensor")
        self.assertLess(sum(reached) / 10, 1.5 * REACHED, "limits forbid it at some points")
        self.assertEqual(rows, self.errors("sensor", "--offline")[1], "over DDS as in one process")

    def test_a_tracker_without_orientations_holds_the_arms(self):
        still, rows = self.errors("sensor", "--offline", tracker="rate_Hz: 40, orientations: false")
        lines = rows.decode().splitlines()
        joints = [i for i, name in enumerate(lines[0].split(",")) if name.startswith(("beta_", "alpha_"))]
        places = {tuple(line.split(",")[i] for i in joints) for line in lines[1:]}
        self.assertEqual(len(places), 1, "no joint moves")
        self.assertEqual(len(still), 10)


if __name__ == "__main__":
    system.main()
