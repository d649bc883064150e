"""Lines between image and wall: (rho, theta) in the image, (offset, angle) in metres around the tip's wall point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ibvs_qp.frames import Vector3, add_scaled, cross, dot
from ibvs_qp.measurement import HORIZONTAL, LineFeature

#: A wall whose normal is this close to gravity's direction is a floor and has no level direction of its own.
LEAST_CROSS = 1e-6
#: A line whose interpretation plane is this close to parallel to the wall has no place on it.
LEAST_IN_PLANE = 1e-3


@dataclass(frozen=True, slots=True)
class WallAxes:
    """Unit vectors in B: normal into the wall, right and down in the wall plane, and gravity."""

    normal: Sequence[float]
    right: Vector3
    down: Vector3
    gravity: Sequence[float]

    @classmethod
    def of(cls, normal: Sequence[float], gravity: Sequence[float]) -> WallAxes:
        """Axes of a wall with a given normal, under a given direction of gravity."""
        across = cross(gravity, normal)
        length = max(math.sqrt(dot(across, across)), LEAST_CROSS)
        right = across[0] / length, across[1] / length, across[2] / length
        return cls(normal, right, cross(normal, right), gravity)


@dataclass(frozen=True, slots=True)
class MeasuredLine:
    """A line on the wall.

    Attributes:
        offset: Signed distance from the tip's wall point along the normal [m].
        angle: Angle of the normal in (right, down) [rad].
        surface_side: As in `LineFeature`, for this normal.
        scale: Metres per unit of rho.
        middle: Middle of the visible piece along the line, from the foot of the tip's wall point towards the normal
            turned from right to down by 90 degrees [m]; NaN without end points.
        length: Length of that piece [m].
    """

    offset: float
    angle: float
    surface_side: int
    scale: float
    middle: float = math.nan
    length: float = 0.0


def wall_line(
    line: LineFeature, axes: WallAxes, tip_from_camera: Sequence[float], distance: float
) -> MeasuredLine | None:
    r"""Image line on the wall.

    The line's interpretation plane has the normal h = (cos, sin, -rho) in C; with the tip's wall point P and the
    in-plane part of h, the offset is :math:`-h \cdot P / |h_\parallel|`.

    Args:
        line: Line at capture.
        axes: Wall axes in B at capture.
        tip_from_camera: Tip relative to the camera in B [m], (3,).
        distance: Tip to wall [m].

    Returns:
        The line; None if its interpretation plane is parallel to the wall.
    """
    h = -line.rho, math.cos(line.theta), math.sin(line.theta)  # in B: (front, right, down)
    right, down = dot(h, axes.right), dot(h, axes.down)
    length = math.hypot(right, down)
    if length < LEAST_IN_PLANE:
        return None
    point = add_scaled(tip_from_camera, distance, axes.normal)
    sign = 1.0 if (down if line.role == HORIZONTAL else right) >= 0.0 else -1.0
    depth = dot(point, axes.normal)
    ends = _along(line, axes, point, depth, (sign * right / length, sign * down / length))
    return MeasuredLine(
        offset=-sign * dot(h, point) / length,
        angle=math.atan2(sign * down, sign * right),
        surface_side=int(sign) * line.surface_side,
        scale=depth / length,
        middle=0.5 * sum(ends) if ends else math.nan,
        length=abs(ends[1] - ends[0]) if ends else 0.0,
    )


def _along(line: LineFeature, axes: WallAxes, point: Vector3, depth: float, normal: tuple[float, float]) -> list[float]:
    """Place of both ends of the visible piece along a line with that normal (right, down) [m]; [] without ends."""
    if line.segment is None:
        return []
    places = []
    for x, y in line.segment.tolist():
        towards = axes.normal[0] + x * axes.normal[1] + y * axes.normal[2]
        if towards < LEAST_IN_PLANE:
            return []
        ray = depth / towards
        away = ray - point[0], ray * x - point[1], ray * y - point[2]
        places.append(normal[0] * dot(axes.down, away) - normal[1] * dot(axes.right, away))
    return places


def image_line(
    offset: float, angle: float, axes: WallAxes, tip_from_camera: Sequence[float], distance: float
) -> tuple[float, float, float]:
    """Inverse of `wall_line`: (rho, theta) of a line on the wall and the camera's depth in front of it [m]."""
    c, s, (rx, ry, rz), (dx, dy, dz) = math.cos(angle), math.sin(angle), axes.right, axes.down
    foot = add_scaled(tip_from_camera, distance, axes.normal)
    # Normal of the line in the wall, its direction, and a point on it.
    normal = c * rx + s * dx, c * ry + s * dy, c * rz + s * dz
    along, point = cross(axes.normal, normal), add_scaled(foot, offset, normal)
    front, right, down = cross(point, along)  # normal of the interpretation plane, in B
    length = math.hypot(right, down)
    if right * normal[1] + down * normal[2] < 0.0:
        length = -length
    return -front / length, math.atan2(down / length, right / length), dot(foot, axes.normal)
