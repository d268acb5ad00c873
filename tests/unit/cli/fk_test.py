# SPDX-License-Identifier: Apache-2.0
"""tandem fk compared with kinematics written from the paper."""
import csv
import io
import json
import math
import pathlib
import re
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import compliant_tubes  # noqa: E402
import system  # noqa: E402
import tubes  # noqa: E402

POSE = ["x", "y", "z", "qx", "qy", "qz", "qw"]


def text(rows):
    return "".join(",".join(repr(value) for value in row) + "\n" for row in rows)


def fk(rows, *options):
    """Results as dictionaries, the header, and the exit code. `rows`: a text or lists of numbers."""
    answer = system.run("fk", "--csv", "-", *options, text=rows if isinstance(rows, str) else text(rows))
    table = list(csv.reader(io.StringIO(answer.stdout)))
    assert all(len(line) == len(table[0]) for line in table), answer.stdout
    return [dict(zip(table[0], line)) for line in table[1:]], table[0], answer.returncode


def numbers(row, names):
    return [float(row[name]) for name in names]


def turn(matrix):
    """Rotation vector of a small rotation."""
    axis = [0.5 * (matrix[i][j] - matrix[j][i]) for i, j in ((2, 1), (0, 2), (1, 0))]
    sine = tubes.norm(axis)
    return [x * math.asin(sine) / sine for x in axis] if sine > 0 else axis


