r"""Lines and velocity that were measured some time ago, carried to the present by gyro, velocity and accelerometer.

A line is the intersection of the wall, :math:`n \cdot X = d`, and of the plane through the camera and its image,
:math:`m \cdot X = 0` with :math:`m = (\cos\theta, \sin\theta, -\rho)`. After a rotation R and a shift t of the camera,
in its present axes,

.. math:: m' = R^T m + \frac{(R^T m) \cdot t}{d'} n', \quad n' = R^T n, \quad d' = d - n' \cdot t.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca

from ibvs_qp.estimation.motion_history import MotionHistory
from ibvs_qp.frames import R_BODY_CAMERA
from ibvs_qp.symbolic.logic import both, where, wrapped

#: What is later than this counts as late [s]: half a tick at 250 Hz.
LATE_S = 0.002
#: Least distance from camera to wall [m], and least part of a line's ray across the optical axis [-], in divisions.
LEAST_DISTANCE, LEAST_RAY = 0.01, 1e-6
#: Below this angle a rotation vector has no axis [rad].
_NO_AXIS = 1e-9


class Motion(NamedTuple):
    """Motion of the body since a capture.

    Attributes:
        back: Matrix that takes vectors from the axes of the capture to the present ones, (3, 3).
        way: Of the centre of mass [m], (3,).
        change: Of its velocity [m/s], (3,).
    """

    back: ca.SX
    way: ca.SX
    change: ca.SX


class Wall(NamedTuple):
    """Wall in the present camera: n . X = d."""

    normal: ca.SX  # (3,), of any length
    distance: ca.SX


def motion_since(history: MotionHistory, age: ca.SX) -> Motion:
    """Motion since a time ``age`` [s] ago; its history needs velocities."""
    angle, way, change = ca.SX.zeros(3), ca.SX.zeros(3), ca.SX.zeros(3)
    for part in history.since(age):
        angle, way, change = angle + part.angle, way + part.way, change + part.change
    return Motion(rotation_from_vector(angle).T, way, change)


def rotation_from_vector(vector: ca.SX) -> ca.SX:
    """Rotation matrix of a rotation vector [rad], (3, 3)."""
    angle = ca.norm_2(vector)
    cross = ca.skew(vector)
    turning = angle > _NO_AXIS
    safe = where(turning, angle, 1.0)
    first, second = where(turning, ca.sin(safe) / safe, 1.0), where(turning, (1.0 - ca.cos(safe)) / safe**2, 0.5)
    return ca.SX.eye(3) + first * cross + second * (cross @ cross)


def carried_velocity(velocity: ca.SX, motion: Motion) -> ca.SX:
    """Velocity in B at the present [m/s], (3,)."""
    return motion.back @ velocity + motion.change


def in_camera(motion: Motion, camera: ca.DM) -> tuple[ca.SX, ca.SX]:
    """R^T and shift t of a camera at ``camera`` [m] in B, in its present axes."""
    shift, axes = motion.way + camera - motion.back @ camera, ca.DM(R_BODY_CAMERA)
    return axes.T @ motion.back @ axes, axes.T @ shift


def carried_wall(plane: ca.SX, motion: Motion, camera: ca.DM) -> Wall:
    """Wall by a plane (A, B, C, D) of the capture."""
    turn, shift = in_camera(motion, camera)
    normal = turn @ plane[:3]
    return Wall(normal, -plane[3] - ca.dot(normal, shift))


def carried_line(rho: ca.SX, theta: ca.SX, wall: Wall, motion: Motion, camera: ca.DM) -> tuple[ca.SX, ca.SX]:
    """Line (rho, theta) at the present; as it was when seen from within the wall, or edge-on."""
    turn, shift = in_camera(motion, camera)
    ray = turn @ ca.vertcat(ca.cos(theta), ca.sin(theta), -rho)
    ray = ray + ca.dot(ray, shift) / ca.fmax(wall.distance, LEAST_DISTANCE) * wall.normal
    length = ca.norm_2(ray[:2])
    good = both(length > LEAST_RAY, length < math.inf)
    safe = where(good, length, 1.0)
    moved = aligned(-ray[2] / safe, ca.atan2(ray[1], ray[0]), theta)
    return where(good, moved[0], rho), where(good, moved[1], theta)


def aligned(rho: ca.SX, theta: ca.SX, reference: ca.SX) -> tuple[ca.SX, ca.SX]:
    """The sign of a line whose normal has a positive dot product with the reference's; `ibvs_qp.frames.align_line`."""
    error = wrapped(theta - reference)
    other = ca.fabs(error) > 0.5 * math.pi
    return where(other, -rho, rho), reference + where(other, wrapped(error - math.pi), error)
