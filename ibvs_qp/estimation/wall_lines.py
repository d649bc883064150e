"""Lines between image and wall: (rho, theta) in the picture, (offset, angle) in metres around the tip's wall point."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA, cross
from ibvs_qp.measurement import HORIZONTAL, LineFeature


@dataclass(slots=True)
class WallAxes:
    """Unit vectors in B: normal into the wall, right and down in the wall plane, and gravity."""

    normal: np.ndarray
    right: np.ndarray
    down: np.ndarray
    gravity: np.ndarray

    @classmethod
    def of(cls, normal: np.ndarray, gravity: np.ndarray) -> WallAxes:
        """Axes of a wall with a given normal, under a given direction of gravity."""
        right = cross(gravity, normal)
        right = right / max(math.sqrt(float(right @ right)), 1e-6)
        return cls(normal=normal, right=right, down=cross(normal, right), gravity=gravity)


def wall_line(
    line: LineFeature, axes: WallAxes, tip_from_camera: np.ndarray, distance: float
) -> tuple[float, float, int, float, np.ndarray | None] | None:
    r"""Offset and angle of an image line on the wall.

    The line's interpretation plane is h = (cos, sin, -rho); with the tip's wall point P and the in-plane part of h,
    the offset is :math:`-h \cdot P / |h_\parallel|`.

    Args:
        line: Line at capture.
        axes: Wall axes in B at capture.
        tip_from_camera: Tip relative to the camera in B [m], (3,).
        distance: Tip to wall [m].

    Returns:
        Offset [m], angle of the normal in (right, down) [rad], surface side for that normal, metres per unit of rho,
        and the segment's ends relative to the wall point in (right, down) [m], (2, 2), or None; None as a whole if
        the line's plane contains the wall's normal direction only.
    """
    h = R_BODY_CAMERA @ np.array([math.cos(line.theta), math.sin(line.theta), -line.rho])
    foot = tip_from_camera + distance * axes.normal
    right, down = float(h @ axes.right), float(h @ axes.down)
    length = math.hypot(right, down)
    if length < 1e-3:
        return None
    offset = -float(h @ foot) / length
    sign = 1.0 if (down if line.role == HORIZONTAL else right) >= 0.0 else -1.0
    angle = math.atan2(sign * down, sign * right)
    ends = None
    if line.segment is not None:
        rays = np.column_stack((line.segment, np.ones(2))) @ R_BODY_CAMERA.T
        depth = float(foot @ axes.normal) / (rays @ axes.normal)
        points = rays * depth[:, None] - foot
        ends = np.column_stack((points @ axes.right, points @ axes.down))
    scale = float(foot @ axes.normal) / length
    return sign * offset, angle, int(sign) * line.surface_side, scale, ends


def image_line(
    offset: float, angle: float, axes: WallAxes, tip_from_camera: np.ndarray, distance: float
) -> tuple[float, float, float]:
    """Inverse of `wall_line`: (rho, theta) of a line on the wall and metres per unit of rho."""
    # Plain numbers, two lines a tick: normal m of the line in the wall, its direction t = n x m, a point P on it.
    nx, ny, nz = axes.normal.tolist()
    rx, ry, rz = axes.right.tolist()
    dx, dy, dz = axes.down.tolist()
    fx, fy, fz = tip_from_camera.tolist()
    fx, fy, fz = fx + distance * nx, fy + distance * ny, fz + distance * nz
    c, s = math.cos(angle), math.sin(angle)
    mx, my, mz = c * rx + s * dx, c * ry + s * dy, c * rz + s * dz
    px, py, pz = fx + offset * mx, fy + offset * my, fz + offset * mz
    tx, ty, tz = ny * mz - nz * my, nz * mx - nx * mz, nx * my - ny * mx
    # interpretation plane h = P x t, from body (front, right, down) to camera (right, down, front)
    front, right, down = py * tz - pz * ty, pz * tx - px * tz, px * ty - py * tx
    length = math.hypot(right, down)
    if right * my + down * mz < 0.0:
        length = -length
    return -front / length, math.atan2(down / length, right / length), fx * nx + fy * ny + fz * nz
