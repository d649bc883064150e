"""Motion of a plane's points in the picture of a moving camera."""

from __future__ import annotations

from typing import Any


def image_velocity(x: Any, y: Any, plane: Any, twist: Any) -> tuple[Any, Any]:
    """Velocity of normalised picture points of a resting plane [1/s]; numbers or arrays of one shape.

    Args:
        x: X/Z.
        y: Y/Z.
        plane: (a, b, c) of 1/Z = a x + b y + c [1/m].
        twist: Velocity of the camera centre [m/s] and angular velocity [rad/s] in camera axes, (6,).
    """
    (a, b, c), (vx, vy, vz, wx, wy, wz) = plane, twist
    inverse = a * x + b * y + c
    ahead = wx * y - wy * x + vz * inverse
    return x * ahead - vx * inverse - wy + wz * y, y * ahead - vy * inverse - wz * x + wx
