"""From measurement and reference to what is wanted of every direction: shared word for word by both laws."""

from __future__ import annotations

import math

import numpy as np

from allocation.effectiveness import control_effectiveness
from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.contact import ContactEstimator
from ibvs_qp.estimation.external_wrench import ExternalWrench
from ibvs_qp.estimation.surface import FrictionEstimator
from ibvs_qp.feedforward import SLIDING_COMMAND, ContactFeedforward
from ibvs_qp.frames import GRAVITY, cross, down_in_body, roll_pitch, to_camera
from ibvs_qp.lines import CameraMotion, LineErrors, LineTerm
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, Measurement, Reference

#: Bound of the velocity integral as an acceleration [m/s^2] and of the force integral as a force [N].
VELOCITY_INTEGRAL_BOUND, FORCE_INTEGRAL_BOUND = 0.8, 8.0
#: Peak force that a touch may reach while the stiffness is unknown [N]: v = F / sqrt(k m).
TOUCH_FORCE_BUDGET = 4.9
#: Integral gain of the approach speed at the wall [1/s^2] and bound of its force [N].
SEARCH_GAIN, SEARCH_BOUND = 6.0, 6.0
#: The reach is computed once in so many ticks (50 Hz): it moves with the mass estimate and the travel only.
REACH_TICKS = 5
#: A wanted push below the reach keeps this much margin [N].
REACH_MARGIN = 1.0
#: Force or moment given up above which no integral moves [N, N m].
WINDUP_FORCE = 0.5
#: Lowest stand-off aimed at while the tip shall touch [m]: behind the surface, so that the approach never stalls.
TOUCH_TARGET = -0.03


