# SPDX-License-Identifier: Apache-2.0
"""Piecewise constant curvature kinematics and equation (1) of Alsaka et al. 2024, written from the paper for the tests.

Shares no code and no formula with the product: a section's transform is the matrix exponential of its twist, by its
power series. SI units. A joint vector is [beta_1..beta_3, alpha_1..alpha_3], tube 1 the innermost; vectors are lists,
matrices lists of rows.
"""
import math

# Tables 1 and 2 of the paper, curvatures as in the preset ark2024 (a tenth of the printed ones).
STRAIGHT = [0.387, 0.267, 0.149]
CURVED = [0.050, 0.050, 0.050]
CURVATURE = [10.0, 5.0, 7.0]
OUTER = [1.524e-3, 1.8e-3, 2.164e-3]
INNER = [1.3e-3, 1.62e-3, 2.0e-3]
YOUNG = 58e9
LENGTH = [s + c for s, c in zip(STRAIGHT, CURVED)]
BASE_Y = {"a": 0.005, "b": -0.005}
VELOCITY = 5e-3  # V_max of the translations, m/s
APPROACH = 1e-3  # A_max of the translations, m/s^2
STIFFNESS = [YOUNG * math.pi / 64 * (o**4 - i**4) for o, i in zip(OUTER, INNER)]


def multiply(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def times(matrix, vector):
    return [sum(x * y for x, y in zip(row, vector)) for row in matrix]


def norm(vector):
    return math.sqrt(sum(x * x for x in vector))


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def transposed(matrix):
    return [list(row) for row in zip(*matrix)]


def exponential(matrix):
    """exp of a square matrix: power series of matrix / 2^k, squared k times."""
    size = len(matrix)
    largest = max(sum(abs(x) for x in row) for row in matrix)
    halvings = max(0, math.ceil(math.log2(largest)) + 4) if largest > 0 else 0
    scaled = [[x / 2**halvings for x in row] for row in matrix]
    result = [[float(i == j) for j in range(size)] for i in range(size)]
    term = result
    for k in range(1, 11):  # the norm of the scaled matrix is below 1 / 16
        term = [[x / k for x in row] for row in multiply(term, scaled)]
        result = [[x + y for x, y in zip(r, t)] for r, t in zip(result, term)]
    for _ in range(halvings):
        result = multiply(result, result)
    return result


def boundaries(q):
    """Arc lengths beyond the entry point where a curved part begins or a tube ends, sorted."""
    found = {0.0}
    for i in range(3):
        for s in (q[i] + STRAIGHT[i], q[i] + LENGTH[i]):
            if s > 0.0:
                found.add(s)
    end = q[0] + LENGTH[0]
    return sorted(s for s in found if s < end) + [end]


def transform(q, arm="a", length=None):
    """4 x 4 pose of the backbone at arc length `length` (by default the tip) in the robot base frame."""
    edges = boundaries(q)
    length = edges[-1] if length is None else length
    pose = [[1.0, 0, 0, 0], [0, 1.0, 0, BASE_Y[arm]], [0, 0, 1.0, 0], [0, 0, 0, 1.0]]
    for start, stop in zip(edges, edges[1:]):
        if start >= length:
            break
        middle, piece = 0.5 * (start + stop), min(stop, length) - start
        stiffness = ux = uy = 0.0
        for i in range(3):
            if middle > q[i] + LENGTH[i]:
                continue
            stiffness += STIFFNESS[i]
            if middle > q[i] + STRAIGHT[i]:
                ux -= STIFFNESS[i] * CURVATURE[i] * math.sin(q[3 + i])
                uy += STIFFNESS[i] * CURVATURE[i] * math.cos(q[3 + i])
        ux, uy = ux / stiffness, uy / stiffness
        twist = [[0, 0, uy, 0], [0, 0, -ux, 0], [-uy, ux, 0, 1.0], [0, 0, 0, 0]]
        pose = multiply(pose, exponential([[x * piece for x in row] for row in twist]))
    return pose


def position(pose):
    return [row[3] for row in pose[:3]]


def rotation(pose):
    return [row[:3] for row in pose[:3]]


def rotation_of_quaternion(x, y, z, w):
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def excess(q):
    """Largest violation of equation (1) by the translations, m; not above zero inside."""
    amounts = [q[0], q[1], q[2]] + [-LENGTH[i] - q[i] for i in range(3)]
    for i in (1, 2):
        amounts.append(q[i - 1] - q[i])  # carriages in order
        amounts.append(q[i] + LENGTH[i] - q[i - 1] - LENGTH[i - 1])  # an outer tube ends behind the inner one
    return max(amounts)


def random_joints(rng, margin=0.0):
    """A joint vector inside equation (1), at least `margin` from its limits, tube 1 extended by at least 10 mm."""
    beta = [rng.uniform(-LENGTH[0] + 0.010, -3 * margin)]
    for i in (1, 2):
        lower = max(-LENGTH[i], beta[i - 1]) + margin
        upper = min(0.0, beta[i - 1] + LENGTH[i - 1] - LENGTH[i]) - margin
        if lower > upper:
            return random_joints(rng, margin)
        beta.append(rng.uniform(lower, upper))
    return beta + [rng.uniform(-math.pi, math.pi) for _ in range(3)]
