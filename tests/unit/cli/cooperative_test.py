# SPDX-License-Identifier: Apache-2.0
"""tandem cooperative, and fk of catheters: comparison with formulas in this file, and refusals with their reasons."""
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

PAIR = (system.PRESETS / "cooperative" / "ablation-pair.yaml").read_text()
ASSIST = (system.PRESETS / "cooperative" / "ablation-assist.yaml").read_text()


def tip(insertion, roll, bend, base, length=0.065, tool=0.015):
    """Tip of a catheter of constant curvature whose base is parallel to the robot's."""
    across = length * (1 - math.cos(bend)) / bend if bend else 0.0
    ahead = length * math.sin(bend) / bend if bend else length
    across += tool * math.sin(bend)
    ahead += tool * math.cos(bend)
    return [base[0] + across * math.cos(roll), base[1] + across * math.sin(roll), base[2] + insertion + ahead]


def fk(rows, *options):
    text = "".join(",".join(map(repr, row)) + "\n" for row in rows)
    answer = system.run("fk", "--robot", "ablation-pair", *options, text=text)
    return list(csv.DictReader(io.StringIO(answer.stdout))), answer


class CatheterKinematics(unittest.TestCase):
    ROWS = [[0.06, 0.0, 1.2], [0.03, 1.1, -0.7], [0.1, -2.0, 0.0], [0.05, 0.4, 3.0]]

    def test_constant_curvature_and_unloaded_rods_are_where_the_formula_says(self):
        for model in ("constant-curvature", "cosserat"):
            answers, answer = fk(self.ROWS, "--arm", "b", "--model", model)
            self.assertEqual(answer.returncode, 0, answer.stderr)
            for row, found in zip(self.ROWS, answers):
                wanted = tip(*row, [0.06338, 0.0, 0.0])
                self.assertLess(math.dist(wanted, [float(found[k]) for k in "xyz"]), 1e-6)
                self.assertAlmostEqual(float(found["pull"]), 0.9e-3 * row[2], places=12)

    def test_jacobian_is_the_difference_quotient(self):
        for model in ("constant-curvature", "cosserat"):
            for row in self.ROWS:
                found = fk([row], "--model", model, "--jacobian")[0][0]
                h = 1e-6
                for j in range(3):
                    there, back = list(row), list(row)
                    there[j] += h
                    back[j] -= h
                    ends, _ = fk([there, back], "--model", model)
                    for i, axis in enumerate("xyz"):
                        slope = (float(ends[0][axis]) - float(ends[1][axis])) / (2 * h)
                        self.assertAlmostEqual(slope, float(found[f"j{i + 1}{j + 1}"]), delta=1e-5)

    def test_a_force_pushes_the_tip_by_the_compliance(self):
        rest = fk([self.ROWS[0]], "--model", "cosserat", "--compliance")[0][0]
        pushed = fk([self.ROWS[0]], "--model", "cosserat", "--wrench", "0,1e-4,0,0,0,0")[0][0]
        moved = float(pushed["y"]) - float(rest["y"])
        self.assertGreater(moved, 0.0)
        self.assertAlmostEqual(moved, 1e-4 * float(rest["c22"]), delta=1e-3 * moved)

    def test_the_shape_ends_where_the_bending_end_does(self):
        for model in ("constant-curvature", "cosserat"):
            points, answer = fk([self.ROWS[0]], "--model", model, "--shape", "30")
            self.assertEqual((answer.returncode, len(points)), (0, 30))
            wanted = tip(*self.ROWS[0], [-0.06338, 0.0, 0.0], tool=0.0)
            self.assertLess(math.dist(wanted, [float(points[-1][k]) for k in "xyz"]), 1e-6)

    def test_rows_without_a_solution_have_a_reason(self):
        answers, answer = fk([[0.5, 0.0, 0.0], [0.06, 0.0, 1.0]])
        self.assertEqual(answer.returncode, 1)
        self.assertIn("outside the limits of the robot file: insertion is 380 mm outside", answers[0]["status"])
        self.assertEqual(answers[1]["status"], "ok")
        for options, why in ((["--wrench", "0,1,0,0,0,0"], "need --model cosserat"), (["--branch"], "--branch"),
                             (["--arm", "c"], "expected one of: arm_a, arm_b")):
            answer = fk([], *options)[1]
            self.assertEqual(answer.returncode, 2)
            self.assertIn(why, answer.stderr)


