# SPDX-License-Identifier: Apache-2.0
"""tandem solve: properties of every solution, whatever the solver."""
import csv
import io
import json
import math
import pathlib
import re
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import system  # noqa: E402
import tubes  # noqa: E402

PERIOD = 0.1
NSPQP_ZETA = 1e-6
SNSQP_ROTATION = 0.5
JOINTS = [f"qd_{j}" for j in range(1, 13)]
ROUNDING = 1e-9
EDGES = 1e-3  # m: at gaps of this size the approach limit is active


def solve(rows, *options):
    text = rows if isinstance(rows, str) else "".join(",".join(repr(x) for x in row) + "\n" for row in rows)
    answer = system.run("solve", *options, text=text)
    table = list(csv.reader(io.StringIO(answer.stdout)))
    assert table[0] == JOINTS + ["s_1", "s_2", "iterations", "kkt_residual", "status"], answer.stdout + answer.stderr
    assert all(len(line) == len(table[0]) for line in table)
    return [dict(zip(table[0], line)) for line in table[1:]], answer.returncode


def methods():
    """The built-in methods, from the message for an unknown one, which also lists the method of libraries."""
    message = system.run("solve", "--method", "magic", text="").stderr
    *names, foreign = message.split("expected ")[1].strip().split(", ")
    assert foreign == "or foreign with a method_library", message
    return names


def velocity(row):
    return [float(row[name]) for name in JOINTS]


def jacobians(rows):
    """Linear Jacobians (3 x 6) of both tips for every row, by `tandem fk`."""
    found = []
    for arm, first in (("a", 0), ("b", 6)):
        text = "".join(",".join(repr(x) for x in row[first:first + 6]) + "\n" for row in rows)
        table = csv.DictReader(io.StringIO(system.run("fk", "--arm", arm, "--jacobian", text=text).stdout))
        found.append([[[float(line[f"j{i}{j}"]) for j in range(1, 7)] for i in (1, 2, 3)] for line in table])
    return list(zip(*found))


def of_tasks(pair):
    """J_AB and J_A over twelve joints."""
    a, b = pair
    return ([list(x) + [-y for y in z] for x, z in zip(a, b)], [list(x) + [0.0] * 6 for x in a])


def approach(distance, velocity_limit=tubes.VELOCITY):
    """Section 2.3 of the paper: after one period still within the limit, below V_max, and able to brake with A_max."""
    distance = max(0.0, distance)
    return min(distance / PERIOD, velocity_limit, math.sqrt(2 * tubes.APPROACH * distance))


def coupled_rates(beta):
    """(i, smallest, largest) of beta_i' - beta_{i-1}' for both pairs of neighbours."""
    for i in (1, 2):
        carriages = beta[i] - beta[i - 1]
        tips = beta[i - 1] + tubes.LENGTH[i - 1] - beta[i] - tubes.LENGTH[i]
        yield i, -approach(carriages, math.inf), approach(tips, math.inf)


