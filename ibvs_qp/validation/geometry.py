"""Checks of lines and planes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ibvs_qp.measurement import HORIZONTAL, VERTICAL, LineFeature, LineReference
from ibvs_qp.validation.fields import is_number

#: Largest rho [-] and theta [rad].
LINE_BOUND = 1e6
#: Largest entry of a plane, and of a plane divided by D [1/m].
PLANE_BOUND, INVERSE_DEPTH_BOUND = 1e12, 1e3
#: Smallest inverse depth of a plane on the optical axis [1/m]: 20 m.
INVERSE_DEPTH_MIN = 0.05


def accepts_line(line: Any) -> bool:
    """Whether a value is a `LineFeature` with finite parameters, a known role and a weight from 0 to 1."""
    if not isinstance(line, LineFeature) or not (is_number(line.weight) and 0.0 <= line.weight <= 1.0):
        return False
    covariance = line.covariance
    if type(covariance) is not np.ndarray or covariance.shape != (2, 2) or covariance.dtype.kind != "f":
        return False
    (a, b), (c, d) = covariance.tolist()
    return math.isfinite(a + b + c + d) and _accepts_parameters(line)


def accepts_line_reference(line: Any) -> bool:
    """Whether a value is a `LineReference` with finite parameters and a known role."""
    return isinstance(line, LineReference) and _accepts_parameters(line)


def accepts_plane(plane: Any) -> bool:
    """Whether a value is a plane (A, B, C, D) in front of the camera with D != 0."""
    if not isinstance(plane, (tuple, list, np.ndarray)) or len(plane) != 4:
        return False
    a, b, c, d = plane
    if not (
        _within(a, PLANE_BOUND) and _within(b, PLANE_BOUND) and _within(c, PLANE_BOUND) and _within(d, PLANE_BOUND)
    ):
        return False
    bound = INVERSE_DEPTH_BOUND
    return d != 0.0 and abs(a / d) < bound and abs(b / d) < bound and INVERSE_DEPTH_MIN < -c / d < bound


def _accepts_parameters(line: LineFeature | LineReference) -> bool:
    role = line.role
    known = isinstance(role, str) and (role == HORIZONTAL or role == VERTICAL)
    return known and _within(line.rho, LINE_BOUND) and _within(line.theta, LINE_BOUND)


def _within(value: Any, bound: float) -> bool:
    return is_number(value) and -bound <= value <= bound
