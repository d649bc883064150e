"""Lines between image and wall: (rho, theta) in the picture, (offset, angle) in metres around the tip's wall point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ibvs_qp.measurement import HORIZONTAL, LineFeature
from ibvs_qp.vectors import Row

#: A wall whose normal is this close to gravity's direction is a floor, and has no level direction of its own.
_LEAST_CROSS = 1e-6


@dataclass(slots=True)
class WallAxes:
    """Unit vectors in B as plain numbers: normal into the wall, right and down in the wall plane, and gravity."""

    normal: Sequence[float]
    right: Row
    down: Row
    gravity: Sequence[float]

    @classmethod
    def of(cls, normal: Sequence[float], gravity: Sequence[float]) -> WallAxes:
        """Axes of a wall with a given normal, under a given direction of gravity."""
        (gx, gy, gz), (nx, ny, nz) = gravity, normal
        x, y, z = gy * nz - gz * ny, gz * nx - gx * nz, gx * ny - gy * nx
        length = math.sqrt(x * x + y * y + z * z)
        if length < _LEAST_CROSS:
            length = _LEAST_CROSS
        rx, ry, rz = right = x / length, y / length, z / length
        return cls(normal, right, (ny * rz - nz * ry, nz * rx - nx * rz, nx * ry - ny * rx), gravity)


def wall_line(
    line: LineFeature, axes: WallAxes, tip_from_camera: Sequence[float], distance: float
) -> tuple[float, float, int, float] | None:
    r"""Offset and angle of an image line on the wall.

    The line's interpretation plane is h = (cos, sin, -rho); with the tip's wall point P and the in-plane part of h,
    the offset is :math:`-h \cdot P / |h_\parallel|`.

    Args:
        line: Line at capture.
        axes: Wall axes in B at capture.
        tip_from_camera: Tip relative to the camera in B [m], (3,).
        distance: Tip to wall [m].

    Returns:
        Offset [m], angle of the normal in (right, down) [rad], surface side for that normal, and metres per unit of
        rho; None if the line's plane contains the wall's normal direction only.
    """
    # Interpretation plane in the body: camera (right, down, front) to (front, right, down).
    hx, hy, hz = -line.rho, math.cos(line.theta), math.sin(line.theta)
    (nx, ny, nz), (rx, ry, rz), (dx, dy, dz) = axes.normal, axes.right, axes.down
    tx, ty, tz = tip_from_camera
    fx, fy, fz = tx + distance * nx, ty + distance * ny, tz + distance * nz
    right, down = hx * rx + hy * ry + hz * rz, hx * dx + hy * dy + hz * dz
    length = math.hypot(right, down)
    if length < 1e-3:
        return None
    offset = -(hx * fx + hy * fy + hz * fz) / length
    sign = 1.0 if (down if line.role == HORIZONTAL else right) >= 0.0 else -1.0
    angle = math.atan2(sign * down, sign * right)
    depth = fx * nx + fy * ny + fz * nz
    return sign * offset, angle, int(sign) * line.surface_side, depth / length


def image_line(
    offset: float, angle: float, axes: WallAxes, tip_from_camera: Sequence[float], distance: float
) -> tuple[float, float, float]:
    """Inverse of `wall_line`: (rho, theta) of a line on the wall and metres per unit of rho."""
    # Plain numbers, two lines a tick: normal m of the line in the wall, its direction t = n x m, a point P on it.
    (nx, ny, nz), (rx, ry, rz), (dx, dy, dz) = axes.normal, axes.right, axes.down
    fx, fy, fz = tip_from_camera
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
