# SPDX-License-Identifier: Apache-2.0
"""Numbers of the experiment of Table 3, written down from the text of Alsaka, Cinquin and Chikhaoui (ARK 2024).

Lengths are in m, angles in rad, times in s. "Reading" marks what the paper leaves open or misprints; docs/reproduction.md has the
reasons for each reading. Nothing here is read from the program's own files, so a wrong number there shows up as a difference.
"""
import numpy as np

MM = 1e-3

# Table 1, from the innermost tube outwards.
OUTER = np.array([1.524, 1.8, 2.164]) * MM
INNER = np.array([1.3, 1.62, 2.0]) * MM
YOUNG = np.array([58e9, 58e9, 58e9])
STRAIGHT = np.array([387, 267, 149]) * MM
CURVED = np.array([50, 50, 50]) * MM
# Reading: 0.1, 0.05, 0.07 per mm are printed; a tenth of them agrees with the axes of the paper's figures.
CURVATURE = np.array([0.1, 0.05, 0.07]) / MM / 10
LENGTH = STRAIGHT + CURVED

# Reading: two parallel channels 10 mm apart; positions of the bases of robots A and B.
BASES = np.array([[0, 5, 0], [0, -5, 0]]) * MM

# Table 2: beta_1..3 in mm, alpha_1..3 in degrees, of robots A and B.
_TABLE_2 = {
    "1": ([-100, -80, -50, 45, 45, 45], [-80, -60, -30, 45, 45, 45]),
    "2": ([-150, -100, -50, 180, 90, 45], [-130, -120, -100, 90, -60, -270]),
    "3": ([-250, -200, -120, 0, 0, 0], [-250, -200, -120, 0, 0, 0]),
}
_UNITS = np.array([MM] * 3 + [np.pi / 180] * 3)
CONFIGURATIONS = {name: np.concatenate([np.array(a) * _UNITS, np.array(b) * _UNITS]) for name, (a, b) in _TABLE_2.items()}

# Section 3: sampling time, gains, threshold, iterations a point, limits of the QP methods.
PERIOD = 0.1
GAIN_RELATIVE = 5.0
GAIN_TIP = 3.0
THRESHOLD = 0.88 * MM
MAX_ITERATIONS = 100
SPEED = 5 * MM
APPROACH = 1 * MM
# Fig. 2 has 100 steps; each is a trajectory point.
POINTS = 100

# Section 2.1, read in m and rad.
TRACK_WEIGHT = 1e8
TRANSLATION_WEIGHT = 30.0
ROTATION_WEIGHT = 1e-3
# Reading: zeta of (7) and (8), and the limit of rotations that SNSQP needs.
ZETA_NSPQP = 1e-6
ZETA_SNSQP = 3e-2
SNSQP_ROTATION_SPEED = 0.5

METHODS = ("nspwln", "nspqp", "snsqp")
TRAJECTORIES = ("rectangle", "lissajous")

# Table 3: iterations, then RMS, standard deviation and maximum in mm of epsilon_AB and of epsilon_A.
TABLE_3 = {
    ("rectangle", "nspwln"): (523, (0.33, 0.05, 0.35), (0.79, 0.08, 0.82)),
    ("rectangle", "nspqp"): (269, (0.01, 0.02, 0.02), (0.72, 0.10, 0.81)),
    ("rectangle", "snsqp"): (261, (0.02, 0.03, 0.05), (0.70, 0.11, 0.74)),
    ("lissajous", "nspwln"): (513, (0.31, 0.04, 0.33), (0.78, 0.07, 0.81)),
    ("lissajous", "nspqp"): (279, (0.03, 0.04, 0.09), (0.72, 0.10, 0.75)),
    ("lissajous", "snsqp"): (259, (0.06, 0.08, 0.13), (0.71, 0.10, 0.76)),
}


def trajectory(name, configuration):
    """Offsets (POINTS x 3, m) of the target points from the tip's start, evenly spaced by arc length; the last one closes the curve.

    Reading (the paper prints no dimensions): rectangle with legs of 20 mm along -x then +z for configuration 1, along +y then -x for
    2 and 3; Lissajous y = 10 sin(2 pi t), z = 10 sin(4 pi t) mm.
    """
    if name == "rectangle":
        first, second = ([-20, 0, 0], [0, 0, 20]) if configuration == "1" else ([0, 20, 0], [-20, 0, 0])
        first, second = np.array(first) * MM, np.array(second) * MM
        curve = np.array([0 * first, first, first + second, second, 0 * first])
    elif name == "lissajous":
        t = np.linspace(0, 1, 200001)
        curve = 10 * MM * np.column_stack([0 * t, np.sin(2 * np.pi * t), np.sin(4 * np.pi * t)])
    else:
        raise ValueError(f"trajectory: found {name!r}, expected one of: {', '.join(TRAJECTORIES)}")
    s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    at = s[-1] * np.arange(1, POINTS + 1) / POINTS
    return np.column_stack([np.interp(at, s, curve[:, i]) for i in range(3)])
