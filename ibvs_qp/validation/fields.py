"""When a value that comes in is sound: bounds, and questions about numbers, vectors and lines.

`surely_*` is a fast accept over all fields at once. False means undecided: the caller then validates field by field
and names what is wrong. It runs on plain numbers, because arrays of three cost ten times their arithmetic:
`math.hypot` bounds every entry of a vector in one call, and NaN never passes.
"""

from __future__ import annotations

import math
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

_NO_NUMBERS = [float("nan")]
_ARRAY, _FLOAT, _ROLES = np.ndarray, np.dtype(np.float64), (HORIZONTAL, VERTICAL)
_PAIR, _SQUARE = (2,), (2, 2)


def entries(value: Any, shape: tuple[int, ...]) -> list[float]:
    """Numbers of a float64 vector of that shape; for anything else not-a-number, which no bound lets pass."""
    if type(value) is _ARRAY and value.dtype is _FLOAT and value.shape == shape:
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
        if not (isinstance(role, str) and role in _ROLES):
            return False
        if type(spread) is not _ARRAY or spread.dtype is not _FLOAT or spread.shape != _SQUARE:
            return False
        (a, b), (c, d) = spread.tolist()
        if not (hypot(rho, theta, a, b, c, d) <= LINE_BOUND and 0.0 <= weight <= 1.0):
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
        rho, theta, role = line.rho, line.theta, line.role
        if not (isinstance(rho, float) and isinstance(theta, float) and isinstance(role, str) and role in _ROLES):
            return False
        if not hypot(rho, theta) <= LINE_BOUND:
            return False
    return (
        0.0 <= push <= PUSH_BOUND
        and nearest <= standoff <= farthest
        and hypot(*entries(reference.velocity, _PAIR)) <= VELOCITY_BOUND
        and hypot(*entries(reference.travel, _PAIR)) <= VELOCITY_BOUND
        and hypot(*entries(reference.tilt, _PAIR)) <= TILT_BOUND
    )


def sound_vector(value: Any, size: int, bound: float) -> bool:
    """Whether a value is a float vector of that size with every entry within the bound."""
    if not isinstance(value, np.ndarray) or value.shape != (size,) or value.dtype.kind != "f":
        return False
    for entry in value.tolist():  # a plain loop: half the time of any builtin over six numbers
        if not -bound <= entry <= bound:  # NaN as well
            return False
    return True


def is_number(value: Any, low: float, high: float) -> bool:
    """Whether a value is a number within [low, high]."""
    if type(value) is float:
        return low <= value <= high
    return isinstance(value, (int, float, np.integer, np.floating)) and bool(low <= value <= high)


def good_line(line: Any) -> bool:
    """Whether a value is a sound `LineFeature`."""
    if not isinstance(line, LineFeature) or not good_role(line.role) or not is_array(line.covariance, (2, 2)):
        return False
    (a, b), (c, d) = line.covariance.tolist()
    return math.isfinite(a + b + c + d) and good_place(line.rho, line.theta) and is_number(line.weight, 0.0, 1.0)


def good_place(rho: Any, theta: Any) -> bool:
    """Whether both parameters of a line are within their bound."""
    return is_number(rho, -LINE_BOUND, LINE_BOUND) and is_number(theta, -LINE_BOUND, LINE_BOUND)


def is_array(value: Any, shape: tuple[int, ...]) -> bool:
    """Whether a value is an array of floats of that shape."""
    return type(value) is np.ndarray and value.shape == shape and value.dtype.kind == "f"


def good_role(role: Any) -> bool:
    """Whether a value names a role of a line."""
    return isinstance(role, str) and role in _ROLES
