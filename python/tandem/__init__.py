# SPDX-License-Identifier: Apache-2.0
"""Cooperating continuum robots: models, redundancy resolution, simulation, planning, recordings, running robots.

    import tandem
    arm = tandem.Robot.load("ark2024").arm("a", model="compliant")
    pose, jacobian = arm.forward(arm.home), arm.jacobian(arm.home)

SI units everywhere: m, rad, s, N. Joints of an arm are [beta_1..beta_n, alpha_1..alpha_n], tube 1 innermost; one joint
vector, or an array with one a row, which is answered on all cores."""
from . import wire  # noqa: F401
from ._tandem import *  # noqa: F401,F403
from ._tandem import __doc__ as _doc  # noqa: F401
