# SPDX-License-Identifier: Apache-2.0
"""Torsionally compliant tubes from their end angles, written from Dupont et al. 2010 for the tests.

Shares no code and no method with the product: classical Runge-Kutta steps in the Bishop frame, from the end of tube 1
back to the motors. SI; the tubes of ark2024 unless others are given; conventions of `tubes`.
"""
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "integration" / "harness"))
import tubes  # noqa: E402

POISSON = 0.6
TORSION = [k / (1 + POISSON) for k in tubes.STIFFNESS]  # G J = E I / (1 + nu)
EXTENDED = [-0.3, -0.18, -0.064]  # curved parts overlap over 48 mm, the largest possible interaction


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def from_ends(beta, theta, arm="a", steps=60):
    """(alpha, tip position) of the arm whose tubes end at angles theta; `steps` Runge-Kutta steps per interval."""
    q = list(beta) + [0.0] * 3
    edges = tubes.boundaries(q)
    psi, moment = list(theta), [0.0] * 3
    frame = [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]  # columns: axes at s in the frame of the end
    place = [0.0] * 3

    def slope(state, present, curved, total):
        angles, moments, axes = state[:3], state[3:6], [state[6:9], state[9:12], state[12:15]]
        b = [tubes.STIFFNESS[i] * tubes.CURVATURE[i] if i in curved else 0.0 for i in range(3)]
        u = [sum(-b[i] * math.sin(angles[i]) for i in curved) / total,
             sum(b[i] * math.cos(angles[i]) for i in curved) / total]
        twist = [moments[i] / TORSION[i] if i in present else 0.0 for i in range(3)]
        torque = [b[i] * (u[0] * math.cos(angles[i]) + u[1] * math.sin(angles[i])) for i in range(3)]
        x, y, z = axes
        turned = [[-u[1] * c for c in z], [u[0] * c for c in z], [u[1] * a - u[0] * b for a, b in zip(x, y)]]
        return twist + torque + turned[0] + turned[1] + turned[2] + z

    for start, stop in reversed(list(zip(edges, edges[1:]))):
        middle = 0.5 * (start + stop)
        present = [i for i in range(3) if middle < beta[i] + tubes.LENGTH[i]]
        curved = [i for i in present if middle > beta[i] + tubes.STRAIGHT[i]]
        total = sum(tubes.STIFFNESS[i] for i in present)
        state = psi + moment + frame[0] + frame[1] + frame[2] + place
        h = -(stop - start) / steps
        for _ in range(steps):
            k1 = slope(state, present, curved, total)
            k2 = slope([a + 0.5 * h * k for a, k in zip(state, k1)], present, curved, total)
            k3 = slope([a + 0.5 * h * k for a, k in zip(state, k2)], present, curved, total)
            k4 = slope([a + h * k for a, k in zip(state, k3)], present, curved, total)
            state = [a + h / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in zip(state, k1, k2, k3, k4)]
        psi, moment = state[:3], state[3:6]
        frame, place = [state[6:9], state[9:12], state[12:15]], state[15:18]
    alpha = [psi[i] + beta[i] * moment[i] / TORSION[i] for i in range(3)]
    # Tip in the frame of the entry point: minus the entry point, in the entry frame's axes.
    tip = [-sum(a * b for a, b in zip(axis, place)) for axis in frame]
    return alpha, [tip[0], tip[1] + tubes.BASE_Y[arm], tip[2]]


def random_overlap(rng):
    """A joint vector whose curved parts overlap, over 20 to 49 mm for neighbours, with the motors at the corresponding positions.
    Boundaries are at least 1 mm apart: derivatives jump where they meet."""
    while True:
        first = rng.uniform(-0.33, -0.26)
        second = first + 0.12 - rng.uniform(0.001, 0.03)
        third = second + 0.118 - rng.uniform(0.001, 0.03)
        beta = [first, second, third]
        if tubes.excess(beta + [0.0] * 3) < -1e-6:
            return beta + [rng.uniform(-math.pi, math.pi) for _ in range(3)]