class Setpoints:
    """Wanted forces and accelerations of one tick.

    Attributes after `update`:
        bias_wrench: h of M nu_dot = B u + h, (6,).
        normal, right, down: Wall axes in B.
        lines: Paired line terms.
        push_command, standoff_command: Forces along n [N]; contact_weight: lambda.
        angular: Wanted roll, pitch, yaw accelerations [rad/s^2], (3,).
        velocity_command: Wanted accelerations right and down [m/s^2], (2,).
        free_right, free_down: Shares of these directions that no line fixes.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self.config = config
        vehicle = config.vehicle
        self.effectiveness = control_effectiveness(vehicle.geometry)
        self.inverse = np.linalg.pinv(self.effectiveness)
        self.contact = ContactEstimator(config)
        self.external = ExternalWrench(vehicle, self.effectiveness)
        self.friction = FrictionEstimator()
        self._feedforward = ContactFeedforward(config.contact, np.array(vehicle.tip_position_m))
        self._lines = LineErrors(config)
        self._tip = np.array(vehicle.tip_position_m)
        self._camera = vehicle.camera_position_m
        self._tip_camera = to_camera(self._tip, np.array(self._camera)).tolist()
        self._inertia = np.array(vehicle.inertia_kg_m2)
        self.reset()

    def reset(self) -> None:
        """As before the first measurement."""
        self.contact.reset()
        self.external.reset()
        self.friction = FrictionEstimator()
        self._feedforward.reset()
        self._lines.reset()
        self._stamp = -1
        self._velocity_integral = [0.0, 0.0]
        self._force_integral = self._search_force = 0.0
        self._given_up = 0.0
        self.contact_weight = self.push_reference = self.push_command = self.standoff_command = 0.0
        self.reach, self._reach_ticks = math.inf, 0
        self.lines: list[LineTerm] = []
        self.normal, self.right, self.down = np.eye(3)

    def update(self, measurement: Measurement, reference: Reference) -> None:
        """Take in one checked measurement and reference."""
        config = self.config
        dt = config.tick_s if self._stamp < 0 else min(max((measurement.stamp_ns - self._stamp) * 1e-9, 0.0), 0.02)
        self._stamp = measurement.stamp_ns
        down_body = np.array(down_in_body(measurement.attitude))
        self.contact.update(measurement, down_body)
        self._wall_axes(down_body)
        self._feed_forward(measurement, reference, down_body, dt)
        self._attitude(measurement)
        self._along_normal(reference, dt)
        self._in_plane(measurement, reference, dt)

    def note(self, thrusts: np.ndarray, unallocated: np.ndarray) -> None:
        """Take note of what was commanded and what was given up (anti-windup)."""
        self.external.follow(thrusts, self.config.tick_s)
        self._given_up = float(np.abs(unallocated).max())

    def _wall_axes(self, down_body: np.ndarray) -> None:
        self.normal = self.contact.normal
        right = cross(down_body, self.normal)
        self.right = right / max(math.sqrt(float(right @ right)), 1e-6)
        self.down = cross(self.normal, self.right)

    def _feed_forward(self, measurement: Measurement, reference: Reference, down_body: np.ndarray, dt: float) -> None:
        config, omega, contact = self.config, measurement.angular_velocity, self.contact
        travel = reference.velocity[0] * self.right + reference.velocity[1] * self.down
        expected = np.zeros(6)
        if config.contact_feedforward:
            expected = self._feedforward.update(
                measurement.contact_wrench,
                travel,
                contact.push,
                self.friction.value,
                contact.in_contact,
                dt,
                contact.push_noise,
            )
        self.external.update(
            measurement.specific_force,
            omega,
            measurement.contact_wrench,
            expected[3:],
            self.normal,
            contact.in_contact or contact.distance < config.contact.contact_distance_m,
            config.contact_feedforward,
            dt,
        )
        speed = math.sqrt(float(travel @ travel))
        if contact.in_contact and speed > 0.0 and measurement.velocity is not None:
            direction = travel / speed
            moving = float(direction @ measurement.velocity)
            self.friction.hold(speed > SLIDING_COMMAND and moving < config.contact.stuck_speed_m_s, dt)
            self.friction.add(contact.push, -float(direction @ measurement.contact_wrench[:3]), moving, dt)
        weight = config.vehicle.mass_kg * GRAVITY
        gx, gy, gz = down_body.tolist()
        mx, my, mz = (-cross(omega, self._inertia * omega)).tolist()
        self._static_wrench = np.array((weight * gx, weight * gy, weight * gz, mx, my, mz)) + self.external.wrench
        self.bias_wrench = self._static_wrench + expected
        self._travel, self._travel_list = travel, travel.tolist()

    def _attitude(self, measurement: Measurement) -> None:
        gains, omega = self.config.gains, measurement.angular_velocity
        self.roll, self.pitch = roll_pitch(measurement.attitude)
        self.yaw = -math.atan2(self.normal[1], self.normal[0]) if self.contact.known else 0.0
        self.angular = (
            -gains.attitude_kp * self.roll - gains.attitude_kd * float(omega[0]),
            -gains.attitude_kp * self.pitch - gains.attitude_kd * float(omega[1]),
            -gains.yaw_kp * self.yaw - gains.yaw_kd * float(omega[2]),
        )

    def _along_normal(self, reference: Reference, dt: float) -> None:
        config, contact, gains = self.config, self.contact, self.config.gains
        settings, mass = config.contact, config.vehicle.mass_kg
        self.contact_weight = contact.contact_weight if reference.contact else 0.0
        self.push_reference = self._reachable(reference.push_force) if reference.contact else 0.0
        wanted = self.push_reference * contact.ramp
        if not contact.in_contact or not reference.contact:
            self._force_integral = 0.0
        elif self._given_up < WINDUP_FORCE:
            self._force_integral += dt * (wanted - contact.push)
            bound = FORCE_INTEGRAL_BOUND / max(gains.force_kfi, 1e-6)
            self._force_integral = min(max(self._force_integral, -bound), bound)
        softness = min(1.0, 1500.0 / contact.stiffness.value)
        self.push_command = wanted + softness * gains.force_kfp * (wanted - contact.push)
        self.push_command += gains.force_kfi * self._force_integral
        if config.impedance and contact.known:
            self.push_command += gains.force_ksp * contact.distance + gains.force_ksd * contact.rate
        if not contact.known:
            self.standoff_command = 0.0
            return
        target = TOUCH_TARGET if reference.contact else reference.standoff
        error = contact.distance - target
        forward = self._approach_speed(contact.distance)
        speed = min(max(gains.standoff_kp * error, -settings.retreat_speed_m_s), forward)
        self._search(speed + contact.rate, reference.contact and contact.distance < settings.contact_distance_m, dt)
        self.standoff_command = mass * gains.standoff_kd * (speed + contact.rate) + self._search_force

    def _search(self, lag: float, near: bool, dt: float) -> None:
        """Lean on harder while the tip should move in but does not: a noisy force sensor needs a firmer touch."""
        if not near:
            self._search_force = 0.0
        elif not self.contact.in_contact:
            gain = self.config.vehicle.mass_kg * SEARCH_GAIN
            self._search_force = min(max(self._search_force + gain * lag * dt, 0.0), SEARCH_BOUND)

    def _approach_speed(self, distance: float) -> float:
        """Speed limit towards the wall: peak force of a touch is v sqrt(k m)."""
        settings = self.config.contact
        if distance > settings.close_distance_m:
            return min(settings.approach_speed_m_s, settings.close_speed_m_s + (distance - settings.close_distance_m))
        if distance > settings.touch_distance_m:
            return settings.close_speed_m_s
        stiffness = self.contact.stiffness.value
        allowed = TOUCH_FORCE_BUDGET / math.sqrt(stiffness * self.config.vehicle.mass_kg)
        slow = settings.touch_speed_m_s if not self.contact.stiffness.known else settings.close_speed_m_s
        return min(slow, allowed, settings.close_speed_m_s)

    def _reachable(self, push: float) -> float:
        """Push reduced to what the rotors can hold against friction along the commanded travel."""
        self._reach_ticks += 1
        if self._reach_ticks % REACH_TICKS != 1:
            return min(push, max(0.0, self.reach - REACH_MARGIN)) if self.config.reach_check else push
        travel = self._travel
        speed = math.sqrt(float(travel @ travel))
        direction = self.normal if speed < 1e-3 else self.normal + self.friction.value * travel / speed
        moment = cross(self._tip, direction)
        slope = self.inverse @ np.concatenate((direction, moment))
        base = -(self.inverse @ self._static_wrench)
        low, high = self.config.vehicle.thrust_min, self.config.vehicle.thrust_max
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(slope > 1e-9, (high - base) / slope, np.where(slope < -1e-9, (low - base) / slope, np.inf))
        self.reach = float(max(0.0, room.min()))
        if not self.config.reach_check:
            return push
        return min(push, max(0.0, self.reach - REACH_MARGIN))

    def _in_plane(self, measurement: Measurement, reference: Reference, dt: float) -> None:
        config, gains, contact = self.config, self.config.gains, self.contact
        velocity = measurement.velocity
        speed = 0.0
        in_plane = None
        if velocity is not None:
            in_plane = velocity - self.normal * float(self.normal @ velocity)
            speed = math.sqrt(float(in_plane @ in_plane))
        stuck = contact.in_contact and speed < config.contact.stuck_speed_m_s
        integrate = not stuck and self._given_up < WINDUP_FORCE
        self.lines = []
        if contact.known:
            self._line_errors(measurement, reference, in_plane, integrate, dt)
        right = max((line.weight for line in self.lines if line.role == VERTICAL), default=0.0)
        down = max((line.weight for line in self.lines if line.role == HORIZONTAL), default=0.0)
        self.free_right, self.free_down = 1.0 - right, 1.0 - down
        self.velocity_command = (0.0, 0.0)
        if velocity is None:
            return
        command = []
        bound = VELOCITY_INTEGRAL_BOUND / max(gains.velocity_ki, 1e-6)
        for axis, (direction, free) in enumerate(((self.right, self.free_right), (self.down, self.free_down))):
            error = float(reference.velocity[axis]) - float(direction @ velocity)
            integral = self._velocity_integral[axis]
            if integrate:
                integral = min(max(free * (integral + dt * error), -bound), bound)
                self._velocity_integral[axis] = integral
            command.append(gains.velocity_kp * error + gains.velocity_ki * integral)
        self.velocity_command = (command[0], command[1])

    def _line_errors(
        self,
        measurement: Measurement,
        reference: Reference,
        in_plane: np.ndarray | None,
        integrate: bool,
        dt: float,
    ) -> None:
        contact = self.contact
        front, right, down = self.normal.tolist()
        depth = max(contact.depth, 0.05)
        self.plane = (right / depth, down / depth, front / depth, -1.0)
        tip_x, tip_y, tip_z = self._tip_camera
        distance = contact.distance
        foot = (tip_x + distance * right, tip_y + distance * down, tip_z + distance * front)
        known = in_plane is not None
        vx, vy, vz = in_plane.tolist() if in_plane is not None else (0.0, 0.0, 0.0)
        wx, wy, wz = measurement.angular_velocity.tolist()
        px, py, pz = self._camera
        motion = CameraMotion(
            # body (front, right, down) to camera (right, down, front), with the lever of the camera
            velocity=(vy + wz * px - wx * pz, vz + wx * py - wy * px, vx + wy * pz - wz * py),
            turn=(wy, wz, wx),
            reference=(self._travel_list[1], self._travel_list[2], self._travel_list[0]),
            known=known,
        )
        self.lines = self._lines.update(measurement.lines, reference.lines, self.plane, foot, motion, integrate, dt)
