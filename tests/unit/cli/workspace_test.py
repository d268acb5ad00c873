# SPDX-License-Identifier: Apache-2.0
"""tandem workspace: volumes that are independent of the samples, and samples compared with tandem fk."""
import csv
import io
import json
import math
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402
import tubes  # noqa: E402

ROBOT = (system.PRESETS / "robots" / "ark2024.yaml").read_text()


class Workspace(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def robot(self, *changes):
        """ark2024 with texts replaced."""
        text = ROBOT
        for old, new in changes:
            self.assertIn(old, text)
            text = text.replace(old, new)
        path = self.folder / "robot.yaml"
        path.write_text(text)
        return path

    def workspace(self, *options, samples=3000, model="rigid"):
        answer = system.run("workspace", "--json", "--samples", samples, "--model", model, *options, timeout=240)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        return json.loads(answer.stdout)

    def rows(self, name):
        with open(self.folder / name, encoding="utf-8") as file:
            return list(csv.DictReader(file))

    def test_samples_are_inside_the_limits_and_answered_as_by_fk(self):
        for model in ("rigid", "compliant"):
            found = self.workspace("--arm", "b", "--csv", self.folder, samples=500, model=model)
            self.assertEqual(json.loads((self.folder / "workspace.json").read_text()), found)
            rows = self.rows("workspace-arm_b.csv")
            self.assertEqual(len(rows), 500)
            joints = [[float(row[f"{kind}_{i}"]) for kind in ("beta", "alpha") for i in (1, 2, 3)] for row in rows]
            text = "".join(",".join(map(repr, q)) + "\n" for q in joints)
            alone = csv.DictReader(io.StringIO(system.run("fk", "--arm", "b", "--model", model, text=text).stdout))
            for q, row, other in zip(joints, rows, alone):
                self.assertLess(tubes.excess(q), 1e-12)
                self.assertEqual([row[name] for name in ("x", "y", "z", "stability", "status")],
                                 [other[name] for name in ("x", "y", "z", "stability", "status")])
            self.assertEqual(found["arms"][0]["reached"], sum(row["status"] == "ok" for row in rows))

    def test_samples_fill_the_limits(self):
        self.workspace("--arm", "a", "--csv", self.folder, samples=4000)
        joints = [[float(row[f"{kind}_{i}"]) for kind in ("beta", "alpha") for i in (1, 2, 3)]
                  for row in self.rows("workspace-arm_a.csv")]
        self.assertEqual({q[3] for q in joints}, {0.0})

        def distance(q, other):
            """Largest difference, as a fraction of each joint's range."""
            parts = [abs(a - b) / length for a, b, length in zip(q, other, tubes.LENGTH)]
            return max(parts + [abs(math.remainder(a - b, math.tau)) / math.tau for a, b in zip(q[3:], other[3:])])

        # Every joint vector inside equation (1), with tube 1 turned to zero, has a sample near it.
        rng = system.seeded(self)
        for _ in range(40):
            wanted = tubes.random_joints(rng)
            wanted[3:] = [alpha - wanted[3] for alpha in wanted[3:]]
            self.assertLess(min(distance(q, wanted) for q in joints), 0.2, wanted)

    def test_volumes(self):
        found = self.workspace("--voxel", "0.004", samples=20000)
        a, b = found["arms"]
        shared = found["shared"]
        for arm in (a, b):
            self.assertTrue(arm["symmetric"])
            self.assertLessEqual(arm["volume_half_samples_m3"], arm["volume_m3"])
            self.assertLess(arm["volume_m3"], arm["volume_double_voxel_m3"])
            cylinder = math.pi * (arm["radius_m"] + 0.004)**2 * (arm["z_m"][1] - arm["z_m"][0] + 0.008)
            self.assertLess(arm["volume_m3"], cylinder)
            self.assertLess(arm["z_m"][1], tubes.LENGTH[0] + 1e-9)
        self.assertAlmostEqual(a["volume_m3"], b["volume_m3"], delta=0.02 * a["volume_m3"])
        self.assertLess(shared["common_m3"], min(a["volume_m3"], b["volume_m3"]))
        self.assertGreater(shared["any_m3"], max(a["volume_m3"], b["volume_m3"]))
        self.assertAlmostEqual(shared["common_m3"] + shared["any_m3"], a["volume_m3"] + b["volume_m3"],
                               delta=0.01 * a["volume_m3"])

    def test_volume_is_equal_in_ring_and_cube_cells(self):
        # With rotations limited to a full turn, the same space is counted in cubes instead of rings.
        turned = self.robot(("rotation: {lower_deg: unlimited, upper_deg: unlimited,",
                             "rotation: {lower_deg: -180, upper_deg: 180,"),
                            ("alpha_deg: [90, -60, -270]", "alpha_deg: [90, -60, 90]"))
        rings = self.workspace("--arm", "a", "--voxel", "0.02", samples=300000)["arms"][0]
        cubes = self.workspace("--robot", turned, "--arm", "a", "--voxel", "0.02", samples=300000)["arms"][0]
        self.assertTrue(rings["symmetric"])
        self.assertFalse(cubes["symmetric"])
        self.assertAlmostEqual(rings["volume_m3"], cubes["volume_m3"],
                               delta=0.15 * rings["volume_m3"])

    def test_straight_tubes_reach_a_line(self):
        straight = self.robot(("curvature_per_mm: 0.01}", "curvature_per_mm: 0}"),
                              ("curvature_per_mm: 0.005}", "curvature_per_mm: 0}"),
                              ("curvature_per_mm: 0.007}", "curvature_per_mm: 0}"))
        arm = self.workspace("--robot", straight, "--arm", "a", "--voxel", "0.001", samples=40000)["arms"][0]
        self.assertLess(arm["radius_m"], 1e-12)
        self.assertAlmostEqual(arm["volume_m3"], math.pi * 0.001**2 * tubes.LENGTH[0], delta=2e-11 * math.pi * 1000)

    def test_arms_apart_share_nothing_and_arms_in_one_place_everything(self):
        apart = self.workspace("--robot", self.robot(("[0, -5, 0]", "[0, -2000, 0]")), "--voxel", "0.02")
        self.assertEqual(apart["shared"]["common_m3"], 0.0)
        same = self.workspace("--robot", self.robot(("[0, -5, 0]", "[0, 5, 0]")), "--voxel", "0.005")
        self.assertEqual(same["shared"]["common_m3"], same["shared"]["any_m3"])

    def test_seed_and_threads(self):
        once = self.workspace("--seed", "7", "--threads", "1", samples=800, model="compliant")
        again = self.workspace("--seed", "7", "--threads", "4", samples=800, model="compliant")
        other = self.workspace("--seed", "8", samples=800, model="compliant")
        self.assertEqual(once, again)
        self.assertNotEqual(once["arms"][0]["volume_m3"], other["arms"][0]["volume_m3"])

    def test_a_margin_counts_less(self):
        everything = self.workspace("--arm", "a", samples=2000, model="compliant")["arms"][0]
        safe = self.workspace("--arm", "a", "--margin", "0.9", samples=2000, model="compliant")["arms"][0]
        self.assertLess(safe["reached"], everything["reached"])
        self.assertEqual(safe["reached"] + sum(safe["refused"].values()), 2000)

    def test_figures_and_text(self):
        answer = system.run("workspace", "--samples", "2000", "--model", "rigid", "--figures", self.folder / "figures",
                            timeout=240)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        for name in ("section", "volume"):
            picture = self.folder / "figures" / f"workspace-{name}.png"
            self.assertEqual(picture.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        summary = json.loads((self.folder / "figures" / "csv" / "workspace.json").read_text())
        self.assertIn(f"{1e6 * summary['arms'][0]['volume_m3']:.1f} cm3", answer.stdout)
        self.assertIn(f"{1e6 * summary['shared']['common_m3']:.1f} cm3", answer.stdout)

    def test_wrong_use(self):
        for options in (["--arm", "q"], ["--model", "stiff"], ["--samples", "1"], ["--voxel", "0"],
                        ["--robot", "timc2024", "--arm", "both"], ["--margin", "2"]):
            answer = system.run("workspace", *options)
            self.assertEqual(answer.returncode, 2, f"{options}: {answer.stderr}")


if __name__ == "__main__":
    system.main()
