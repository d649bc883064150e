r"""Motion of the body over the last third of a second, which carries late lines and velocities to the present.

A line is the intersection of the wall, :math:`n \cdot X = d`, and of the plane through the camera and its image,
:math:`m \cdot X = 0` with :math:`m = (\cos\theta, \sin\theta, -\rho)`. After a rotation R and a shift t of the camera,
in its present axes,

.. math:: m' = R^T m + \frac{(R^T m) \cdot t}{d'} n', \quad n' = R^T n, \quad d' = d - n' \cdot t.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import casadi as ca

from ibvs_qp.estimation.tick_history import AHEAD, BEFORE
from ibvs_qp.frames import R_BODY_CAMERA
from ibvs_qp.symbolic.logic import Number, both, where, wrapped
from ibvs_qp.symbolic.signals import Signals

#: Least length of a full bin [s]: four ticks at 250 Hz, a tenth of a rotor's or the brush's time constants. All bins
#: but the newest are full: 0.304 s at least at any tick, which covers the oldest line that counts (0.3 s).
BIN_S, BINS = 0.016, 20
#: Rounding of the sum of a bin's ticks [s], far below a tick.
_ROUNDING_S = 1e-6
#: Smallest duration of a bin in a division [s].
_LEAST_S = 1e-9
#: A sample later than this counts as late [s]: half a tick at 250 Hz.
LATE_S = 0.002
#: Least distance from camera to wall [m], and least part of a line's ray across the optical axis [-], in divisions.
LEAST_DISTANCE, LEAST_RAY = 0.01, 1e-6
#: Below this angle a rotation vector has no axis [rad].
_NO_AXIS = 1e-9


class Step(NamedTuple):
    """Part of one bin that lies after a past time."""

    duration: ca.SX  # [s]
    angle: ca.SX  # rotation vector in B [rad], (3,)
    change: ca.SX  # change of the velocity in B [m/s], (3,)
    way: ca.SX  # way of the centre of mass in B [m], (3,); zero in a history without velocities


class MotionHistory:
    r"""Integrals of angular velocity, acceleration and velocity in bins of `BIN_S` or a tick more, the newest first.

    A late sample is carried to the present by the integrals since its capture; within a bin they grow linearly.

    Args:
        signals: Registry.
        elapsed: Time since the last tick [s].
        rate: Angular velocity in B [rad/s], (3,).
        acceleration: Acceleration without gravity in B [m/s^2], (3,).
        tick_s: Nominal control period [s].
        velocity: Velocity in B [m/s], (3,), or None where no way is needed.
    """

    def __init__(
        self,
        signals: Signals,
        elapsed: ca.SX,
        rate: ca.SX,
        acceleration: ca.SX,
        tick_s: float,
        velocity: ca.SX | None = None,
    ) -> None:
        self._tick_s = tick_s
        added = [elapsed, elapsed * rate, elapsed * acceleration]
        names = ["history.duration", "history.angle", "history.change"]
        if velocity is not None:
            added.append(elapsed * velocity)
            names.append("history.way")
        old = [
            ca.reshape(signals.state(name, part.numel() * BINS), -1, BINS)
            for name, part in zip(names, added, strict=True)
        ]
        full = old[0][0] > BIN_S - _ROUNDING_S
        self._bins = []
        for name, bins, part in zip(names, old, added, strict=True):
            shifted = ca.horzcat(part, bins[:, :-1])
            grown = ca.horzcat(bins[:, 0] + part, bins[:, 1:])
            self._bins.append(where(full, shifted, grown))
            signals.remember(name, ca.vec(self._bins[-1]))

    def covers(self, age: ca.SX) -> ca.SX:
        """Whether a sample of an age [s] lies within the time remembered."""
        length = ca.sum2(self._bins[0])
        return both(age >= -AHEAD * self._tick_s, age <= length + BEFORE * self._tick_s)

    def since(self, age: ca.SX) -> Iterator[Step]:
        """Parts of the bins after a time ``age`` [s] ago, the newest first."""
        duration, angle, change, *ways = self._bins
        begin: Number = 0.0
        for place in range(BINS):
            length = duration[place]
            share = ca.fmin(ca.fmax((age - begin) / ca.fmax(length, _LEAST_S), 0.0), 1.0)
            way = share * ways[0][:, place] if ways else ca.SX.zeros(3)
            yield Step(share * length, share * angle[:, place], share * change[:, place], way)
            begin = begin + length


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
    """Line (rho, theta) at the present; unchanged for a camera inside the wall, or edge-on."""
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
