"""Attitude, rate and specific force to fly by: the measured ones, or estimates of those that fail."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from ibvs_qp.estimation.attitude_steps import AttitudeSteps
from ibvs_qp.estimation.inertial_fallback import InertialFallback
from ibvs_qp.frames import Vector3
from ibvs_qp.measurement import FeatureFrame, SensorFrame
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.validation.fields import SENSOR_FRAME

#: Inertial sensors of a frame.
INERTIAL = ("attitude", "angular_velocity", "specific_force")


class InertialData:
    """Inertial data of one flight.

    Attributes:
        attitude: (w, x, y, z), without steps that the gyro did not see.
        rate: Angular velocity [rad/s], (3,).
        force: Specific force [m/s^2], (3,).

    Args:
        tip_from_camera: Tip from the camera in B [m], (3,).
        tick_s: Nominal control period [s].
    """

    def __init__(self, tip_from_camera: Sequence[float], tick_s: float) -> None:
        self._steps, self._fallback = AttitudeSteps(), InertialFallback(tip_from_camera, tick_s)
        self.reset()

    def reset(self) -> None:
        """As before the first tick."""
        self._steps.reset()
        self._fallback.reset()
        self.attitude, self.rate, self.force = (SENSOR_FRAME.fallbacks[name] for name in INERTIAL)

    @property
    def lost(self) -> bool:
        """Whether the attitude is too uncertain to fly by."""
        return self._fallback.lost

    def measure(self, frame: SensorFrame, measured: Mapping[str, list[float]], dt: float) -> SensorFrame:
        """The frame of a tick whose sensors all work, ``dt`` [s] after the last, with an attitude without steps."""
        self._fallback.reset()
        self.attitude, self.rate, self.force = (measured[name] for name in INERTIAL)
        if (continuous := self._steps.update(self.attitude, self.rate, dt)) is None:
            return frame
        self.attitude = continuous
        return dataclasses.replace(frame, attitude=np.array(continuous))

    def estimate(
        self,
        frame: SensorFrame,
        measured: Mapping[str, list[float]],
        missing: Collection[str],
        dt: float,
        *,
        setpoints: Setpoints,
        normal: Vector3,
        angles: Mapping[int, float],
    ) -> SensorFrame:
        """The frame with estimates in place of the ``missing`` sensors, by the motors' model of the last set-points.

        ``normal`` is the wall's in B, (3,), and ``angles`` are those of the tracked lines on it [rad], by identity.
        """
        fallback = self._fallback
        if not fallback.active:
            fallback.begin(self.attitude, self.rate, normal, angles)
        attitude, rate, force = (None if name in missing else measured[name] for name in INERTIAL)
        fallback.step(frame.stamp_ns, dt, setpoints.angular_acceleration, attitude, rate)
        self.attitude, self.rate = attitude or fallback.attitude, rate or fallback.rate
        self.force = force or setpoints.modelled_force
        values = (self.attitude, self.rate, self.force)
        return dataclasses.replace(frame, **dict(zip(INERTIAL, map(np.array, values), strict=True)))

    def correct(self, features: FeatureFrame, distance: float) -> None:
        """Correct the estimates with a picture at its capture; distance of the tip then [m]."""
        if self._fallback.active:
            self._fallback.correct(features, distance)