class Files(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_presets_are_valid(self):
        for name in ("ablation-pair", "ablation-assist"):
            answer = system.run("validate", system.PRESETS / "cooperative" / f"{name}.yaml")
            self.assertEqual(answer.returncode, 0, answer.stderr)
            self.assertIn(f"cooperative robot {name}", answer.stdout)

    def test_bad_values_are_named_with_their_place(self):
        cases = [
            (PAIR, "tendon_offset_mm: 0.9", "tendon_offset_mm: 1.9", "tendon_offset", "half the outer diameter"),
            (PAIR, "tendon_offset_mm: 0.9", "tendon_offset_mm: 0.9\n    wire_stiffness_N_per_m: 6300", "wire_stiffness",
             "expected `actuation: displacement`"),
            (PAIR, "inner_diameter_mm: 1.5", "inner_diameter_mm: 3", "inner_diameter", "less than the outer diameter"),
            (PAIR, "lower_mm: 10", "lower_mm: -10", "insertion.lower", "none below zero"),
            (PAIR, "lower_mm: 10", "lower_mm: 200", "insertion.lower", "expected less than upper_mm"),
            (PAIR, "insertion_mm: 60, roll", "insertion_mm: 600, roll", "home.insertion", "limits of this joint"),
            (PAIR, "{arm: arm_b", "{arm: arm_a", "contacts[1].arm", "at most once"),
            (PAIR, "{arm: arm_b", "{arm: arm_x", "contacts[1].arm", "an arm of this robot: arm_a, arm_b"),
            (PAIR, "type: rigid", "type: softfinger", "contacts[0].type", "soft_finger"),
            (PAIR, "friction: 0.5", "friction: 0", "contacts[0].friction", "more than 0"),
            (PAIR, "bending_stiffness_Nm2: 4.31e-4", "bending_stiffness: 4.31e-4", "bending_stiffness", "without its unit"),
            (PAIR, "name: arm_b", "name: arm_a", "arms[1].name", "a second time"),
            (ASSIST, "assist: assist,", "assist: target,", "assistance.assist", "which is the target"),
            (ASSIST, "position_mm: [-95.26, 0, 65]", "position_mm: [-80, 0, 65]", "assistance.assist",
             "from the target's base of bending"),
        ]
        for text, old, new, key, why in cases:
            with self.subTest(new=new):
                self.assertIn(old, text)
                path = self.folder / "bad.yaml"
                path.write_text(text.replace(old, new, 1))
                answer = system.run("validate", path)
                self.assertEqual(answer.returncode, 2)
                self.assertRegex(answer.stderr, r"bad\.yaml:\d+:\d+: ")
                self.assertIn(key.split(".")[-1], answer.stderr)
                self.assertIn(why, answer.stderr)

    def test_a_robot_of_another_kind_is_refused(self):
        answer = system.run("cooperative", "mobility", "--robot", system.PRESETS / "robots" / "ark2024.yaml")
        self.assertEqual(answer.returncode, 2)
        self.assertIn("cooperative/1", answer.stderr)
        for command, name, why in (("target-assist", "ablation-pair", "assistance"),
                                   ("co-manipulate", "ablation-assist", "object")):
            answer = system.run("cooperative", command, "--robot", name)
            self.assertEqual(answer.returncode, 2)
            self.assertIn(f"{why}: found none", answer.stderr)


class Demonstrations(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tandem-test-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_mobility_is_that_of_the_paper(self):
        answer = system.run("cooperative", "mobility", "--json")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        found = {row["contact"]: row for row in json.loads(answer.stdout)}
        self.assertEqual({name: row["mobility"] for name, row in found.items()},
                         {"rigid": 1, "soft_finger": 4, "point": 6})
        self.assertEqual(found["rigid"]["movable"], ["translation along z"])
        self.assertEqual(len(found["rigid"]["missing"]), 5)
        self.assertIn("the object can move although every arm stands still", found["point"]["degenerate"])
        for row in found.values():  # two arms are stiffer than one, in the direction of the least stiffness
            self.assertGreater(row["stiffness_N_per_m"][0], 0.0)

    def test_co_manipulation(self):
        path = self.folder / "run.csv"
        answer = system.run("cooperative", "co-manipulate", "--offline", "--json", "--csv", path, "--figure",
                            self.folder / "run.png", timeout=120)
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        found = json.loads(answer.stdout)
        self.assertTrue(found["good"])
        self.assertLess(found["max_residual_m"], 1e-4)
        self.assertLess(found["max_error_m"], 1e-3)
        rows = list(csv.DictReader(open(path, encoding="utf-8")))
        along = [row for row in rows if float(row["time"]) >= 0]
        self.assertEqual(len(along), found["periods"])
        self.assertAlmostEqual(max(float(row["error"]) for row in along), found["max_error_m"], places=12)
        self.assertGreater((self.folder / "run.png").stat().st_size, 10000)

    def test_a_request_outside_the_movable_directions_is_refused_with_the_reason(self):
        answer = system.run("cooperative", "co-manipulate", "--offline", "--contact", "rigid", "--shape", "circle",
                            "--along", "x,y")
        self.assertEqual(answer.returncode, 1)
        self.assertIn("refused: ", answer.stdout)
        self.assertIn("not possible: ", answer.stdout)

    def test_an_object_is_driven_along_a_lissajous_by_friction(self):
        answer = system.run("cooperative", "co-manipulate", "--offline", "--contact", "soft_finger", "--squeeze", "0.002",
                            "--load=0,0,-0.0003", "--shape", "lissajous", "--along", "y,z", "--hold", "places",
                            "--json", timeout=120)
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        found = json.loads(answer.stdout)
        self.assertLess(found["max_residual_m"], 1e-4)
        self.assertLess(max(found["facts"][f"friction_used_arm_{arm}"][1] for arm in "ab"), 1.0)

    def test_a_grip_moves_a_load_and_states_the_internal_force_that_stays(self):
        path = self.folder / "run.csv"
        answer = system.run("cooperative", "co-manipulate", "--offline", "--shape", "line", "--along", "z",
                            "--load=0,0,-1e-3", "--json", "--csv", path, timeout=120)
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        found = json.loads(answer.stdout)
        self.assertEqual((found["periods"], found["refused"], found["stopped"]), (1001, "", ""))
        self.assertLess(found["max_error_m"], 1e-5)
        rows = [row for row in csv.DictReader(open(path, encoding="utf-8")) if float(row["time"]) >= 0]
        for name in ("internal_error_N", "internal_error_Nm", "uncontrolled_m"):
            ends = [min(float(row[name]) for row in rows), max(float(row[name]) for row in rows)]
            for end, stated in zip(ends, found["facts"][name]):
                self.assertAlmostEqual(end, stated, places=12)
            self.assertGreater(ends[0], 0.0)

    def test_a_grasp_that_would_slip_is_refused_with_the_squeeze_that_would_do(self):
        answer = system.run("cooperative", "co-manipulate", "--offline", "--contact", "point", "--squeeze", "0.001",
                            "--load=0,0,-0.01")
        self.assertEqual(answer.returncode, 1)
        self.assertIn("found a squeeze of 0.001 N, expected more than", answer.stdout)
        answer = system.run("cooperative", "co-manipulate", "--offline", "--load", "0,0")
        self.assertEqual(answer.returncode, 2)
        self.assertIn("--load", answer.stderr)

    def test_services_run_the_file_as_it_is(self):
        for option, value in (("--contact", "point"), ("--squeeze", "0.002"), ("--load", "0,0,1")):
            answer = system.run("cooperative", "co-manipulate", option, value)
            self.assertEqual(answer.returncode, 2)
            self.assertIn(f"{option}: needs --offline", answer.stderr)
            self.assertIn("add --offline, or change the robot file", answer.stderr)

    def test_compliance_by_actuation_and_stiffness_of_the_wires(self):
        """A straight bending section under a force across its end, with the shaft inside the port and without a tool: closed forms."""
        bending, length, stiffness, offset = 4.31e-4, 0.065, 6300.0, 0.9e-3
        elasticity = bending / (stiffness * offset**2 * length)
        free, locked = length**3 / (3 * bending), length**3 / (12 * bending)
        for keys, expected in (("", free), ("actuation: displacement", locked),
                               (f"actuation: displacement\n    wire_stiffness_N_per_m: {stiffness}",
                                free - (free - locked) / (1 + elasticity))):
            path = self.folder / "pair.yaml"
            text = PAIR.replace("tool: {position_mm: [0, 0, 15]}", "tool: {position_mm: [0, 0, 0]}", 1)
            text = text.replace("insertion: {lower_mm: 10,", "insertion: {lower_mm: 0,")
            path.write_text(text.replace("tendon_offset_mm: 0.9", f"tendon_offset_mm: 0.9\n    {keys}", 1))
            answer = system.run("fk", "--robot", path, "--arm", "arm_a", "--model", "cosserat", "--compliance", "--json",
                                text="0,0,0\n")
            self.assertEqual(answer.returncode, 0, answer.stderr)
            row = json.loads(answer.stdout)[0]
            self.assertAlmostEqual(row["c11"] / expected, 1.0, delta=0.005, msg=keys)  # shear gives the rest

    def test_payload_of_the_pair_and_of_each_arm(self):
        answer = system.run("cooperative", "payload", "--json", "--directions", 8, "--finest-deg", 2, "--figure",
                            self.folder / "load.png",
                            timeout=120)
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        pair, *alone = json.loads(answer.stdout)["carriers"]
        self.assertEqual([carrier["name"] for carrier in alone], ["arm_a", "arm_b"])
        for carrier in alone:
            for one, all_arms in zip(carrier["directions"], pair["directions"]):
                self.assertLess(one["stiffness_N_per_m"], all_arms["stiffness_N_per_m"])
                self.assertGreater(one["payload_N"], 0.0)
        rows = list(csv.DictReader(open(self.folder / "load.csv", encoding="utf-8")))
        self.judge_refinement(rows)
        first = next(row for row in rows if row["carrier"] == "0")
        self.assertAlmostEqual(float(first["payload"]), pair["directions"][0]["payload_N"], places=9)
        self.assertGreater((self.folder / "load.png").stat().st_size, 10000)

    def judge_refinement(self, rows):
        """Neighbours differ by at most 5 %, or are at most as far apart as asked; planes are closed circles."""
        self.assertGreater(len(rows), 3 * 3 * 8)
        for carrier in "012":
            for plane in "012":
                ring = [[float(row[key]) for key in ("angle", "payload", "stiffness")]
                        for row in rows if (row["carrier"], row["plane"]) == (carrier, plane)]
                self.assertEqual(ring, sorted(ring))
                for one, other in zip(ring, ring[1:] + [[ring[0][0] + 2 * math.pi, *ring[0][1:]]]):
                    near = all(abs(a - b) <= 0.05 * max(a, b) for a, b in zip(one[1:], other[1:]))
                    self.assertTrue(near or other[0] - one[0] < math.radians(2.01), (carrier, plane, one, other))

    def test_target_assist(self):
        answer = system.run("cooperative", "target-assist", "--offline", "--json", "--figure", self.folder / "run.png",
                            timeout=120)
        self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
        found = json.loads(answer.stdout)
        self.assertLess(found["max_residual_m"], 1e-8)
        self.assertLess(found["max_error_m"], 1e-3)
        self.assertGreater(found["facts"]["push_N"][0], 0.0)
        self.assertGreater((self.folder / "run.png").stat().st_size, 10000)

    def test_reach_with_assistance_is_beyond(self):
        answer = system.run("cooperative", "reach", "--json", "--samples", 800, "--figure", self.folder / "reach.png",
                            timeout=200)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        found = json.loads(answer.stdout)
        self.assertEqual(found["samples"], 800)
        bounds = found["bounds"]
        self.assertEqual([row["most_force_N"] for row in bounds], [0.1, 0.2, 0.5, 1.0])
        self.assertEqual(bounds[-1]["counted"] + sum(found["excluded"].values()), 800)
        self.assertGreater(bounds[-1]["gained_m3"], 0.0)
        for one, other in zip(bounds, bounds[1:]):
            self.assertLessEqual(one["farthest_m"], other["farthest_m"])
            self.assertLess(one["counted"], other["counted"])
        rows = [row for row in csv.DictReader(open(self.folder / "reach.csv", encoding="utf-8")) if row["status"] == "ok"]
        self.assertEqual(len(rows), bounds[-1]["counted"])
        self.assertAlmostEqual(max(float(row["beyond"]) for row in rows), bounds[-1]["farthest_m"], places=12)
        self.assertLessEqual(max(float(row["force"]) for row in rows), 1.0)
        self.assertLessEqual(max(float(row["strain"]) for row in rows), 0.08)
        self.assertGreaterEqual(min(float(row["advance"]) for row in rows), -1e-9)
        self.assertLess(bounds[0]["farthest_m"], bounds[-1]["farthest_m"])
        answer = system.run("cooperative", "reach", "--json", "--samples", 800, "--most-force", 1e6, "--most-strain", 1)
        self.assertGreater(json.loads(answer.stdout)["bounds"][0]["counted"], bounds[-1]["counted"])
        self.assertGreater((self.folder / "reach.png").stat().st_size, 10000)


if __name__ == "__main__":
    system.main()
