"""Wall normal, distance of the tip and its rate: gyro and accelerometer integrated, corrected by measured planes.

Differentiated depth is 60-100 ms late and takes the damping out of the contact; the rate here comes from the
accelerometer and depth only corrects it (design section 4.2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.kalman import DelayedKalman
from ibvs_qp.estimation.normal_turns import NormalTurns
from ibvs_qp.estimation.stamps import HISTORY
from ibvs_qp.estimation.vibration import VibrationNoise
from ibvs_qp.frames import GRAVITY, add_scaled, cross, dot, plane_in_body, unit

#: Order of the filter's state: distance [m], speed of the centre of mass into the wall [m/s], accelerometer bias.
DISTANCE, SPEED, BIAS = 0, 1, 2
#: d/dt (distance, speed, bias) = CHAIN (distance, speed, bias) + measured acceleration.
CHAIN = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])
#: Spectral density of the distance itself [m^2/s]: nearly none.
DISTANCE_NOISE = 1e-10
#: Standard deviations at the start: distance [m], speed [m/s], bias [m/s^2]; and of the first measured distance [m].
INITIAL_STD, FIRST_DISTANCE_STD = np.array([0.05, 0.05, 0.1]), 0.01
#: Without ticks for this long [ns], normal and speed are only as good as the next plane; standard deviation of a speed
#: then [m/s].
GAP_NS, GAP_SPEED_STD = 100_000_000, 0.5
#: Refused normals in a row that are taken after all: a third of a second; how often, until so many have agreed.
ODD_PLANES, MOST_REOPENED, AGREED_PLANES = 10, 2, 150
#: Standard deviation of the distance at a touch without planes [m].
TOUCH_STD = 0.003
#: Standard deviation of a speed from two planes a few frames apart [m/s], and least time between them [s].
JUMP_SPEED_STD, SHORTEST_JUMPS = 0.05, 0.05


class WallDistance:
    """Filter of the wall normal and of distance, speed and accelerometer bias along it.

    Attributes:
        normal: Unit vector into the wall, in B, (3,).
        known: Whether a plane was measured since the start.
        rate_noise: Standard deviation of the rate [m/s].
        accepted_ns: Capture time of the last accepted plane, -1 before the first.
        vibration: Noise of the acceleration along the normal.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self._settings = settings = config.contact.estimation
        self._tip = config.vehicle.tip_position_m
        self._tip_from_camera = np.subtract(self._tip, config.vehicle.camera_position_m).tolist()
        noise = np.array([DISTANCE_NOISE, 0.0, 0.0])  # the others follow the vibration
        self.vibration = VibrationNoise(settings.vibration_time_s)
        gain = 1.0 - math.exp(-config.tick_s / settings.acceleration_filter_s)
        self._ratio = gain / (2.0 - gain)  # variance of filtered white noise per variance of a sample
        self._turns = NormalTurns()
        self._filter = DelayedKalman(CHAIN, noise, INITIAL_STD, config.tick_s, settings.gate_sigmas)
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first plane."""
        self._filter.reset()
        self._state = self._filter.state.tolist()
        self.normal, self.known = (1.0, 0.0, 0.0), False
        self._normals = np.zeros((HISTORY, 3))  # of the last ticks, by the slots of the filter's ticks
        self._yaw, self._yaws = 0.0, np.zeros(HISTORY)  # integrated gyro about the vertical [rad], likewise
        self._turns.reset()
        self._refused, self._nearer, self._first_refused, self._plane_ns = 0, False, (0, 0.0), -1
        self.accepted_ns = self._tick_ns = -1
        self._gap = False
        self._odd = self._agreed = self._reopened = 0
        self.vibration.reset()
        self._filtered = self._lever_speed = self.rate_noise = 0.0

    @property
    def distance(self) -> float:
        """Tip to wall [m], infinite while unknown."""
        return self._state[DISTANCE] if self.known else math.inf

    @property
    def rate(self) -> float:
        """Rate of the distance [m/s]: of the centre of mass, and of the tip that rotates with the body."""
        return -self._state[SPEED] - self._lever_speed if self.known else 0.0

    @property
    def acceleration(self) -> float:
        """Filtered second derivative of the distance [m/s^2], weighted by its ratio of signal to noise."""
        return self._filtered / (
            1.0 + self._ratio * self.vibration.variance / self._settings.acceleration_quiet_m_s2**2
        )

    @property
    def bias(self) -> float:
        """Measured minus true acceleration along the normal [m/s^2]; 0 while no wall is known."""
        return self._state[BIAS] if self.known else 0.0

    @property
    def speed(self) -> float:
        """Speed of the centre of mass into the wall [m/s]."""
        return -self.rate - self._lever_speed

    @property
    def depth(self) -> float:
        """Camera to wall along the normal [m], infinite while unknown."""
        return self.distance + dot(self.normal, self._tip_from_camera)

    def predict(
        self,
        stamp_ns: int,
        dt: float,
        angular_velocity: Sequence[float],
        specific_force: Sequence[float] | None,
        down: Sequence[float],
    ) -> None:
        """Rotate the normal with the gyro [rad/s] and integrate the accelerometer [m/s^2] along it over dt [s].

        All vectors are in B, (3,); ``down`` is the unit vector of gravity. Without a specific
        force the speed is constant.
        """
        if 0 <= self._tick_ns < stamp_ns - GAP_NS:
            self.doubt()
        self._tick_ns = stamp_ns
        self.normal = normal = unit(add_scaled(self.normal, dt, cross(self.normal, angular_velocity)))
        self._lever_speed = lever_speed = dot(normal, cross(angular_velocity, self._tip))
        measured = 0.0
        if specific_force is not None:
            measured = dot(normal, add_scaled(specific_force, GRAVITY, down))
        distance, speed, bias = self._state
        gain = 1.0 - math.exp(-dt / self._settings.acceleration_filter_s)
        self._filtered += gain * (bias - measured - self._filtered)
        self.vibration.add(measured, dt)
        density = self.vibration.density(self._settings.acceleration_noise, dt)
        self._filter.noise[SPEED, SPEED] = density
        self._filter.noise[BIAS, BIAS] = density / self._settings.bias_time_s**2  # as fast in any vibration
        self._state = [distance - dt * (speed + lever_speed), speed + dt * (measured - bias), bias]
        self._filter.remember(stamp_ns, self._state, dt)
        self._yaw += dt * dot(down, angular_velocity)
        slot = self._filter.ticks.slot(0)
        self._normals[slot], self._yaws[slot] = normal, self._yaw
        self.rate_noise = math.sqrt(self._filter.variance(SPEED, stamp_ns))

    def correct(self, plane: Sequence[float], stamp_ns: int, tip_stationary: bool) -> None:
        """Correct with a plane (A, B, C, D) measured in C, at the time of its capture, if newer than the last one.

        Planes of a camera with mirrored axes are refused for good.
        """
        if stamp_ns <= self._plane_ns:
            return
        self._plane_ns = stamp_ns
        normal, distance = plane_in_body(plane, self._tip_from_camera)
        self._turns.add(stamp_ns, normal, float(self._yaws[self._filter.ticks.slots_since(stamp_ns)[0]]))
        if self._turns.mirrored:
            return
        if not self.known or self._gap:
            self.normal, self._normals[:] = normal, normal
            self._filter.set_entry(DISTANCE, distance, FIRST_DISTANCE_STD)
            if self._gap:
                self._filter.set_entry(SPEED, self._state[SPEED], GAP_SPEED_STD)
            self.known, self._gap, self.accepted_ns = True, False, stamp_ns
        elif self._trusts(stamp_ns, normal) and self._correct_distance(stamp_ns, distance, tip_stationary):
            self._correct_normal(stamp_ns, normal)
            self.accepted_ns = stamp_ns
        self._state = self._filter.state.tolist()

    def doubt(self) -> None:
        """Ticks are missing: take normal and distance from the next plane, and an unknown speed."""
        self._gap = True

    def touch(self) -> None:
        """The tip rests at the wall, whatever the drifting distance says; the accelerometer's bias stays."""
        self._filter.set_entry(DISTANCE, 0.0, TOUCH_STD)
        self._filter.set_entry(SPEED, -self._lever_speed, self._settings.stationary_speed_std_m_s)
        self._state = self._filter.state.tolist()

    def _trusts(self, stamp_ns: int, normal: Sequence[float]) -> bool:
        """Whether a measured normal agrees with the one predicted by the gyro, or has disagreed for long.

        A false gyro sample leaves the prediction wrong, so a normal is taken after all, but not again and again: a
        mirrored one would turn the vehicle away. One that never agrees is a wall that is lost (`ibvs_qp.safety`).
        """
        settings, past = self._settings, self._normals[self._filter.ticks.slots_since(stamp_ns)[0]].tolist()
        if dot(past, normal) >= math.cos(math.radians(settings.normal_gate_deg)) * math.hypot(*past):
            self._odd, self._agreed = 0, self._agreed + 1
            if self._agreed >= AGREED_PLANES:
                self._reopened = 0
            return True
        self._odd, self._agreed = self._odd + 1, 0
        if self._odd < ODD_PLANES or self._reopened >= MOST_REOPENED:
            return False
        self._odd, self._reopened = 0, self._reopened + 1
        self.normal, self._normals[:] = unit(normal), normal
        return True

    def _correct_distance(self, stamp_ns: int, distance: float, tip_stationary: bool) -> bool:
        """Correct distance and speed; whether the plane is accepted.

        A plane beyond the gate counts little, and a jump not at all, until the next ones lie on the same side: then
        the filter is wrong, and starts again.
        """
        settings, kalman = self._settings, self._filter
        deviation = settings.stationary_distance_std_m if tip_stationary else settings.distance_std_m
        if kalman.correct_entry(stamp_ns, DISTANCE, distance, deviation**2):
            if tip_stationary:
                kalman.correct_entry(stamp_ns, SPEED, -self._lever_speed, settings.stationary_speed_std_m_s**2)
            self._refused = 0
            return True
        past = kalman.at(stamp_ns)
        if past is None:
            return False
        nearer = bool(distance < past[DISTANCE])
        self._refused = self._refused + 1 if nearer == self._nearer else 1
        if self._refused == 1:
            self._first_refused, self._nearer = (stamp_ns, distance), nearer
        if self._refused >= settings.refused_frames:
            self._refused = 0
            self._restart(stamp_ns, distance)
            return True
        if abs(distance - past[DISTANCE]) >= settings.jump_m:
            return False
        return kalman.correct_entry(stamp_ns, DISTANCE, distance, settings.outlier_std_m**2, gate=math.inf)

    def _restart(self, stamp_ns: int, distance: float) -> None:
        """Take distance and speed from the refused planes: a filter that refuses them has a wrong speed as well."""
        then, first = self._first_refused
        kalman, elapsed = self._filter, max((stamp_ns - then) * 1e-9, SHORTEST_JUMPS)
        kalman.restart()
        kalman.set_entry(SPEED, (first - distance) / elapsed - self._lever_speed, JUMP_SPEED_STD)
        kalman.set_entry(DISTANCE, distance, FIRST_DISTANCE_STD)

    def _correct_normal(self, stamp_ns: int, normal: Sequence[float]) -> None:
        """Move the normal of the capture, and equally every later one, towards the measured one."""
        slots = self._filter.ticks.slots_since(stamp_ns)
        change = self._settings.normal_gain * (np.array(normal) - self._normals[slots[0]])
        self._normals[slots] += change
        self.normal = unit((np.array(self.normal) + change).tolist())
