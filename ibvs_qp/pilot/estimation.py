"""Estimation of a flight: sensors in axes of the vehicle, the estimator, and the measurement that follows from both."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.estimator import INERTIAL, Estimator
from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.estimation.wall_motion import BIAS
from ibvs_qp.frames import ordered_product, rotation_from_vector
from ibvs_qp.measurement import FeatureFrame, Measurement, SensorFrame
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.pilot.config import PilotConfig
from ibvs_qp.supervision.supervision import Limits, WrenchSample
from ibvs_qp.validation.sensor_frame import SensorGate

#: Tip to wall before the first plane [m].
ASSUMED_DISTANCE = 0.5
Plane = tuple[float, float, float, float]


class Estimation:
    """Estimates of a flight and the law's measurement.

    Attributes:
        estimator: All filters; its `contact` and `motion` are here, too.

    Args:
        config: Configuration of the flight.
        gate: Gate of the sensor frames.
    """

    def __init__(self, config: PilotConfig, gate: SensorGate) -> None:
        self._config, self._gate = config, gate
        turn = config.controller.vehicle.force_torque_turn_deg
        self._force_axes = rotation_from_vector(np.radians(turn)) if any(turn) else None
        self.estimator = Estimator(config.controller, config.estimation)
        self.contact, self.motion = self.estimator.contact, self.estimator.motion
        self.reset()

    def reset(self) -> None:
        """As before the flight, with the inertial data that the gate assumes until the first frame."""
        self.estimator.reset(self._gate.last)
        self._covariance = self.motion.velocity_variance * np.eye(3)

    def in_body(self, frame: SensorFrame) -> SensorFrame:
        """The frame with force and moment of the sensor in axes of B."""
        if self._force_axes is None:
            return frame
        force, moment = (ordered_product(self._force_axes, part) for part in (frame.wrench[:3], frame.wrench[3:]))
        return dataclasses.replace(frame, wrench=np.concatenate((force, moment)))

    def predict(
        self,
        frame: SensorFrame,
        setpoints: Setpoints,
        plane: tuple[Plane | None, int],
        wrench: WrenchSample | None,
        *,
        frozen: bool,
        press: bool,
    ) -> tuple[ContactState, str]:
        """Estimates of the tick; and an event text if the tip has touched a wall before the observed one.

        Args:
            frame: Sensors, `in_body`.
            setpoints: Motors' model of the controller's last step.
            plane: Wall in C, or None, and its time.
            wrench: Contact wrench in place of the force sensor's, or None.
            frozen: Whether the inertial unit repeats itself.
            press: Of the reference of the tick before: the strategy needs the contact of this one.
        """
        offset = self.contact.surface_offset
        missing = set(INERTIAL) if frozen else self._missing(frame)
        contact = self.estimator.predict(
            frame,
            self._gate.last,
            missing,
            motors=setpoints,
            wrench=wrench,
            plane=plane[0],
            plane_ns=plane[1],
            press=press,
        )
        if self.contact.surface_offset <= offset:
            return contact, ""
        found = f"{contact.push:.1f} N felt {1e3 * self.contact.surface_offset:.0f} mm before the observed surface"
        return contact, f"{found}: its distance starts anew there"

    def _missing(self, frame: SensorFrame) -> set[str]:
        """Inertial sensors that fail, or whose stamps are too old."""
        missing = self._gate.replaced.intersection(INERTIAL)
        oldest = frame.stamp_ns - round(1e9 * self._config.safety.imu_age_s)
        if frame.attitude_stamp_ns is not None and frame.attitude_stamp_ns < oldest:
            missing.add(INERTIAL[0])
        if frame.imu_stamp_ns is not None and frame.imu_stamp_ns < oldest:
            missing.update(INERTIAL[1:])
        return missing

    def correct(self, features: FeatureFrame, rejected: list[str]) -> None:
        """Correct motion and lines with new features at their capture."""
        if self.estimator.correct(features):
            self._covariance = self.motion.velocity_variance * np.eye(3)  # changes nowhere else
        elif features.lines:
            rejected.append("features.lines: not used before the first plane")

    def measurement(
        self,
        frame: SensorFrame,
        guides: Sequence[tuple[TrackedLine, float]],
        plane: tuple[Plane | None, int],
        limits: Limits | None,
        *,
        drifting: bool,
        turning: bool,
    ) -> Measurement:
        """Measurement of the tick, with the lines that the strategy follows and the thrust limits in force.

        It has no velocity if the last one is too old, unless ``drifting``; of a vehicle that is ``turning`` that of the
        centre of mass.
        """
        estimator, motion, contact = self.estimator, self.motion, self.contact.state
        axes, velocity, covariance = estimator.axes, None, None
        if drifting or motion.velocity_age_s < self._config.estimation.velocity_life_s:
            (right, down, *_), rate = motion.state, -contact.speed if turning else contact.rate
            rows = zip(axes.right, axes.down, axes.normal, strict=True)
            velocity = np.array([r * right + d * down - n * rate for r, d, n in rows])
            covariance = self._covariance
        bias_right, bias_down = motion.state[BIAS]
        distance = contact.distance if contact.known else ASSUMED_DISTANCE
        low, high = limits or (None, None)
        return Measurement(
            stamp_ns=frame.stamp_ns,
            attitude=np.array(estimator.attitude),
            angular_velocity=np.array(estimator.rate),
            specific_force=np.array(estimator.force),
            contact_wrench=np.array(estimator.wrench),
            wrench_stamp_ns=estimator.wrench_ns,
            lines=tuple([motion.feature(line, axes, distance, frame.stamp_ns) for line, _ in guides]),
            plane=plane[0] and self.contact.on_felt_surface(plane[0]),
            plane_stamp_ns=plane[1],
            velocity=velocity,
            velocity_covariance=covariance,
            acceleration_bias=np.array(
                [bias_right * r + bias_down * d for r, d in zip(axes.right, axes.down, strict=True)]
            ),
            thrust_min=low,
            thrust_max=high,
            attitude_stamp_ns=frame.attitude_stamp_ns,
            imu_stamp_ns=frame.imu_stamp_ns,
        )