class Solve(unittest.TestCase):
    def setUp(self):
        self.rng = system.seeded(self)

    def problem(self, speed=2e-3):
        """Joints inside (1), often within a millimetre of a limit, and velocities of both tasks."""
        q = []
        for _ in range(2):
            while True:
                arm = tubes.random_joints(self.rng)
                for i in (1, 2):
                    upper = min(0.0, arm[i - 1] + tubes.LENGTH[i - 1] - tubes.LENGTH[i])
                    lower = max(-tubes.LENGTH[i], arm[i - 1])
                    kind = self.rng.randrange(3)
                    if kind == 0:
                        arm[i] = min(upper, lower + self.rng.uniform(0, EDGES))
                    elif kind == 1:
                        arm[i] = max(lower, upper - self.rng.uniform(0, EDGES))
                if tubes.excess(arm) < -1e-9:
                    break
            q += arm
        return q + [self.rng.uniform(-speed, speed) for _ in range(6)]

    def solved(self, rows, *options, share=0.3):
        """Pairs of row and result of those with a solution; at least a given share of them has one."""
        answers, code = solve(rows, *options)
        self.assertEqual(len(answers), len(rows))
        self.assertEqual(code, 0 if all(a["status"] == "ok" for a in answers) else 1)
        pairs = []
        for row, answer in zip(rows, answers):
            if answer["status"] == "ok":
                self.assertLess(float(answer["kkt_residual"]), 1e-9)
                pairs.append((row, answer))
            elif answer["status"].startswith("infeasible: "):  # with the nearest feasible velocity
                self.assertTrue(all(math.isfinite(float(value)) for name, value in answer.items() if name != "status"))
            else:
                self.assertEqual([name for name in answer if name != "status" and answer[name] != ""], [])
                self.assertNotEqual(answer["status"], "")
        self.assertGreaterEqual(len(pairs), share * len(rows))
        return pairs

    def test_frozen_bounds(self):
        for method in ("nspqp", "snsqp"):
            active = 0
            rows = [self.problem() for _ in range(150)]
            for row, answer in self.solved(rows, "--method", method, "--bounds", "frozen"):
                qd = velocity(answer)
                for arm in (0, 6):
                    beta = row[arm:arm + 3]
                    for i in range(3):
                        lower = -tubes.LENGTH[i] if i == 0 else max(-tubes.LENGTH[i], beta[i - 1])
                        upper = 0.0 if i == 0 else min(0.0, beta[i - 1] + tubes.LENGTH[i - 1] - tubes.LENGTH[i])
                        least, most = -approach(beta[i] - lower), approach(upper - beta[i])
                        self.assertGreaterEqual(qd[arm + i], least - ROUNDING, (method, row))
                        self.assertLessEqual(qd[arm + i], most + ROUNDING, (method, row))
                        active += min(qd[arm + i] - least, most - qd[arm + i]) < ROUNDING
            self.assertGreater(active, 20, "the bounds were hardly felt")

    def test_coupled_rows(self):
        for method in ("nspqp", "snsqp"):
            active = 0
            for row, answer in self.solved([self.problem() for _ in range(150)], "--method", method):
                qd = velocity(answer)
                for arm in (0, 6):
                    beta = row[arm:arm + 3]
                    for i in range(3):
                        self.assertLessEqual(abs(qd[arm + i]), tubes.VELOCITY + ROUNDING)
                    for i, least, most in coupled_rates(beta):
                        rate = qd[arm + i] - qd[arm + i - 1]
                        self.assertGreaterEqual(rate, least - ROUNDING, (method, row))
                        self.assertLessEqual(rate, most + ROUNDING, (method, row))
                        active += min(rate - least, most - rate) < ROUNDING
                    after = [b + PERIOD * v for b, v in zip(beta, qd[arm:arm + 3])]
                    self.assertLessEqual(tubes.excess(after), ROUNDING, (method, row))
            self.assertGreater(active, 20, "the rows were hardly felt")

    def test_snsqp_scales_and_rotations(self):
        pairs = self.solved([self.problem(speed=8e-3) for _ in range(150)], "--method", "snsqp", share=0.99)
        below = 0
        for (row, answer), pair in zip(pairs, jacobians([row for row, _ in pairs])):
            qd, scales = velocity(answer), [float(answer["s_1"]), float(answer["s_2"])]
            for scale in scales:
                self.assertGreaterEqual(scale, -ROUNDING)
                self.assertLessEqual(scale, 1.0 + ROUNDING)
                below += scale < 0.9
            for joint in (3, 4, 5, 9, 10, 11):
                self.assertLessEqual(abs(qd[joint]), SNSQP_ROTATION + ROUNDING)
            j_ab, _ = of_tasks(pair)
            for got, want in zip(tubes.times(j_ab, qd), row[12:15]):
                self.assertAlmostEqual(got, scales[0] * want, delta=1e-8, msg=str(row))
        self.assertGreater(below, 5, "no task was scaled")

    def test_primary_task_of_nspqp(self):
        pairs = self.solved([self.problem() for _ in range(100)], "--method", "nspqp")
        for (row, answer), pair in zip(pairs, jacobians([row for row, _ in pairs])):
            j_ab, _ = of_tasks(pair)
            for got, want in zip(tubes.times(j_ab, velocity(answer)), row[12:15]):
                self.assertAlmostEqual(got, want, delta=1e-8, msg=str(row))

    def test_nspqp_is_optimal(self):
        # Solutions for other tip velocities satisfy the same constraints: none may have a better objective.
        for _ in range(10):
            base = self.problem()
            rows = [base[:15] + [self.rng.uniform(-4e-3, 4e-3) for _ in range(3)] for _ in range(12)]
            pairs = [(row, answer) for row, answer in zip(rows, solve(rows)[0]) if answer["status"] == "ok"]
            if not pairs:
                continue
            _, j_a = of_tasks(jacobians([base])[0])
            candidates = [velocity(answer) for _, answer in pairs]

            def cost(qd, wanted):
                tip = tubes.times(j_a, qd)
                return (0.5 * sum(x * x for x in tip) + 0.5 * NSPQP_ZETA * sum(x * x for x in qd) -
                        sum(x * y for x, y in zip(wanted, tip)))

            for k, (row, _) in enumerate(pairs):
                best = cost(candidates[k], row[15:18])
                for other in candidates:
                    self.assertLessEqual(best, cost(other, row[15:18]) + 1e-13, row)

    def test_target_velocity_beyond_the_limits(self):
        # All tubes bend in one plane: rotations move no tip along z, and translations are limited.
        arm = [-0.25, -0.20, -0.12, 0.0, 0.0, 0.0]
        row = arm + arm + [0.0, 0.0, 0.05, 0.0, 0.0, 0.0]
        answers, code = solve([row])
        self.assertEqual(code, 1)
        status = answers[0]["status"]
        self.assertTrue(status.startswith("infeasible: "), status)
        self.assertIn("velocity limit of tube 1 of arm a", status)
        # The result is the nearest velocity: a part of the wanted 50 mm/s along z, and nothing else.
        qd = velocity(answers[0])
        relative = tubes.times(of_tasks(jacobians([row])[0])[0], qd)
        self.assertGreater(relative[2], 0.002)
        self.assertLess(relative[2], 0.05)
        self.assertLess(max(map(abs, qd[:3] + qd[6:9])), tubes.VELOCITY + ROUNDING)
        answers, code = solve([row], "--method", "snsqp")
        self.assertEqual((code, answers[0]["status"]), (0, "ok"))
        scale = float(answers[0]["s_1"])
        self.assertGreater(scale, 0.05)
        self.assertLess(scale, 0.5)

    def test_active_set_agrees_with_ipopt(self):
        # Ipopt is an interior point method: where a bound is barely active it stops short of it, as its residual shows. The active-set
        # solver does not: solved() requires a residual below 1e-9.
        for method in ("nspqp", "snsqp"):
            rows = [self.problem() for _ in range(60)]
            ours, _ = solve(rows, "--method", method)
            judge, _ = solve(rows, "--method", method, "--backend", "ipopt")
            worst, silent = [], 0
            for row, mine, other in zip(rows, ours, judge):
                if other["status"] == "the solver reached its iteration limit":
                    silent += 1  # no verdict
                    continue
                self.assertEqual(mine["status"] == "ok", other["status"] == "ok",
                                 (method, mine["status"], other["status"], row))
                if mine["status"] == "ok":
                    worst.append(max(abs(x - y) / (1 + abs(x)) for x, y in zip(velocity(mine), velocity(other))))
            worst.sort()
            self.assertLess(silent, 4)
            self.assertGreater(len(worst), 40)
            self.assertLess(worst[int(0.9 * len(worst))], 1e-6, method)
            self.assertLess(worst[-1], 1e-3, method)

    def test_bad_rows(self):
        arms = [-0.15, -0.1, -0.05, 3.1, 1.6, 0.8, -0.13, -0.12, -0.1, 1.6, -1, -4.7]
        good = ",".join(repr(x) for x in arms + [0.0] * 6)
        bad = [("1,2", "found 2 numbers"), (good + ",0", "found 19 numbers"), (good.replace("1.6", "x", 1), "column 5"),
               (good.replace("1.6", "nan", 1), "finite"), (good.replace("-0.15", "0.01", 1), "arm a"), ("", "expected")]
        rows = [good] + [row for row, _ in bad] + [good]
        for method in methods():
            answers, code = solve("\n".join(rows) + "\n", "--method", method)
            self.assertEqual(code, 1)
            self.assertEqual(answers[0]["status"], "ok")
            self.assertEqual(velocity(answers[0]), velocity(answers[-1]))
            for answer, (_, reason) in zip(answers[1:], bad):
                self.assertEqual([name for name in answer if name != "status" and answer[name] != ""], [])
                self.assertIn(reason, answer["status"])

    def test_zero_targets_give_zero_velocity(self):
        rows = [self.problem(speed=0.0) for _ in range(20)]
        for method in methods():
            if method == "hqp":  # moves tubes away from close limits and neighbours
                continue
            for _, answer in self.solved(rows, "--method", method, share=1.0):
                self.assertLess(max(abs(x) for x in velocity(answer)), 1e-9, method)

    def test_messages_name_every_method(self):
        schema = pathlib.Path(__file__).resolve().parents[3] / "config/presets/schemas/experiment.schema.json"
        known = json.loads(schema.read_text())["properties"]["methods"]["items"]["enum"]
        self.assertEqual(methods() + ["foreign"], known)
        for command in (["solve"], ["robot", "method"]):
            words = re.split(r"[\s,]+", system.run(*command, "--help").stdout)
            self.assertLessEqual(set(known), set(words), command)

    def test_wrong_use(self):
        for options in (["--method", "magic"], ["--backend", "magic"], ["--bounds", "magic"], ["--period", "0"],
                        ["--zeta", "-1"], ["--robot", "nobody"], ["--csv", "/nowhere/rows.csv"]):
            self.assertEqual(system.run("solve", *options, text="").returncode, 2, options)


if __name__ == "__main__":
    system.main()