def material(q, arm="a", length=None):
    """The backbone's pose, rotated with tube 1."""
    c, s = math.cos(q[3]), math.sin(q[3])
    return tubes.multiply(tubes.transform(q, arm, length), [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


class ForwardKinematics(unittest.TestCase):
    def assert_pose(self, row, expected, place):
        values = numbers(row, POSE)
        self.assertLess(tubes.norm(tubes.minus(values[:3], tubes.position(expected))), 1e-9, place)
        self.assertAlmostEqual(tubes.norm(values[3:]), 1.0, delta=1e-12)
        for got, want in zip(tubes.rotation_of_quaternion(*values[3:]), tubes.rotation(expected)):
            for x, y in zip(got, want):
                self.assertAlmostEqual(x, y, delta=1e-9, msg=place)

    def test_random_rows(self):
        rng = system.seeded(self)
        for arm in "ab":
            rows = [tubes.random_joints(rng) for _ in range(200)]
            answers, header, code = fk(rows, "--arm", arm)
            self.assertEqual(code, 0)
            self.assertEqual(header, POSE + ["stability", "status"])
            self.assertEqual(len(answers), len(rows))
            for q, row in zip(rows, answers):
                self.assertEqual(row["status"], "ok", q)
                self.assertEqual(float(row["stability"]), 1.0)
                self.assert_pose(row, material(q, arm), f"{arm} {q}")

    def test_json_has_the_same_numbers(self):
        rng = system.seeded(self)
        rows = [tubes.random_joints(rng) for _ in range(20)]
        answers, header, _ = fk(rows)
        objects = json.loads(system.run("fk", "--json", text=text(rows)).stdout)
        self.assertEqual(len(objects), len(rows))
        for row, entry in zip(answers, objects):
            self.assertEqual(list(entry), header)
            self.assertEqual(numbers(row, header[:-1]), [entry[name] for name in header[:-1]])

    def test_jacobian_against_central_differences(self):
        rng = system.seeded(self)
        step = 1e-5
        names = [f"j{i}{j}" for i in range(1, 7) for j in range(1, 7)]
        rows = []
        while len(rows) < 30:
            q = tubes.random_joints(rng, margin=3 * step)
            edges = tubes.boundaries(q)
            if min(b - a for a, b in zip(edges, edges[1:])) > 3 * step:  # the derivative jumps where sections vanish
                rows.append(q)
        answers, header, code = fk(rows, "--jacobian")
        self.assertEqual(code, 0)
        self.assertEqual(header, POSE + ["stability"] + names + ["status"])
        moved = []
        for q in rows:
            for joint in range(6):
                for sign in (1.0, -1.0):
                    moved.append([x + sign * step * (i == joint) for i, x in enumerate(q)])
        around, _, code = fk(moved)
        self.assertEqual(code, 0)
        for i, row in enumerate(answers):
            for joint in range(6):
                plus, minus = (numbers(around[12 * i + 2 * joint + k], POSE) for k in (0, 1))
                linear = [(a - b) / (2 * step) for a, b in zip(plus[:3], minus[:3])]
                relative = tubes.multiply(tubes.rotation_of_quaternion(*plus[3:]),
                                          tubes.transposed(tubes.rotation_of_quaternion(*minus[3:])))
                column = linear + [x / (2 * step) for x in turn(relative)]
                for axis in range(6):
                    self.assertAlmostEqual(float(row[f"j{axis + 1}{joint + 1}"]), column[axis], delta=5e-8,
                                           msg=f"row {axis + 1}, joint {joint + 1} at {rows[i]}")

    def test_shape(self):
        rng = system.seeded(self)
        points = 41
        rows = [tubes.random_joints(rng) for _ in range(20)]
        answers, header, code = fk(rows, "--arm", "b", "--shape", str(points))
        tips, _, _ = fk(rows, "--arm", "b")
        self.assertEqual(code, 0)
        self.assertEqual(header, ["row", "s"] + POSE + ["psi_1", "psi_2", "psi_3", "status"])
        self.assertEqual(len(answers), points * len(rows))
        for i, q in enumerate(rows):
            shape = answers[points * i:points * (i + 1)]
            self.assertEqual({row["row"] for row in shape}, {str(i + 1)})
            self.assertEqual(numbers(shape[0], ["s", "x", "y", "z"]), [0, 0, tubes.BASE_Y["b"], 0])
            length = q[0] + tubes.LENGTH[0]
            self.assertAlmostEqual(float(shape[-1]["s"]), length, delta=1e-12)
            for last, tip in zip(numbers(shape[-1], POSE), numbers(tips[i], POSE)):
                self.assertAlmostEqual(last, tip, delta=1e-12)
            for k, row in enumerate(shape):
                s = length * k / (points - 1)
                self.assertAlmostEqual(float(row["s"]), s, delta=1e-12)
                self.assert_pose(row, material(q, "b", s), f"s = {s} at {q}")
                for tube in range(3):
                    beyond = s - q[tube] - tubes.LENGTH[tube]
                    if abs(beyond) > 1e-9:
                        self.assertEqual(row[f"psi_{tube + 1}"] == "", beyond > 0, f"tube {tube + 1}, s = {s} at {q}")
                    if row[f"psi_{tube + 1}"]:
                        self.assertEqual(float(row[f"psi_{tube + 1}"]), q[3 + tube])


class CompliantTubes(unittest.TestCase):
    def compliant(self, rows, *options, code=0):
        answers, header, got = fk(rows, "--model", "compliant", *options)
        self.assertEqual(got, code, {row["status"] for row in answers})
        self.assertEqual(len(answers), len(rows))
        return answers, header

    def test_end_angles_against_runge_kutta(self):
        rng = system.seeded(self)
        rows = [compliant_tubes.random_overlap(rng) for _ in range(12)]
        answers, header, _ = fk(rows, "--model", "compliant", "--end-angles")
        self.assertEqual(header, POSE + ["stability", "alpha_1", "alpha_2", "alpha_3", "status"])
        turned = 0
        for q, row in zip(rows, answers):
            alpha, tip = compliant_tubes.from_ends(q[:3], q[3:])
            for i in range(3):
                self.assertAlmostEqual(float(row[f"alpha_{i + 1}"]), alpha[i], delta=1e-7, msg=q)
            self.assertLess(tubes.norm(tubes.minus(numbers(row, POSE[:3]), tip)), 1e-8, q)
            turned += max(abs(a - t) for a, t in zip(alpha, q[3:])) > 0.1
        self.assertGreater(turned, 6, "the tubes hardly twist: the test says nothing")

    def test_a_cold_start_is_an_equilibrium(self):
        rng = system.seeded(self)
        rows = [compliant_tubes.random_overlap(rng) for _ in range(60)]
        answers, header = self.compliant(rows, "--branch")
        self.assertEqual(header, POSE + ["stability", "stability_at", "conjugate_points"] +
                         [f"{name}_{i}" for name in ("winding", "theta") for i in (1, 2, 3)] + ["status"])
        for q, row in zip(rows, answers):
            self.assertEqual((row["status"], row["conjugate_points"]), ("ok", "0"))
            self.assertGreater(float(row["stability"]), 0.0)
            self.assertLessEqual(float(row["stability"]), 1.0)
            theta = numbers(row, ["theta_1", "theta_2", "theta_3"])
            for i in (2, 3):
                self.assertEqual(int(row[f"winding_{i}"]), math.floor((theta[i - 1] - theta[0]) / math.tau + 0.5))
            alpha, tip = compliant_tubes.from_ends(q[:3], theta, steps=20)
            for a, b in zip(alpha, q[3:]):
                self.assertAlmostEqual(a, b, delta=1e-6)
            self.assertLess(tubes.norm(tubes.minus(numbers(row, POSE[:3]), tip)), 1e-7, q)

    def test_jacobian_against_central_differences(self):
        rng = system.seeded(self)
        step = 1e-5
        rows = [compliant_tubes.random_overlap(rng) for _ in range(5)]
        answers, _ = self.compliant(rows, "--jacobian")
        for q, row in zip(rows, answers):
            for joint in range(6):
                # One path from q, so that all are on the same branch; of fourth order, as the third derivative is large near
                # the limit of stability.
                path = [q] + [[x + k * step * (i == joint) for i, x in enumerate(q)] for k in (1, -1, 2, -2)]
                at = [numbers(each, POSE[:3]) for each in self.compliant(path, "--follow")[0][1:]]
                for axis in range(3):
                    near, far = at[0][axis] - at[1][axis], at[2][axis] - at[3][axis]
                    slope = (8 * near - far) / (12 * step)
                    self.assertAlmostEqual(float(row[f"j{axis + 1}{joint + 1}"]), slope, delta=2e-6 * (1 + abs(slope)))

    def test_following_a_turn_snaps_and_says_so(self):
        turn = [compliant_tubes.EXTENDED + [0.0, 0.0, math.radians(4 * k)] for k in range(136)]
        answers, _ = self.compliant(turn, "--follow", "--branch")
        snaps = [k for k, row in enumerate(answers) if "snapped" in row["status"]]
        self.assertTrue(snaps, "no snap over one and a half turns")
        for k, row in enumerate(answers):
            self.assertTrue(row["status"].startswith("ok"), row["status"])
            jump = tubes.norm(tubes.minus(numbers(row, POSE[:3]), numbers(answers[max(k - 1, 0)], POSE[:3])))
            self.assertEqual(jump > 0.004, k in snaps, f"row {k + 1} moves by {jump} m: {row['status']}")
        # Turned back, the arm remains on the new branch: hysteresis.
        before = snaps[0] - 1
        back, _ = self.compliant(turn[:snaps[0] + 1] + [turn[before]], "--follow")
        self.assertEqual(back[-1]["status"], "ok")
        self.assertGreater(tubes.norm(tubes.minus(numbers(back[-1], POSE[:3]), numbers(answers[before], POSE[:3]))),
                           0.005)
        # Separate rows are cold starts: none reports a snap.
        self.assertEqual({row["status"] for row in self.compliant(turn)[0]}, {"ok"})

    def test_compliance_is_the_derivative_by_the_wrench(self):
        rng = system.seeded(self)
        # Near the limit of stability the tip's third derivative by the moments is 1e8 times the first: short steps.
        step = [1e-5] * 3 + [1e-6] * 3
        for _ in range(3):
            q = compliant_tubes.random_overlap(rng)
            force = [rng.uniform(-0.1, 0.1) for _ in range(3)] + [0.0] * 3
            base, = self.compliant([q], "--compliance", "--wrench", ",".join(map(repr, force)))[0]
            for column in range(6):
                moved = []
                for sign in (1, -1):
                    wrench = [x + sign * step[column] * (i == column) for i, x in enumerate(force)]
                    row, = self.compliant([q], "--wrench", ",".join(map(repr, wrench)))[0]
                    moved.append(numbers(row, POSE[:3]))
                for axis in range(3):
                    slope = (moved[0][axis] - moved[1][axis]) / (2 * step[column])
                    self.assertAlmostEqual(float(base[f"c{axis + 1}{column + 1}"]), slope,
                                           delta=1e-4 * abs(slope) + 2e-5, msg=f"{axis + 1}{column + 1} at {q}")

    def test_no_wrench_is_a_wrench_of_zero(self):
        rng = system.seeded(self)
        rows = [compliant_tubes.random_overlap(rng) for _ in range(5)]
        without, _ = self.compliant(rows)
        zero, _ = self.compliant(rows, "--wrench", "0,0,0,0,0,0")
        for a, b in zip(without, zero):
            self.assertLess(tubes.norm(tubes.minus(numbers(a, POSE[:3]), numbers(b, POSE[:3]))), 1e-8)

    def test_shape_details(self):
        rng = system.seeded(self)
        points = 31
        q = compliant_tubes.random_overlap(rng)
        shape, header, code = fk([q], "--model", "compliant", "--shape", str(points), "--shape-details")
        self.assertEqual(code, 0)
        self.assertEqual(header, ["row", "s"] + POSE + ["psi_1", "psi_2", "psi_3", "curvature_x", "curvature_y",
                                                        "moment_1", "moment_2", "moment_3", "status"])
        plain, plain_header, _ = fk([q], "--model", "compliant", "--shape", str(points))
        self.assertEqual([[row[name] for name in plain_header] for row in shape],
                         [[row[name] for name in plain_header] for row in plain])
        tip, = self.compliant([q])[0]
        for last, value in zip(numbers(shape[-1], POSE), numbers(tip, POSE)):
            self.assertAlmostEqual(last, value, delta=1e-9)
        self.assertAlmostEqual(float(shape[-1]["moment_1"]), 0.0, delta=1e-12)
        for row in shape:  # without a load the tubes' torsional moments are in balance
            moments = [float(row[f"moment_{i}"]) for i in (1, 2, 3) if row[f"moment_{i}"]]
            self.assertAlmostEqual(sum(moments), 0.0, delta=1e-9)
        self.assertGreater(max(abs(float(shape[0][f"moment_{i}"])) for i in (1, 2, 3)), 1e-4)

    def test_wrong_use(self):
        for options, reason in [(["--shape", "5", "--jacobian"], "--jacobian"),
                                (["--shape", "5", "--compliance"], "--compliance"),
                                (["--shape-details"], "--shape N"), (["--model", "stiff"], "stiff"),
                                (["--model", "rigid", "--wrench", "1,0,0,0,0,0"], "does not deform"),
                                (["--model", "rigid", "--compliance"], "rigid"),
                                (["--model", "rigid", "--branch"], "rigid"),
                                (["--model", "rigid", "--end-angles"], "does not twist"),
                                (["--model", "compliant", "--end-angles", "--follow"], "--follow"),
                                (["--model", "compliant", "--wrench", "1,0,0"], "found 3 numbers, expected 6"),
                                (["--model", "compliant", "--wrench", "1,0,0,0,0,x"], "found 'x'")]:
            answer = system.run("fk", *options, text="")
            self.assertEqual(answer.returncode, 2, options)
            self.assertIn(reason, answer.stderr + answer.stdout, options)


class Millimetres(unittest.TestCase):
    def test_places_and_angles_of_all_tables(self):
        rng = system.seeded(self)
        rows = [compliant_tubes.random_overlap(rng) for _ in range(3)]
        for options in (["--jacobian"], ["--model", "compliant", "--branch"], ["--model", "compliant", "--end-angles"],
                        ["--shape", "7"]):
            plain, names, _ = fk(rows, *options)
            answers, said, _ = fk(rows, *options, "--mm")
            self.assertEqual(len(said), len(names))
            for row, expected in zip(answers, plain):
                for mine, name in zip(said, names):
                    if name == "status" or not expected[name]:
                        self.assertEqual(row[mine], expected[name])
                        continue
                    factor = {"_mm": 1e3, "_deg": 180 / math.pi, "": 1.0}[mine.removeprefix(name)]
                    self.assertAlmostEqual(float(row[mine]), factor * float(expected[name]), delta=1e-9 * (1 + abs(float(row[mine]))))
            self.assertTrue({"x_mm", "y_mm", "z_mm"} <= set(said), said)
            self.assertEqual([name for name in said if name.startswith(("alpha", "theta", "psi")) and "_deg" not in name], [])


class Headers(unittest.TestCase):
    """A header names columns in any order, with units, among others: the answers are those of the same rows in SI."""

    def test_random_orders_and_units(self):
        rng = system.seeded(self)
        units = [{"": 1.0, "_m": 1.0, "_mm": 1e-3}] * 3 + [{"": 1.0, "_rad": 1.0, "_deg": math.pi / 180}] * 3
        names = ["beta_1", "beta_2", "beta_3", "alpha_1", "alpha_2", "alpha_3"]
        for _ in range(5):
            rows = [tubes.random_joints(rng) for _ in range(3)]
            order = rng.sample(range(7), 7)  # 6: a column of text
            chosen = [rng.choice(list(each.items())) for each in units]
            lines = [",".join(names[k] + chosen[k][0] if k < 6 else "note" for k in order)]
            for row in rows:
                lines.append(",".join(repr(row[k] / chosen[k][1]) if k < 6 else "a text" for k in order))
            answers, _, code = fk("\n".join(lines) + "\n")
            plain, _, _ = fk(rows)
            self.assertEqual(code, 0, answers)
            for answer, expected in zip(answers, plain):
                for a, b in zip(numbers(answer, POSE), numbers(expected, POSE)):
                    self.assertAlmostEqual(a, b, delta=1e-12, msg=lines[0])

    def test_wrong_headers(self):
        good = "beta_1_mm,beta_2,beta_3,alpha_1,alpha_2,alpha_3"
        for header, says in ((good.replace("beta_1_mm", "beta_1_deg"), "found no column beta_1 in 'beta_1_deg"),
                             (good.replace(",alpha_3", ""), "expected alpha_3_deg, alpha_3_rad"),
                             (good + ",beta_1", "found column beta_1 twice")):
            answer = system.run("fk", "--csv", "-", text=header + "\n0,0,0,0,0,0,0\n")
            self.assertEqual(answer.returncode, 2, answer.stdout)
            self.assertIn(says, answer.stderr)
        answers, _, code = fk(good + "\n-100,-0.08,-0.05,0,0\n-100,-0.08,-0.05,0,0,nought\n")
        self.assertEqual(code, 1)
        self.assertIn("line 2: found 5 fields; expected the 6 of the header", answers[0]["status"])
        self.assertIn("line 3 column 6: found 'nought'; expected a number", answers[1]["status"])


class BadRows(unittest.TestCase):
    GOOD = "-0.1,-0.08,-0.05,0.785,0.785,0.785"

    def assert_empty(self, row, *reasons):
        self.assertEqual([name for name in row if name not in ("row", "status") and row[name] != ""], [])
        self.assertNotEqual(row["status"], "ok")
        for reason in reasons:
            self.assertIn(reason, row["status"])

    def test_a_bad_row_says_why_and_spoils_no_other(self):
        bad = [("1,2,3", "line 2", "found 3 numbers", "expected 6"), (self.GOOD + ",1", "found 7 numbers"),
               ("-0.1,-0.08,x,0,0,0", "column 3", "found 'x'"), ("-0.1,nan,-0.05,0,0,0", "column 2", "finite"),
               ("-0.1,-0.08,-0.05,inf,0,0", "column 4", "finite"), ("-0.1,-0.08,-0.05,1e999,0,0", "column 4"),
               ("", "expected"), ("-0.1,,-0.05,0,0,0", "column 2"), ("-0.1;-0.08;-0.05;0;0;0", "column 1"),
               ("-0.1,-0.08,0x10,0,0,0", "column 3")]
        rows = [self.GOOD] + [row for row, *_ in bad] + [self.GOOD]
        for options in ([], ["--jacobian"]):
            answers, header, code = fk("\n".join(rows) + "\n", *options)
            self.assertEqual(code, 1)
            self.assertEqual(header[-1], "status")
            self.assertEqual(len(answers), len(rows))
            self.assertEqual(answers[0], answers[-1])
            self.assertEqual(answers[0]["status"], "ok")
            for row, (_, *reasons) in zip(answers[1:], bad):
                self.assert_empty(row, *reasons)

    def test_rows_without_an_answer(self):
        for row, reason in [("0.01,0.02,0.03,0,0,0", "limits"), ("-0.1,-0.08,0.001,0,0,0", "limits"),
                            ("-0.2,-0.05,-0.04,0,0,0", "limits"), ("-0.437,-0.317,-0.199,0,0,0", "tube 1")]:
            for options in ([], ["--shape", "5"]):
                answers, _, code = fk(row + "\n", *options)
                self.assertEqual(code, 1)
                self.assertEqual(len(answers), 1, row)
                self.assert_empty(answers[0], reason)

    def test_rows_outside_limits(self):
        rng = system.seeded(self)
        rows = []
        while len(rows) < 50:
            q = [rng.uniform(-length, 0.05) for length in tubes.LENGTH] + [rng.uniform(-3, 3) for _ in range(3)]
            if tubes.excess(q) > 1e-6:
                rows.append(q)
        rows.append([-0.1, -0.15, -0.05, 0, 0, 0])  # carriages out of order: tips and sections exist nevertheless
        answers, _, code = fk(rows)
        self.assertEqual(code, 1)
        for q, row in zip(rows, answers):
            self.assert_empty(row, "limits")
            amount = 1e-3 * float(re.search(r" is (\S+) mm outside", row["status"]).group(1))
            self.assertAlmostEqual(amount / tubes.excess(q), 1.0, delta=1e-5)

    def test_wrong_use(self):
        self.assertEqual(system.run("fk", "--arm", "q", text="").returncode, 2)
        self.assertEqual(system.run("fk", "--csv", "/nowhere/rows.csv").returncode, 2)
        self.assertEqual(system.run("fk", "--shape", "1", text="").returncode, 2)
        self.assertEqual(system.run("fk", "--robot", "nobody", text="").returncode, 2)
        header = system.run("fk", text="")
        self.assertEqual((header.returncode, header.stdout), (0, ",".join(POSE + ["stability", "status"]) + "\n"))

    def test_what_spreadsheets_write(self):
        plain, _, _ = fk(self.GOOD + "\n")
        for variant in (self.GOOD, "\ufeff" + self.GOOD + "\r\n", self.GOOD.replace(",", " , "),
                        self.GOOD.replace(",0", ",+0")):
            answers, _, code = fk(variant)
            self.assertEqual((code, answers), (0, plain), repr(variant))


if __name__ == "__main__":
    system.main()
