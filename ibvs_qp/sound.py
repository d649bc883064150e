"""Single values that come in, asked at once: whether a number, a vector, a line or a reference is surely sound.

A "no" refuses nothing yet: `ibvs_qp.gate` then asks field by field and names what is wrong. Everything here runs every
tick on plain numbers; arrays of three cost ten times their arithmetic. `math.hypot` is the length of a vector in one
call: within a bound it has no entry beyond that bound, and not-a-number is within nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import Any

import numpy as np

from ibvs_qp.measurement import HORIZONTAL, VERTICAL, LineFeature, LineReference, Reference

#: Largest believable entries: body rate [rad/s], specific force [m/s^2], wrench [N, N m] and velocity [m/s].
RATE_BOUND, ACCELERATION_BOUND, WRENCH_BOUND, VELOCITY_BOUND = 35.0, 200.0, 500.0, 20.0
#: Largest believable line parameter (normalised, rad) and entry of a plane over D [1/m].
LINE_BOUND, PLANE_BOUND = 1e6, 1e3
#: Largest roll or pitch that may be asked for [rad].
TILT_BOUND = 0.6
#: Largest push [N] and range of the stand-off [m] that may be asked for.
PUSH_BOUND, STANDOFF_RANGE = 1e3, (-1.0, 10.0)
#: Largest believable thrust limit [N].
THRUST_BOUND = 1e4
#: A quaternion whose squared length is this far from 1 is no attitude.
UNIT_SLIP = 0.02

_NO_NUMBERS = (float("nan"),)


def entries(value: Any, shape: tuple[int]) -> Sequence[float]:
    """Numbers of a float64 vector of that shape; for anything else not-a-number, which no bound lets pass."""
    if type(value) is np.ndarray and value.dtype.char == "d" and value.shape == shape:
        return value.tolist()
    return _NO_NUMBERS


def surely_good_lines(lines: Any) -> bool:
    """Whether every entry of a tuple is a sound `LineFeature`."""
    if type(lines) is not tuple:
        return False
    for line in lines:
        if type(line) is not LineFeature:
            return False
        rho, theta, role, weight, spread = line.rho, line.theta, line.role, line.weight, line.covariance
        if not (isinstance(rho, float) and isinstance(theta, float) and isinstance(weight, float)):
            return False
        if type(spread) is not np.ndarray or spread.dtype.char != "d" or spread.shape != (2, 2):
            return False
        (a, b), (c, d) = spread.tolist()
        if not (hypot(rho, theta, a, b, c, d) <= LINE_BOUND and 0.0 <= weight <= 1.0 and _known_role(role)):
            return False
    return True


def surely_good_reference(reference: Any) -> bool:
    """Whether a value is a sound `Reference`."""
    if type(reference) is not Reference or type(reference.contact) is not bool or type(reference.lines) is not tuple:
        return False
    push, standoff = reference.push_force, reference.standoff
    nearest, farthest = STANDOFF_RANGE
    if not (isinstance(push, float) and isinstance(standoff, float)):
        return False
    for line in reference.lines:
        if type(line) is not LineReference:
            return False
        rho, theta = line.rho, line.theta
        if not (isinstance(rho, float) and isinstance(theta, float) and _known_role(line.role)):
            return False
        if not hypot(rho, theta) <= LINE_BOUND:
            return False
    return (
        0.0 <= push <= PUSH_BOUND
        and nearest <= standoff <= farthest
        and hypot(*entries(reference.velocity, (2,))) <= VELOCITY_BOUND
        and hypot(*entries(reference.travel, (2,))) <= VELOCITY_BOUND
        and hypot(*entries(reference.tilt, (2,))) <= TILT_BOUND
    )


def _known_role(role: Any) -> bool:
    return type(role) is str and (role == HORIZONTAL or role == VERTICAL)
