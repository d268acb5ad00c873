# SPDX-License-Identifier: Apache-2.0
"""The three control methods of Alsaka et al. 2024: equations (6), (7) and (8). Velocities q' are 12 numbers, arm A's six first.

`step` is what one control step knows: joints q (12), Jacobians ja and jb (3 x 6) of both tips, velocities v_ab and v_a (3).
"""
from collections import namedtuple

import numpy as np

import paper
import qp

Step = namedtuple("Step", "q ja jb v_ab v_a")


def relative_jacobian(step):
    """J_AB of (2): x_AB = x_A - x_B (docs/methods.md)."""
    return np.hstack([step.ja, -step.jb])


def tip_jacobian(step):
    """J_A, padded with zeros for robot B as below (6)."""
    return np.hstack([step.ja, np.zeros((3, 6))])


def interval(beta):
    """Equation (1) of one arm: lower and upper bounds (3 each, m), each tube's with its inner neighbour where it is."""
    length = paper.LENGTH
    lower, upper = -length.copy(), np.zeros(3)
    for i in (1, 2):
        lower[i] = max(-length[i], beta[i - 1])
        upper[i] = min(beta[i - 1] + length[i - 1] - length[i], 0)
    return lower, upper


def _inverse_weights(q):
    """Diagonal of W_act.lim^-1 of one arm, section 2.1; 0 for a translation at its limit, whose weight is infinite.

    w_i = 1 + |dH/dbeta_i| with H of Chan and Dubey (1995), without their switch and with beta in mm (docs/reproduction.md, "Weights").
    """
    lower, upper = (x / paper.MM for x in interval(q[:3]))
    beta = q[:3] / paper.MM
    above, below = upper - beta, beta - lower
    # 1 / w_i in a form that stays finite at a limit.
    square = 4 * above**2 * below**2
    inverse = square / (square + (upper - lower)**2 * np.abs(2 * beta - upper - lower))
    return np.append(inverse / paper.TRANSLATION_WEIGHT, np.full(3, 1 / paper.ROTATION_WEIGHT))


def _weighted(jacobian, inverse_weights):
    """(J^T W_track J + W)^-1 J^T W_track = W^-1 J^T (J W^-1 J^T + W_track^-1)^-1, which also exists for infinite weights."""
    scaled = inverse_weights[:, None] * jacobian.T
    return scaled @ np.linalg.inv(jacobian @ scaled + np.eye(3) / paper.TRACK_WEIGHT)


def nspwln(step):
    """Equation (6), as printed: both arms answer the primary task, each with its own six columns."""
    weights_a, weights_b = _inverse_weights(step.q[:6]), _inverse_weights(step.q[6:])
    jab = relative_jacobian(step)
    primary = np.vstack([_weighted(jab[:, :6], weights_a), _weighted(jab[:, 6:], weights_b)])
    secondary = np.append(_weighted(step.ja, weights_a) @ step.v_a, np.zeros(6))
    return primary @ step.v_ab + (np.eye(12) - primary @ jab) @ secondary


def velocity_limits(q, rotation_speed):
    """Rows and bounds G q' <= g for both arms: the box below (7) and the coupled rows of (1).

    A joint or a row with the distance d to its limit may approach it at min{d / T, V_max, sqrt(2 A_max d)} (below (7)). Equation (1)
    couples neighbouring tubes: both velocities stand in one row (docs/reproduction.md, "Equation 1"). V_max limits joints, not rows.
        beta_{i-1} - beta_i <= 0,     (beta_i + l_i) - (beta_{i-1} + l_{i-1}) <= 0.
    """
    rows, bounds = [], []

    def add(row, gap, speed):
        gap = max(gap, 0.0)
        rows.append(row)
        bounds.append(min(gap / paper.PERIOD, speed, np.sqrt(2 * paper.APPROACH * gap)))

    unit = np.eye(12)
    for arm in (0, 6):
        beta = q[arm:arm + 3]
        for i in range(3):
            add(unit[arm + i], 0 - beta[i], paper.SPEED)
            add(-unit[arm + i], beta[i] + paper.LENGTH[i], paper.SPEED)
        for i in (1, 2):
            row = unit[arm + i - 1] - unit[arm + i]
            add(row, beta[i] - beta[i - 1], np.inf)
            add(-row, beta[i - 1] + paper.LENGTH[i - 1] - beta[i] - paper.LENGTH[i], np.inf)
        for i in (3, 4, 5):
            rows += [unit[arm + i], -unit[arm + i]]
            bounds += [rotation_speed, rotation_speed]
    return np.array(rows), np.array(bounds)


def nspqp(step):
    """Equation (7). Rotations are unbounded."""
    ja = tip_jacobian(step)
    rows, bounds = velocity_limits(step.q, np.inf)
    return qp.solve(ja.T @ ja + paper.ZETA_NSPQP * np.eye(12), -ja.T @ step.v_a, relative_jacobian(step), step.v_ab, rows, bounds)[0]


def snsqp(step):
    """Equation (8), one QP a level, in x = (q', s).

    Behind the first level the task reads J_k q' = J_k q'_{k-1} + s (v_k - J_k q'_{k-1}), and rotations are limited to 0.5 rad/s
    (docs/reproduction.md, "Equation 8"). 0 <= s <= 1: a task is executed in its direction, at most at the desired speed (docs/methods.md).
    """
    zeta = paper.ZETA_SNSQP
    # (1/zeta)(1 - s)^2 without the factor 1/2 of the first term.
    hessian = np.diag(np.append(np.full(12, zeta), 2 / zeta))
    gradient = np.append(np.zeros(12), -2 / zeta)
    rows, bounds = velocity_limits(step.q, paper.SNSQP_ROTATION_SPEED)
    rows = np.vstack([np.hstack([rows, np.zeros((len(rows), 1))]), np.append(np.zeros(12), 1), np.append(np.zeros(12), -1)])
    bounds = np.append(bounds, [1, 0])
    before, velocity = np.zeros((0, 12)), np.zeros(12)
    for jacobian, v in ((relative_jacobian(step), step.v_ab), (tip_jacobian(step), step.v_a)):
        done = jacobian @ velocity
        equal = np.vstack([np.hstack([jacobian, -(v - done)[:, None]]), np.hstack([before, np.zeros((len(before), 1))])])
        velocity = qp.solve(hessian, gradient, equal, np.append(done, before @ velocity), rows, bounds)[0][:12]
        before = np.vstack([before, jacobian])
    return velocity


METHODS = {"nspwln": nspwln, "nspqp": nspqp, "snsqp": snsqp}
