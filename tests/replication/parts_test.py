# SPDX-License-Identifier: Apache-2.0
"""Parts of the replication: the model against differences, the QP solver against all active sets, and a comparison that fails."""
import itertools
import unittest

import numpy as np

import comparison
import methods
import paper
import protocol
import qp
import tubes

SEED = 20241


def random_joints(random):
    """Joints of one arm that satisfy equation (1), with section boundaries at least 1 mm apart."""
    while True:
        q = np.append(-random.uniform(0.02, 0.28, 3), random.uniform(-np.pi, np.pi, 3))
        lower, upper = methods.interval(q[:3])
        boundaries = np.sort(np.concatenate([q[:3] + paper.STRAIGHT, q[:3] + paper.LENGTH, [0.0]]))
        if (q[:3] >= lower).all() and (q[:3] <= upper).all() and np.diff(boundaries).min() > 1e-3:
            return q


class Model(unittest.TestCase):
    def test_jacobian_is_the_derivative_of_the_tip(self):
        random = np.random.default_rng(SEED)
        for _ in range(50):
            q = random_joints(random)
            differences = np.column_stack([(tubes.tip(q + h, False)[0] - tubes.tip(q - h, False)[0]) / 2e-6 for h in 1e-6 * np.eye(6)])
            np.testing.assert_allclose(tubes.tip(q)[1], differences, atol=1e-9, err_msg=f"seed {SEED}, q {q}")

    def test_tips_are_where_the_figures_of_the_paper_have_them(self):
        """docs/reproduction.md: z = 323.8, 281.6, 176.8 mm of robot A in the three configurations."""
        heights = [tubes.tip(q[:6], False)[0][2] / paper.MM for q in paper.CONFIGURATIONS.values()]
        np.testing.assert_allclose(heights, [323.8, 281.6, 176.8], atol=0.05)

    def test_one_tube_alone_is_an_arc_towards_x(self):
        """Tube 1 extends 50 mm, its curved length, out of tubes that are straight up to their ends at the entry point."""
        q = np.array([-387, -317, -199, 0, 0, 0]) * np.array([paper.MM] * 3 + [1] * 3)
        k = paper.CURVATURE[0]
        np.testing.assert_allclose(tubes.tip(q, False)[0], [(1 - np.cos(0.05 * k)) / k, 0, np.sin(0.05 * k) / k], atol=1e-15)


class QuadraticProgrammes(unittest.TestCase):
    def test_the_solution_is_the_best_of_all_active_sets(self):
        random = np.random.default_rng(SEED)
        solved = infeasible = 0
        for case in range(60):
            n, rows = 5, random.normal(size=(7, 5))
            root = random.normal(size=(n, n))
            problem = (root @ root.T + 1e-3 * np.eye(n), random.normal(size=n), random.normal(size=(2, n)), random.normal(size=2),
                       rows, random.uniform(-0.6, 1, size=7))
            best = self.best(*problem)
            if best is None:
                infeasible += 1
                with self.assertRaises(qp.Infeasible, msg=f"seed {SEED}, case {case}"):
                    qp.solve(*problem)
            else:
                solved += 1
                np.testing.assert_allclose(qp.solve(*problem)[0], best, atol=1e-7, err_msg=f"seed {SEED}, case {case}")
        self.assertGreater(min(solved, infeasible), 5)

    @staticmethod
    def best(hessian, gradient, equal, value, rows, bound):
        """Feasible minimiser over every choice of active rows; None if there is none."""
        n, found = len(gradient), []
        for count in range(n - len(value) + 1):
            for active in itertools.combinations(range(len(bound)), count):
                held = np.vstack([equal, rows[list(active)]])
                kkt = np.block([[hessian, held.T], [held, np.zeros((len(held), len(held)))]])
                x = np.linalg.solve(kkt, np.concatenate([-gradient, value, bound[list(active)]]))[:n]
                if (rows @ x <= bound + 1e-9).all():
                    found.append((x @ hessian @ x / 2 + gradient @ x, tuple(x)))
        return np.array(min(found)[1]) if found else None

    def test_the_optimality_conditions_refuse_any_other_answer(self):
        """min x^2/2 - x, x <= 0.5: x = 0.5 with the multiplier 0.5."""
        problem = (np.eye(1), -np.ones(1), np.zeros((0, 1)), np.zeros(0), np.ones((1, 1)), np.array([0.5]))
        for x, multiplier, right in ((0.5, 0.5, True), (0.4, 0.6, False), (1.0, 0.0, False), (0.5, 0.4, False), (2.0, -1.0, False)):
            residual = qp.kkt_residual(*problem, np.array([x]), np.array([multiplier]), np.zeros(0))
            self.assertEqual(residual < qp.TOLERANCE, right, (x, multiplier))


class Loop(unittest.TestCase):
    def test_qp_methods_keep_equation_1_and_scale_what_limits_forbid(self):
        q = paper.CONFIGURATIONS["2"]
        (_, ja), (_, jb) = tubes.tip(q[:6]), tubes.tip(q[6:])
        step = methods.Step(q, ja, jb, np.zeros(3), np.array([0, 0, 0.1]))
        velocity = methods.snsqp(step)
        rows, bounds = methods.velocity_limits(q, paper.SNSQP_ROTATION_SPEED)
        self.assertTrue((rows @ velocity <= bounds + 1e-12).all())
        done = ja @ velocity[:6]
        self.assertGreater(done[2], 1e-3)
        self.assertLess(done[2], 0.05)
        np.testing.assert_allclose(done[:2], 0, atol=1e-12)
        np.testing.assert_allclose(methods.relative_jacobian(step) @ velocity, 0, atol=1e-12)

    def test_targets_are_evenly_spaced(self):
        """A chord of the Lissajous is up to 3 % shorter than its arc of 0.943 mm."""
        for name, spacing, shorter in (("rectangle", 0.8, 1e-9), ("lissajous", 0.943, 0.03)):
            points = np.vstack([np.zeros(3), paper.trajectory(name, "1")])
            steps = np.linalg.norm(np.diff(points, axis=0), axis=1) / paper.MM
            self.assertAlmostEqual(steps.max(), spacing, delta=1e-4)
            self.assertGreater(steps.min(), spacing * (1 - shorter))
            np.testing.assert_allclose(points[-1], 0, atol=1e-12)


class Comparison(unittest.TestCase):
    def test_each_deviation_is_reported(self):
        def run(**changes):
            values = dict(trajectory="rectangle", configuration="1", method="nspqp", points=100, converged=100, iterations=200, gate=0,
                          relative=protocol.Errors(0.1, 0.01, 0.2), tip=protocol.Errors(0.7, 0.01, 0.8), joints=np.zeros((200, 12)))
            return protocol.Run(**{**values, **changes})

        moved = np.zeros((200, 12))
        moved[50, 7] = 3e-5
        ours = run()
        key = comparison.key(ours)
        self.assertEqual(comparison.compare([ours], {key: run(iterations=202)}), [])
        for text, changed in (("iterations", run(iterations=203)),
                              ("interventions of the gate", run(gate=3)),
                              ("points reached", run(converged=99)),
                              ("std of the tip error", run(tip=protocol.Errors(0.7, 0.011, 0.8))),
                              ("max of the relative error", run(relative=protocol.Errors(0.1, 0.01, np.nan))),
                              ("joints differ", run(joints=moved))):
            found = comparison.compare([ours], {key: changed})
            self.assertEqual(len(found), 1, found)
            self.assertIn(text, found[0])
        self.assertIn("no such run", comparison.compare([ours], {})[0])


if __name__ == "__main__":
    unittest.main()
