"""Attitude, rate and specific force while inertial sensors fail: the motors' model, corrected by what remains."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ibvs_qp.estimation.kalman import DelayedKalman
from ibvs_qp.estimation.wall_lines import WallAxes, wall_line
from ibvs_qp.frames import Vector3, add_scaled, cross, down_in_body, plane_in_body
from ibvs_qp.measurement import FeatureFrame
from ibvs_qp.quaternion import small_difference, turned

#: Order of the filter's state: rotation since the failure [rad], rate [rad/s], unmodelled acceleration [rad/s^2].
ANGLE, RATE, BIAS = 0, 3, 6
#: Spectral densities: of the rate by the motors' model [rad^2/s^3], and of what that model lacks [rad^2/s^5].
RATE_NOISE, BIAS_NOISE = 0.05**2, 0.03**2
#: Standard deviations at the failure: attitude [rad], rate [rad/s], unmodelled acceleration [rad/s^2].
ANGLE_STD, RATE_STD, BIAS_STD = 2e-3, 0.01, 0.3
#: Standard deviations of what remains: attitude and plane or line of a picture [rad], gyro [rad/s].
ATTITUDE_STD, PICTURE_STD, GYRO_STD = 2e-3, 8e-3, 5e-3
#: Refused beyond this many standard deviations.
GATE_SIGMAS = 6.0
#: The attitude is lost when its standard deviation exceeds this [rad]: farther from level than a descent bears.
LOST_STD = math.radians(20.0)


class InertialFallback:
    """Keeps a vehicle level in front of a wall without an inertial unit.

    Thrusts and the observed external moments predict the rotation since the failure. The wall's normal corrects pitch
    and yaw, its lines correct roll, both late; attitude or gyro correct too where one of them remains.

    Attributes:
        active: Whether it is running.
        attitude: (w, x, y, z).

    Args:
        tip_from_camera: Tip from the camera in B [m], (3,).
        tick_s: Nominal control period [s].
    """

    def __init__(self, tip_from_camera: Sequence[float], tick_s: float) -> None:
        self._tip_from_camera = tip_from_camera
        chain, noise = np.zeros((9, 9)), np.repeat((1e-10, RATE_NOISE, BIAS_NOISE), 3)
        chain[ANGLE : ANGLE + 3, RATE : RATE + 3] = chain[RATE : RATE + 3, BIAS : BIAS + 3] = np.eye(3)
        deviation = np.repeat((ANGLE_STD, RATE_STD, BIAS_STD), 3)
        self._filter = DelayedKalman(chain, noise, deviation, tick_s, GATE_SIGMAS)
        self.reset()

    def reset(self) -> None:
        """Not running."""
        self.active, self._stamp, self._corrected = False, -1, -1
        self.attitude: list[float] = [1.0, 0.0, 0.0, 0.0]

    @property
    def rate(self) -> list[float]:
        """Angular velocity [rad/s], (3,)."""
        return self._filter.state[RATE : RATE + 3].tolist()

    @property
    def lost(self) -> bool:
        """Whether the attitude is too uncertain to fly by."""
        if not self.active:
            return False
        dt = (self._stamp - self._corrected) * 1e-9
        ahead = np.array((1.0, dt, 0.5 * dt * dt))  # of angle, rate and bias at the last correction
        noise = RATE_NOISE * dt**3 / 3.0 + BIAS_NOISE * dt**5 / 20.0
        for axis in range(3):
            entries = slice(axis, 9, 3)
            if float(ahead @ self._filter.covariance[entries, entries] @ ahead) + noise > LOST_STD**2:
                return True
        return False

    def begin(
        self, attitude: Sequence[float], rate: Sequence[float], normal: Vector3, angles: Mapping[int, float]
    ) -> None:
        """Start from the last good attitude and rate [rad/s].

        Args:
            attitude: (w, x, y, z).
            rate: (3,).
            normal: Unit vector into the wall, in B, (3,).
            angles: Angle of every tracked line on the wall [rad], by identity.
        """
        self._filter.reset()
        for axis, value in enumerate(rate):
            self._filter.set_entry(RATE + axis, value, RATE_STD)
        self.active, self.attitude, self._start = True, list(attitude), list(attitude)
        self._normal, self._angles = normal, dict(angles)

    def step(
        self,
        stamp_ns: int,
        dt: float,
        acceleration: Sequence[float],
        attitude: Sequence[float] | None,
        rate: Sequence[float] | None,
    ) -> None:
        """Predict one tick.

        Args:
            stamp_ns: Time of the tick.
            dt: Time since the last one [s].
            acceleration: Angular acceleration by the motors' model [rad/s^2], (3,).
            attitude: Measured, (4,), or None.
            rate: Measured [rad/s], (3,), or None.
        """
        state = self._filter.state.tolist()
        for axis in range(3):
            state[ANGLE + axis] += dt * state[RATE + axis]
            state[RATE + axis] += dt * (acceleration[axis] + state[BIAS + axis])
        self._filter.remember(stamp_ns, state, dt)
        self._stamp = stamp_ns
        if self._corrected < 0 or rate is not None or attitude is not None:
            self._corrected = stamp_ns
        if rate is not None:
            for axis in range(3):
                self._filter.correct_entry(stamp_ns, RATE + axis, rate[axis], GYRO_STD**2)
        if attitude is not None:
            for axis, angle in enumerate(small_difference(self._start, attitude)):
                self._filter.correct_entry(stamp_ns, ANGLE + axis, angle, ATTITUDE_STD**2)
        self.attitude = list(turned(self._start, self._filter.state[ANGLE : ANGLE + 3].tolist()))

    def correct(self, frame: FeatureFrame, distance: float) -> None:
        """Correct with the wall's plane and lines of a picture at its capture; distance of the tip then [m]."""
        if frame.plane is None:
            return
        normal, _ = plane_in_body(frame.plane, self._tip_from_camera)
        self._corrected = max(self._corrected, frame.stamp_ns)
        turn = cross(self._normal, add_scaled(self._normal, -1.0, normal))
        for axis in (1, 2):
            self._filter.correct_entry(frame.stamp_ns, ANGLE + axis, turn[axis], PICTURE_STD**2)
        for line in frame.lines:
            past = self._filter.at(frame.stamp_ns)
            if past is None:
                return
            roll = float(past[ANGLE])
            down = down_in_body(turned(self._start, past[ANGLE : ANGLE + 3].tolist()))
            measured = wall_line(line, WallAxes.of(normal, down), self._tip_from_camera, distance)
            if measured is None:
                continue
            expected = self._angles.setdefault(line.track_id, measured.angle)
            self._filter.correct_entry(frame.stamp_ns, ANGLE, roll + expected - measured.angle, PICTURE_STD**2)
        self.attitude = list(turned(self._start, self._filter.state[ANGLE : ANGLE + 3].tolist()))
