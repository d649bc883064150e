"""Quaternions (w, x, y, z) of plain numbers or symbols: a tick needs a few, and numpy's overhead costs ten times more.

A unit quaternion of B in I rotates vectors from B to I; a product turns in the axes of its first factor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

Quaternion = tuple[float, float, float, float]


def multiply(first: Sequence[Any], second: Sequence[Any]) -> tuple[Any, Any, Any, Any]:
    """Product of two quaternions."""
    (a, b, c, d), (e, f, g, h) = first, second
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )


def conjugate(quaternion: Sequence[Any]) -> tuple[Any, Any, Any, Any]:
    """Inverse of a unit quaternion."""
    w, x, y, z = quaternion
    return w, -x, -y, -z


def from_rotation_vector(vector: Sequence[float] | np.ndarray) -> Quaternion:
    """Unit quaternion of a rotation vector (axis times angle [rad])."""
    half = 0.5 * np.asarray(vector, float)
    angle = float(np.linalg.norm(half))
    x, y, z = (half * np.sinc(angle / math.pi)).tolist()
    return math.cos(angle), x, y, z


def small_turn(vector: Sequence[float]) -> Quaternion:
    """Unit quaternion of a rotation vector of a few degrees [rad]."""
    x, y, z = vector
    x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
    length = math.sqrt(1.0 + x * x + y * y + z * z)
    return 1.0 / length, x / length, y / length, z / length


def turned(attitude: Sequence[float], vector: Sequence[float]) -> Quaternion:
    """Attitude turned by a rotation vector in its own axes [rad]."""
    angle = math.hypot(*vector)
    scale = 0.5 if angle < 1e-9 else math.sin(0.5 * angle) / angle
    x, y, z = vector
    return multiply(attitude, (math.cos(0.5 * angle), scale * x, scale * y, scale * z))


def small_difference(first: Sequence[float], second: Sequence[float]) -> tuple[float, float, float]:
    """Rotation vector of a few degrees from one attitude to another, in the axes of the first [rad]."""
    w, x, y, z = multiply(conjugate(first), second)
    sign = math.copysign(2.0, w)  # q and -q are one attitude
    return sign * x, sign * y, sign * z
