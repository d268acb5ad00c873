# SPDX-License-Identifier: Apache-2.0
"""Closed loop of section 3 and the statistics of Table 3."""
from collections import namedtuple

import numpy as np

import methods
import paper
import tubes

Run = namedtuple("Run", "trajectory configuration method points converged iterations relative tip gate joints")
Errors = namedtuple("Errors", "rms std max")


def statistics(errors):
    """RMS, standard deviation and maximum in mm of error norms in m, one a trajectory point; all points are the population."""
    errors = np.array(errors) / paper.MM
    return Errors(np.sqrt(np.mean(errors**2)), errors.std(), errors.max())


def gate(q, velocity):
    """Joints after one step of the robot, which never leaves V_max and equation (1), and how often it intervened.

    The paper's robot has no such gate; ours saturates joint by joint, from the inner tube outwards, so that an inner carriage
    carries the next one along (docs/reproduction.md, "The gate"). Interventions count per arm and guard (docs/csv.md).
    """
    after = q + paper.PERIOD * velocity
    actions = 0
    for arm in (0, 6):
        asked = after[arm:arm + 3].copy()
        slow = np.clip(asked, q[arm:arm + 3] - paper.SPEED * paper.PERIOD, q[arm:arm + 3] + paper.SPEED * paper.PERIOD)
        after[arm:arm + 3] = slow
        for i in range(3):
            lower, upper = methods.interval(after[arm:arm + 3])
            after[arm + i] = np.clip(after[arm + i], lower[i], upper[i])
        actions += int(np.abs(slow - asked).max() > 1e-9) + int(np.abs(after[arm:arm + 3] - slow).max() > 1e-9)
    return after, actions


def run(trajectory, configuration, method, q):
    """One of the 18 runs, from the joints q (12). Each point ends when both errors are at most 0.88 mm, after 100 iterations at the latest.

    A point takes at least one iteration; errors are those after its last one. The feed-forward term below (3), the displacement
    between two targets divided by the 10 s that a point may take, acts in the first iteration of a point only
    (docs/reproduction.md, "Feed-forward").
    """
    tip_a, tip_b = _tips(q)
    start, relative = tip_a[0], tip_a[0] - tip_b[0]
    targets = start + paper.trajectory(trajectory, configuration)
    last = start
    left_ab, left_a, joints, converged, gated = [], [], [], 0, 0
    for target in targets:
        forward = (target - last) / (paper.MAX_ITERATIONS * paper.PERIOD)
        last = target
        for iteration in range(paper.MAX_ITERATIONS):
            v_ab = paper.GAIN_RELATIVE * (relative - (tip_a[0] - tip_b[0]))
            v_a = paper.GAIN_TIP * (target - tip_a[0]) + (forward if iteration == 0 else 0)
            velocity = methods.METHODS[method](methods.Step(q, tip_a[1], tip_b[1], v_ab, v_a))
            q, actions = gate(q, velocity)
            gated += actions
            joints.append(q)
            tip_a, tip_b = _tips(q)
            error_ab = np.linalg.norm(relative - (tip_a[0] - tip_b[0]))
            error_a = np.linalg.norm(target - tip_a[0])
            if max(error_ab, error_a) <= paper.THRESHOLD:
                converged += 1
                break
        left_ab.append(error_ab)
        left_a.append(error_a)
    return Run(trajectory, configuration, method, len(targets), converged, len(joints), statistics(left_ab), statistics(left_a), gated,
               np.array(joints))


def _tips(q):
    return [(base + position, jacobian) for base, (position, jacobian) in zip(paper.BASES, (tubes.tip(q[:6]), tubes.tip(q[6:])))]
