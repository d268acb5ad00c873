# SPDX-License-Identifier: Apache-2.0
"""Cooperating continuum robots: models, redundancy resolution, simulation, planning, recordings, running robots.

    import tandem
    arm = tandem.Robot.load("ark2024").arm("a", model="compliant")
    pose, jacobian = arm.forward(arm.home), arm.jacobian(arm.home)

SI units everywhere: m, rad, s, N. Joints of an arm are [beta_1..beta_n, alpha_1..alpha_n], tube 1 innermost; one joint
vector, or an array with one a row, which is answered on all cores."""
from . import _requirements

try:
    import numpy as _numpy
except ImportError as error:
    raise _requirements.numpy_missing(error) from error
try:
    from ._tandem import *  # noqa: F401,F403
    from ._tandem import __version__, _supports_numpy_2  # noqa: F401
except ImportError as error:
    raise _requirements.extension_missing(error) from error
_requirements.require_numpy(_numpy.__version__, _supports_numpy_2)

from . import wire  # noqa: E402,F401
