"""Quaternions (w, x, y, z) of plain numbers: product, and the turn about a small rotation vector."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any


def multiply(a: Sequence[Any], b: Sequence[Any]) -> tuple[Any, Any, Any, Any]:
    """Product of two quaternions (w, x, y, z) of plain numbers or symbols."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a, b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def small_turn(vector: Sequence[float]) -> tuple[float, float, float, float]:
    """Unit quaternion of a rotation vector of a few degrees [rad]."""
    x, y, z = vector
    x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
    length = math.sqrt(1.0 + x * x + y * y + z * z)
    return 1.0 / length, x / length, y / length, z / length
