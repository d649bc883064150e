"""Lines and velocity that were measured some time ago, carried to the present by gyro, velocity and accelerometer."""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ibvs_qp.estimation.stamps import HISTORY
from ibvs_qp.frames import GRAVITY, R_BODY_CAMERA, align_line, down_in_body, rotation_from_vector
from ibvs_qp.measurement import LineFeature, Measurement

#: What is later than this counts as late [ns]: half a tick at 250 Hz.
LATE_NS = 2_000_000
#: Least distance from camera to wall [m], and least part of a line's ray across the optical axis [-], in divisions.
LEAST_DISTANCE, LEAST_RAY = 0.01, 1e-6


class _Sample(NamedTuple):
    """Motion over one tick, in B."""

    begin_ns: int
    end_ns: int
    rate: list[float]  # [rad/s]
    velocity: list[float]  # [m/s]
    acceleration: list[float]  # [m/s^2]


class Motion(NamedTuple):
    """Motion of the body from a stamp to the present, small angles.

    Attributes:
        rotation: Axes of the present in those of the stamp, (3, 3).
        shift: Way of the centre of mass [m], in axes of the present, (3,).
        change: Change of its velocity [m/s], (3,).
    """

    rotation: np.ndarray
    shift: np.ndarray
    change: np.ndarray


class LateSamples:
    r"""Carries late lines and a late velocity of measurements to the time of their tick.

    A line is the intersection of the wall, :math:`n \cdot X = d`, and of the plane through the camera and its image,
    :math:`m \cdot X = 0` with :math:`m = (\cos\theta, \sin\theta, -\rho)`. After a rotation R and a shift t of the
    camera, in its present axes,

    .. math:: m' = R^T m + \frac{(R^T m) \cdot t}{d'} n', \quad n' = R^T n, \quad d' = d - n' \cdot t.

    Nothing is stored until a first late sample comes: that one is carried by the motion of its tick alone.

    Args:
        camera: Camera centre in B [m], (3,).
    """

    def __init__(self, camera: Sequence[float]) -> None:
        self._camera = np.array(camera, float)
        self.reset()

    def reset(self) -> None:
        """As before the first tick."""
        self._samples: deque[_Sample] = deque(maxlen=HISTORY)
        self._used, self._velocity = False, [0.0, 0.0, 0.0]
        self._motions: dict[int, Motion] = {}  # of this tick, by stamp

    def carried(self, measurement: Measurement) -> Measurement:
        """The measurement with its lines and its velocity at the present time."""
        now, oldest = measurement.stamp_ns, measurement.stamp_ns - LATE_NS
        lines, velocity_ns = measurement.lines, measurement.velocity_stamp_ns
        late = any([0 < line.stamp_ns < oldest for line in lines])
        aged = measurement.velocity is not None and velocity_ns is not None and velocity_ns < oldest
        if not (late or aged or self._used):
            return measurement
        changes = {}
        self._add(measurement)
        if aged and measurement.velocity is not None and velocity_ns is not None:
            motion = self._since(velocity_ns, now)
            velocity = motion.rotation.T @ measurement.velocity + motion.change
            changes = {"velocity": velocity, "velocity_stamp_ns": now}
        if measurement.velocity is not None:
            self._velocity = changes.get("velocity", measurement.velocity).tolist()
        if late and measurement.plane is not None:
            plane = self._plane(measurement.plane, self._since(measurement.plane_stamp_ns, now))
            changes["lines"] = tuple(
                self._line(line, plane, now) if 0 < line.stamp_ns < oldest else line for line in lines
            )
        return dataclasses.replace(measurement, **changes) if changes else measurement

    def _add(self, measurement: Measurement) -> None:
        """Store the motion of the tick; velocity of the last one, since that of the present may be late."""
        end, force = measurement.stamp_ns, measurement.specific_force
        begin = self._samples[-1].end_ns if self._samples else -1
        down = np.array(down_in_body(measurement.attitude.tolist()))
        acceleration = np.zeros(3) if force is None else force + GRAVITY * down
        velocity = self._velocity if self._used or measurement.velocity is None else measurement.velocity.tolist()
        self._samples.append(
            _Sample(begin, end, measurement.angular_velocity.tolist(), velocity, acceleration.tolist())
        )
        self._used = True
        self._motions.clear()

    def _since(self, stamp_ns: int, now: int) -> Motion:
        """Motion from a stamp to now; lines, plane and velocity of one picture share it."""
        if stamp_ns not in self._motions:
            self._motions[stamp_ns] = self._integrated(stamp_ns, now)
        return self._motions[stamp_ns]

    def _integrated(self, stamp_ns: int, now: int) -> Motion:
        angle, shift, change, covered = np.zeros(3), np.zeros(3), np.zeros(3), now
        for sample in reversed(self._samples):
            begin = stamp_ns if sample.begin_ns < 0 else max(sample.begin_ns, stamp_ns)
            dt = max(min(sample.end_ns, covered) - begin, 0) * 1e-9
            angle += dt * np.array(sample.rate)
            shift += dt * np.array(sample.velocity)
            change += dt * np.array(sample.acceleration)
            covered = min(covered, begin)
            if covered <= stamp_ns:
                break
        return Motion(rotation_from_vector(angle), shift, change)

    def _in_camera(self, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
        """Rotation matrix R^T and shift t of the camera, in its present axes."""
        back = motion.rotation.T
        shift = motion.shift + self._camera - back @ self._camera
        return R_BODY_CAMERA.T @ back @ R_BODY_CAMERA, R_BODY_CAMERA.T @ shift

    def _plane(self, plane: Sequence[float], motion: Motion) -> tuple[np.ndarray, float]:
        """Normal and distance of the wall, n . X = d, in the present camera."""
        turn, shift = self._in_camera(motion)
        normal = turn @ np.array(plane[:3])
        return normal, -plane[3] - float(normal @ shift)

    def _line(self, line: LineFeature, plane: tuple[np.ndarray, float], now: int) -> LineFeature:
        turn, shift = self._in_camera(self._since(line.stamp_ns, now))
        normal, distance = plane
        ray = turn @ np.array((math.cos(line.theta), math.sin(line.theta), -line.rho))
        ray = ray + float(ray @ shift) / max(distance, LEAST_DISTANCE) * normal
        length = math.hypot(ray[0], ray[1])
        if not LEAST_RAY < length < math.inf:  # seen from within the wall, or edge-on
            return line
        rho, theta = align_line(-ray[2] / length, math.atan2(ray[1], ray[0]), line.theta)
        return dataclasses.replace(line, rho=float(rho), theta=float(theta), stamp_ns=now)
