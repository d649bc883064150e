"""Field of view of a camera on its mount, in the axes C of one that looks along +x."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA, rotation_from_vector

#: Least depth in C of a ray per length [-]: 84 deg off the axis of C; rays beyond it are moved there.
_LEAST_DEPTH = 0.1


class FieldOfView(NamedTuple):
    """Ends of the image along the level and the upright line through its middle, normalised, in C."""

    left: float
    right: float
    up: float
    down: float


def camera_rotation(turn_deg: Sequence[float]) -> np.ndarray:
    """Rotation to C from the axes of a camera that is turned by a rotation vector in B [deg], (3, 3)."""
    return R_BODY_CAMERA.T @ rotation_from_vector(np.radians(turn_deg)) @ R_BODY_CAMERA


def straightened_intrinsics(
    intrinsics: Sequence[float], size: tuple[float, float], rotation: np.ndarray
) -> tuple[float, float, float, float]:
    """Intrinsics of the straightened image: the middle of the real one stays in the middle.

    Args:
        intrinsics: (fx, fy, cx, cy) of the real image [px].
        size: Width and height [px].
        rotation: From the axes of the real camera to C, (3, 3).
    """
    fx, fy, cx, cy = intrinsics
    if np.array_equal(rotation, np.eye(3)):
        return fx, fy, cx, cy
    column, row = 0.5 * (size[0] - 1.0), 0.5 * (size[1] - 1.0)
    x, y = _ahead(np.array((((column - cx) / fx, (row - cy) / fy, 1.0),)) @ rotation.T)[0].tolist()
    return fx, fy, column - fx * x, row - fy * y


def picture_outline(vehicle: VehicleParams) -> np.ndarray:
    """Corners of the real image, normalised, in C, (4, 2), in order around it."""
    return _ahead(_corners(vehicle.camera_size_px, vehicle.camera_intrinsics_px) @ _rotation(vehicle).T)


def field_of_view(vehicle: VehicleParams) -> FieldOfView:
    """Field of view of the straightened image along the level and the upright line through its middle.

    Args:
        vehicle: Gives the camera's size, intrinsics and turn.
    """
    size, outline = vehicle.camera_size_px, picture_outline(vehicle)
    straight = straightened_intrinsics(vehicle.camera_intrinsics_px, size, _rotation(vehicle))
    (left, up, _), _, (right, down, _), _ = _corners(size, straight)
    x, y = 0.5 * (left + right), 0.5 * (up + down)
    level, upright = _crossings(outline, 1, y), _crossings(outline, 0, x)
    return FieldOfView(max(left, level[0]), min(right, level[1]), max(up, upright[0]), min(down, upright[1]))


def _rotation(vehicle: VehicleParams) -> np.ndarray:
    return camera_rotation(vehicle.camera_turn_deg)


def _corners(size: tuple[float, float], intrinsics: Sequence[float]) -> np.ndarray:
    """Rays to the corners of an image, whose pixels have their centres at integers, (4, 3)."""
    fx, fy, cx, cy = intrinsics
    left, right, up, down = (-0.5 - cx) / fx, (size[0] - 0.5 - cx) / fx, (-0.5 - cy) / fy, (size[1] - 0.5 - cy) / fy
    return np.array(((left, up, 1.0), (right, up, 1.0), (right, down, 1.0), (left, down, 1.0)))


def _ahead(rays: np.ndarray) -> np.ndarray:
    """Normalised points of rays in C, (n, 2)."""
    return rays[:, :2] / np.maximum(rays[:, 2], _LEAST_DEPTH * np.linalg.norm(rays, axis=1))[:, None]


def _crossings(outline: np.ndarray, axis: int, value: float) -> tuple[float, float]:
    """Least and largest other coordinate at which a closed outline, (n, 2), crosses a value of one of its two."""
    found = []
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if (a[axis] < value) != (b[axis] < value):
            part = (value - a[axis]) / (b[axis] - a[axis])
            found.append(float(a[1 - axis] + part * (b[1 - axis] - a[1 - axis])))
    return (min(found), max(found)) if found else (value, value)
