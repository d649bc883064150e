"""Estimation of a flight: inertial data, tared wrench, contact, motion along the wall, and their measurement."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from ibvs_qp.estimation.contact import ContactEstimator
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.plane_acceleration import PlaneAcceleration
from ibvs_qp.estimation.stamps import HISTORY, StampRing
from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.estimation.wall_lines import WallAxes
from ibvs_qp.estimation.wall_motion import BIAS, WallMotion
from ibvs_qp.estimation.wrench_tare import WrenchTare
from ibvs_qp.frames import Vector3, add_scaled, down_in_body, plane_in_body, rotation_from_vector
from ibvs_qp.measurement import FeatureFrame, Measurement, SensorFrame
from ibvs_qp.model.setpoints import Setpoints
from ibvs_qp.pilot.config import PilotConfig
from ibvs_qp.pilot.inertial import INERTIAL, InertialData
from ibvs_qp.supervision.supervision import Limits, WrenchSample
from ibvs_qp.validation.sensor_frame import SensorGate

#: Tip to wall before the first plane [m].
ASSUMED_DISTANCE = 0.5
Plane = tuple[float, float, float, float]


class AttitudeHistory:
    """Attitude and integrated gyro of the last ticks, for pictures that arrive late.

    Args:
        ticks: Stamps of the ticks.
    """

    def __init__(self, ticks: StampRing) -> None:
        self._ticks = ticks
        self.reset()

    def reset(self) -> None:
        """As before the first tick."""
        self._turn: Vector3 = (0.0, 0.0, 0.0)  # integrated gyro [rad]
        self._attitudes, self._turns = [[1.0, 0.0, 0.0, 0.0]] * HISTORY, [self._turn] * HISTORY
        self._rates: list[Sequence[float]] = [self._turn] * HISTORY

    def remember(self, attitude: list[float], rate: Sequence[float], dt: float) -> None:
        """Store attitude (w, x, y, z) and angular velocity [rad/s] of the newest tick, ``dt`` [s] after the last."""
        self._turn = add_scaled(self._turn, dt, rate)
        slot = self._ticks.slot(0)
        self._attitudes[slot], self._turns[slot], self._rates[slot] = attitude, self._turn, tuple(rate)

    def attitude(self, stamp_ns: int) -> list[float]:
        """Attitude at a stamp, (w, x, y, z)."""
        return self._attitudes[self._ticks.nearest_slot(stamp_ns)]

    def rate(self, stamp_ns: int) -> Sequence[float]:
        """Angular velocity at a stamp [rad/s], (3,)."""
        return self._rates[self._ticks.nearest_slot(stamp_ns)]

    def turn(self, begin_ns: int, end_ns: int) -> np.ndarray:
        """Integral of the angular velocity between two stamps [rad], (3,)."""
        begin, end = (self._turns[self._ticks.nearest_slot(stamp)] for stamp in (begin_ns, end_ns))
        return np.subtract(end, begin)


class Estimation:
    """All filters of a flight.

    Attributes:
        inertial: Attitude, rate and specific force to fly by.
        tare: Wrench of the contact from raw samples of the force sensor.
        contact: Wall and contact.
        motion: Motion along the wall, and its lines.
        history: Attitude and turn of the last ticks.

    Args:
        config: Configuration of the flight.
    """

    def __init__(self, config: PilotConfig) -> None:
        self._config, settings, vehicle = config, config.controller, config.controller.vehicle
        tip, camera = np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m)
        self._tip_from_camera = (tip - camera).tolist()
        turn = vehicle.force_torque_turn_deg
        self._force_axes = rotation_from_vector(np.radians(turn)) if any(turn) else None
        self.inertial = InertialData(self._tip_from_camera, settings.tick_s)
        self.tare = WrenchTare(vehicle, config.estimation)
        self.contact = ContactEstimator(settings)
        self.motion = WallMotion(tip, camera, settings.tick_s, config.estimation)
        self._plane = PlaneAcceleration(config.estimation, settings.brush.force_delay_s, settings.compiled)
        self.history = AttitudeHistory(self.motion.ticks)
        self.reset()

    def reset(self) -> None:
        """As before the flight."""
        for part in (self.inertial, self.tare, self.contact, self.motion, self._plane, self.history):
            part.reset()
        self._covariance = self.motion.velocity_variance * np.eye(3)

    def doubt(self) -> None:
        """Ticks are missing for an unknown time."""
        self.contact.doubt()
        self.motion.doubt()
        self._plane.reset()

    def sense(self, frame: SensorFrame, gate: SensorGate, frozen: bool, setpoints: Setpoints, dt: float) -> SensorFrame:
        """The frame with inertial data to fly by, estimated where they fail or repeat, and the wrench in axes of B."""
        if self._force_axes is not None:
            force, moment = self._force_axes @ frame.wrench[:3], self._force_axes @ frame.wrench[3:]
            frame = dataclasses.replace(frame, wrench=np.concatenate((force, moment)))
        missing = {name for name in INERTIAL if name in gate.replaced} | self._stale(frame)
        if frozen:
            missing = set(INERTIAL)
        if not missing:
            return self.inertial.measure(frame, gate.last, dt)
        angles = {identity: line.angle for identity, line in self.motion.lines.items()}
        normal = self.contact.state.normal
        return self.inertial.estimate(frame, gate.last, missing, dt, setpoints=setpoints, normal=normal, angles=angles)

    def _stale(self, frame: SensorFrame) -> set[str]:
        """Inertial sensors whose stamps are too old."""
        oldest, stale = frame.stamp_ns - round(1e9 * self._config.safety.imu_age_s), set[str]()
        if frame.attitude_stamp_ns is not None and frame.attitude_stamp_ns < oldest:
            stale.add(INERTIAL[0])
        if frame.imu_stamp_ns is not None and frame.imu_stamp_ns < oldest:
            stale.update(INERTIAL[1:])
        return stale

    def tared_wrench(self, frame: SensorFrame) -> WrenchSample:
        """Contact wrench on the vehicle; the bias is averaged while the tip is away from the wall.

        Away by the contact of the tick before, because the contact of this tick needs the wrench.
        """
        last = self.contact.state
        free = not last.in_contact and last.distance > self._config.estimation.tare_distance_m
        return self.tare.update(frame.wrench, frame.wrench_stamp_ns, self.inertial.force, free), frame.wrench_stamp_ns

    def update_contact(
        self, stamp_ns: int, sample: WrenchSample, plane: Plane | None, plane_ns: int, press: bool
    ) -> tuple[ContactState, str]:
        """Contact at the tick; and in words that the tip has touched a wall before the seen one, if it has.

        ``press`` is that of the reference of the tick before: the strategy needs the contact of this one.
        """
        offset, inertial = self.contact.surface_offset, self.inertial
        contact = self.contact.update(
            stamp_ns=stamp_ns,
            angular_velocity=inertial.rate,
            specific_force=inertial.force,
            down=down_in_body(inertial.attitude),
            contact_wrench=sample[0],
            wrench_stamp_ns=sample[1],
            plane=plane,
            plane_stamp_ns=plane_ns,
            press=press,
        )
        if self.contact.surface_offset <= offset:
            return contact, ""
        found = f"{contact.push:.1f} N felt {1e3 * self.contact.surface_offset:.0f} mm before the seen surface"
        return contact, f"{found}: its distance starts anew there"

    def update_motion(
        self,
        stamp_ns: int,
        wrench: np.ndarray,
        features: FeatureFrame | None,
        setpoints: Setpoints,
        dt: float,
        rejected: list[str],
    ) -> WallAxes:
        """Motion along the wall at the tick, corrected with new features at their capture; axes of the wall in B."""
        contact, inertial, plane, config = self.contact.state, self.inertial, self._plane, self._config
        axes = WallAxes.of(contact.normal, down_in_body(inertial.attitude))
        felt = (wrench[:3] / config.controller.vehicle.mass_kg).tolist()
        use_model = contact.in_contact and self.motion.velocity_age_s < config.estimation.velocity_life_s
        plane.update(dt, inertial.force, setpoints.motors_force, felt, contact.normal, use_model)
        self.motion.predict(stamp_ns, axes, plane.force, inertial.rate, dt, plane.density)
        self.history.remember(inertial.attitude, inertial.rate, dt)
        if features is not None:
            self._correct_motion(features, rejected)
        return axes

    def _correct_motion(self, features: FeatureFrame, rejected: list[str]) -> None:
        """Correct motion and lines at the time of capture."""
        contact = self.contact.state
        if features.plane is not None and self.contact.plane_ns == features.stamp_ns:
            normal, distance = plane_in_body(self.contact.on_felt_surface(features.plane), self._tip_from_camera)
        elif contact.known:
            normal, distance = contact.normal, contact.distance
        else:
            if features.lines:
                rejected.append("features.lines: not used before the first plane")
            return
        self.inertial.correct(features, distance)
        gravity = down_in_body(self.history.attitude(features.stamp_ns))
        self.motion.correct(features, WallAxes.of(normal, gravity), distance)
        self._covariance = self.motion.velocity_variance * np.eye(3)  # changes nowhere else

    def measurement(
        self,
        frame: SensorFrame,
        sample: WrenchSample,
        axes: WallAxes,
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
        contact, motion = self.contact.state, self.motion
        velocity = covariance = None
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
            attitude=frame.attitude,
            angular_velocity=frame.angular_velocity,
            specific_force=frame.specific_force,
            contact_wrench=sample[0],
            wrench_stamp_ns=sample[1],
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
