"""Motion of a plane's points in the picture of a moving camera."""

from __future__ import annotations

from typing import Any

import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA


def camera_twist(twist_body: np.ndarray, camera_position: np.ndarray) -> np.ndarray:
    """Velocity of the camera centre [m/s] and angular velocity [rad/s] in camera axes, (6,).

    Args:
        twist_body: Velocity of the body's origin [m/s] and angular velocity [rad/s] in B, (6,).
        camera_position: Camera centre in B [m], (3,).
    """
    velocity, rate = twist_body[:3], twist_body[3:]
    return np.concatenate(((velocity + np.cross(rate, camera_position)) @ R_BODY_CAMERA, rate @ R_BODY_CAMERA))


def image_velocity(x: Any, y: Any, plane: Any, twist: Any) -> tuple[Any, Any]:
    """Velocity of normalised picture points of a resting plane [1/s]; numbers or arrays of one shape.

    Args:
        x: X/Z.
        y: Y/Z.
        plane: (a, b, c) of 1/Z = a x + b y + c [1/m].
        twist: Of `camera_twist`, (6,).
    """
    (a, b, c), (vx, vy, vz, wx, wy, wz) = plane, twist
    inverse = a * x + b * y + c
    ahead = wx * y - wy * x + vz * inverse
    return x * ahead - vx * inverse - wy + wz * y, y * ahead - vy * inverse - wz * x + wx
