"""Vectors of three as plain numbers, for what runs every tick: arrays of three cost ten times their arithmetic."""

from __future__ import annotations

from collections.abc import Sequence

Row = tuple[float, float, float]


def rotation_rows(w: float, x: float, y: float, z: float) -> tuple[Row, Row, Row]:
    """Rows of the rotation matrix of a unit quaternion as plain floats."""
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def down_row(w: float, x: float, y: float, z: float) -> Row:
    """Unit vector of gravity in the body for an attitude B to I: the last of its rotation's rows."""
    return 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)


def cross_product(a: Sequence[float], b: Sequence[float]) -> Row:
    """Cross product a x b."""
    (ax, ay, az), (bx, by, bz) = a, b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def turned(rotation: tuple[Row, Row, Row], vector: Sequence[float]) -> Row:
    """R v for a rotation given by its rows."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def turned_back(rotation: tuple[Row, Row, Row], vector: Sequence[float]) -> Row:
    """R' v for a rotation given by its rows."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z
