# SPDX-License-Identifier: Apache-2.0
"""Torsionally rigid concentric tubes: tip position and its Jacobian.

Conventions of docs/models.md: alpha = 0 bends a tube towards +x, with the precurvature vector (0, kappa, 0); z points into the body.
Tubes that overlap share the mean of their precurvatures, weighted by bending stiffness; between the places where a section of a tube
begins or ends the backbone is an arc of a circle.
"""
import numpy as np

import paper

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
STIFFNESS = paper.YOUNG * np.pi / 64 * (paper.OUTER**4 - paper.INNER**4)


def _turn(u, s):
    """Rotation (3x3) and displacement (3) along an arc of length s with the curvature vector u = (ux, uy) in its own frame."""
    k = np.hypot(*u)
    a = k * s
    if a < 1e-9:
        n = np.array([[0, 0, u[1]], [0, 0, -u[0]], [-u[1], u[0], 0]])
        return np.eye(3) + s * n, np.array([s * s / 2 * u[1], -s * s / 2 * u[0], s])
    n = np.array([[0, 0, u[1]], [0, 0, -u[0]], [-u[1], u[0], 0]]) / k
    rotation = np.eye(3) + np.sin(a) * n + (1 - np.cos(a)) * n @ n
    # Integral of the rotation applied to e_z; n @ n @ e_z = -e_z because u is normal to e_z.
    return rotation, np.array([(1 - np.cos(a)) / k * n[0, 2], (1 - np.cos(a)) / k * n[1, 2], np.sin(a) / k])


def _curvature(directions, curved, present):
    """Curvature vector of the backbone where the tubes `curved` are curved and the tubes `present` have not ended."""
    return (STIFFNESS * paper.CURVATURE * curved * present) @ directions / (STIFFNESS @ present)


def _sections(q):
    """Sections from the entry point to the tip: (length, curved, present), then the events that end them: (tube, ends here).

    Sections of length zero stay in the list, so each event changes one tube only and the Jacobian is one-sided where events meet.
    """
    beta = q[:3]
    events = sorted([(s, tube, False) for tube, s in enumerate(beta + paper.STRAIGHT)] +
                    [(s, tube, True) for tube, s in enumerate(beta + paper.LENGTH)])
    curved, present = np.zeros(3), np.ones(3)
    sections, ends, at = [], [], 0.0
    for s, tube, end in events:
        if s > 0:
            sections.append((s - at, curved.copy(), present.copy()))
            ends.append((tube, end))
            at = s
        if end:
            present[tube] = 0
        else:
            curved[tube] = 1
    return sections, ends


def tip(q, jacobian=True):
    """Tip position (3, m, in the arm's base frame) at q = [beta_1..3, alpha_1..3], and its Jacobian (3 x 6).

    With R(s) the frame and p(s) the position of the backbone, a change du(s) of its curvature turns all that lies behind s:
        dp_tip = integral of (R du) x (p_tip - p) ds
    A rotation changes u along the sections in which its tube is curved. A translation moves the places where its tube begins to be
    curved and where it ends, at each of which u jumps: du is that jump times a Dirac impulse. The end of tube 1 carries the tip along.
    """
    alpha = q[3:]
    directions = np.column_stack([-np.sin(alpha), np.cos(alpha)])
    sections, ends = _sections(q)
    frames, points, curvatures = [np.eye(3)], [np.zeros(3)], []
    for length, curved, present in sections:
        u = _curvature(directions, curved, present)
        rotation, step = _turn(u, length)
        curvatures.append(u)
        points.append(points[-1] + frames[-1] @ step)
        frames.append(frames[-1] @ rotation)
    p_tip = points[-1]
    if not jacobian:
        return p_tip, None

    jac = np.zeros((3, 6))
    turned = np.column_stack([-np.cos(alpha), -np.sin(alpha)])
    for k, (length, curved, present) in enumerate(sections):
        share = STIFFNESS * paper.CURVATURE * curved * present / (STIFFNESS @ present)
        if share.any() and length > 0:
            du = np.zeros((3, 3))
            du[:2] = (share[:, None] * turned).T
            for node, weight in zip(_NODES, _WEIGHTS):
                rotation, step = _turn(curvatures[k], length * (node + 1) / 2)
                arm = p_tip - points[k] - frames[k] @ step
                jac[:, 3:] += weight * length / 2 * np.cross((frames[k] @ rotation @ du).T, arm).T
        tube, end = ends[k]
        if k + 1 < len(sections):
            jump = curvatures[k] - curvatures[k + 1]
            jac[:, tube] += np.cross(frames[k + 1] @ np.array([jump[0], jump[1], 0]), p_tip - points[k + 1])
        else:
            jac[:, tube] += frames[k + 1][:, 2]
    return p_tip, jac
