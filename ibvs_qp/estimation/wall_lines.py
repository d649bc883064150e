"""Lines between image and wall: (rho, theta) in the image, (offset, angle) in metres around the tip's wall point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca

from ibvs_qp.frames import add_scaled, cross, dot
from ibvs_qp.symbolic.logic import both, where

#: A wall whose normal is this close to gravity's direction is a floor and has no level direction of its own.
LEAST_CROSS = 1e-6
#: A line whose interpretation plane is this close to parallel to the wall has no place on it.
LEAST_IN_PLANE = 1e-3


@dataclass(frozen=True, slots=True)
class WallAxes:
    """Unit vectors in B, of numbers or of symbols: normal into the wall, right and down in its plane, and gravity."""

    normal: Any
    right: Any
    down: Any
    gravity: Any

    @classmethod
    def of(cls, normal: Sequence[Any], gravity: Sequence[Any]) -> WallAxes:
        """Axes of a wall by its normal and the direction of gravity: right is level, down completes it."""
        across = cross(gravity, normal)
        length = ca.fmax(ca.sqrt(dot(across, across)), LEAST_CROSS)
        right = across[0] / length, across[1] / length, across[2] / length
        return cls(normal, right, cross(normal, right), gravity)

    @classmethod
    def of_symbols(cls, normal: ca.SX, gravity: ca.SX) -> WallAxes:
        """The same of vectors of symbols, (3,) each."""
        axes = cls.of(ca.vertsplit(normal), ca.vertsplit(gravity))
        return cls(normal, ca.vertcat(*axes.right), ca.vertcat(*axes.down), gravity)

    def in_body(self, right: ca.SX, down: ca.SX) -> ca.SX:
        """A vector of the wall plane in B, (3,); axes of symbols."""
        return right * self.right + down * self.down


class MeasuredLine(NamedTuple):
    """A line on the wall."""

    known: ca.SX  # 0 where its interpretation plane is parallel to the wall
    offset: ca.SX  # signed distance from the tip's wall point along the normal [m]
    angle: ca.SX  # of the normal in (right, down) [rad]
    sign: ca.SX  # -1 where that normal is opposite to that of the image line
    scale: ca.SX  # metres per unit of rho
    middle: ca.SX  # of the visible piece, from the foot of the tip's wall point along the normal turned by 90 deg [m]
    length: ca.SX  # of that piece [m]; negative without end points


def wall_line(
    rho: ca.SX,
    theta: ca.SX,
    vertical: ca.SX,
    ends: Sequence[Sequence[ca.SX]],
    axes: WallAxes,
    tip_from_camera: list[float],
    distance: ca.SX,
) -> MeasuredLine:
    r"""Image line on the wall.

    The line's interpretation plane has the normal h = (cos, sin, -rho) in C; with the tip's wall point P and the
    in-plane part of h, the offset is :math:`-h \cdot P / |h_\parallel|`. The normal points down, of a vertical line to
    the right.

    Args:
        rho: Of the line at capture [-].
        theta: Of the line [rad].
        vertical: Whether its role is vertical.
        ends: End points of the visible piece, normalised.
        axes: Wall axes in B at capture, of vectors.
        tip_from_camera: Tip relative to the camera in B [m], (3,).
        distance: Tip to wall [m].
    """
    h = ca.vertcat(-rho, ca.cos(theta), ca.sin(theta))  # in B: (front, right, down)
    right, down = ca.dot(h, axes.right), ca.dot(h, axes.down)
    length = ca.sqrt(right * right + down * down)
    known = length >= LEAST_IN_PLANE
    length = where(known, length, 1.0)
    point = ca.DM(tip_from_camera) + distance * axes.normal
    sign = where(where(vertical, right, down) >= 0.0, 1.0, -1.0)
    depth, across = ca.dot(point, axes.normal), (sign * right / length, sign * down / length)
    places, in_front = [], ca.SX(1.0)
    for x, y in ends:
        ray = ca.vertcat(1.0, x, y)
        towards = ca.dot(ray, axes.normal)
        away = depth / ca.fmax(towards, LEAST_IN_PLANE) * ray - point
        places.append(across[0] * ca.dot(axes.down, away) - across[1] * ca.dot(axes.right, away))
        in_front = both(in_front, towards >= LEAST_IN_PLANE)
    first, last = places
    return MeasuredLine(
        known=known,
        offset=-sign * ca.dot(h, point) / length,
        angle=ca.atan2(sign * down, sign * right),
        sign=sign,
        scale=depth / length,
        middle=0.5 * (first + last),
        length=where(in_front, ca.fabs(last - first), -1.0),
    )


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
    length = math.sqrt(right * right + down * down)  # the bits of the C library, which hypot has not
    if right * normal[1] + down * normal[2] < 0.0:
        length = -length
    return -front / length, math.atan2(down / length, right / length), dot(foot, axes.normal)
