"""Wall normal, distance of the tip and its rate: gyro and accelerometer integrated, corrected by measured planes.

Differentiated depth is 60-100 ms late and takes the damping out of the contact; the rate here comes from the
accelerometer and depth only corrects it (design section 4.2).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca
import numpy as np

from ibvs_qp.config import ControllerConfig
from ibvs_qp.estimation.kalman import LateKalman
from ibvs_qp.estimation.motion_history import MotionHistory
from ibvs_qp.estimation.noise import noise_density, vibration_variance
from ibvs_qp.frames import GRAVITY, R_BODY_CAMERA
from ibvs_qp.symbolic.logic import both, either, no, where, wrapped
from ibvs_qp.symbolic.signals import Signals

#: Order of the filter's state: distance [m], speed of the centre of mass into the wall [m/s], accelerometer bias; and
#: its chain: the state grows by it and the measured acceleration.
DISTANCE, SPEED, BIAS = 0, 1, 2
CHAIN = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])
#: Spectral density of the distance itself [m^2/s]: nearly none.
DISTANCE_NOISE = 1e-10
#: Standard deviations at the start: distance [m], speed [m/s], bias [m/s^2]; and of the first measured distance [m].
INITIAL_STD, FIRST_DISTANCE_STD = (0.05, 0.05, 0.1), 0.01
#: Without ticks for this long [s], normal and speed are only as good as the next plane; standard deviation of a speed
#: then [m/s].
GAP_S, GAP_SPEED_STD = 0.1, 0.5
#: Refused normals in a row that are taken after all: a third of a second; how often, until so many have agreed.
ODD_PLANES, MOST_REOPENED, AGREED_PLANES = 10, 2, 150
#: Standard deviation of the distance at a touch without planes [m].
TOUCH_STD = 0.003
#: Standard deviation of a speed from two planes a few frames apart [m/s], and least time between them [s].
JUMP_SPEED_STD, SHORTEST_JUMPS = 0.05, 0.05
#: Age of a plane that never came [s], and distance of a wall that was never measured [m].
NEVER_S, FAR_AWAY = 1e6, 1e3
#: Turns are compared over this time [s], and evaluated once the gyro's have this root sum of squares [rad]: five times
#: the noise of a turn by two normals of 0.6 deg each over the threshold's distance from a right sign.
TURN_S, LEAST_TURN = 0.25, math.radians(3.0)
#: Correlation of both over the gyro's square, below which they oppose each other: 1 right, -1 mirrored.
OPPOSED = -0.5


class Tick(NamedTuple):
    """Inertial data of one tick, in B."""

    dt: ca.SX  # bounded time since the last tick [s]
    elapsed: ca.SX  # time since the last tick [s]
    rate: ca.SX  # gyro [rad/s], (3,)
    force: ca.SX  # accelerometer [m/s^2], (3,)
    force_known: ca.SX  # whether there is one
    down: ca.SX  # unit gravity, (3,)
    doubt: ca.SX  # whether ticks are missing for an unknown time

    @property
    def acceleration(self) -> ca.SX:
        """Acceleration without gravity [m/s^2], (3,); zero without accelerometer."""
        return where(self.force_known, self.force + GRAVITY * self.down, ca.SX.zeros(3))


class Plane(NamedTuple):
    """A measured plane."""

    new: ca.SX  # whether it is later than the last one
    age: ca.SX  # time since its capture [s]
    values: ca.SX  # (A, B, C, D) in C, (4,)


class WallDistance:
    """Filter of the wall normal and of distance, speed and accelerometer bias along it: one tick.

    The state at a plane's capture is the present one, carried back along the motion since (`MotionHistory`).

    Attributes:
        normal: Unit vector into the wall, in B, (3,).
        known: Whether a plane was measured since the start.
        offset: Distance from the felt surface to the observed one [m], 0 while they are one.
        anew: Whether the distance has started from a plane since the last contact: that plane may be another surface's.
        accepted: Whether this tick's plane was accepted.
        measured: Distance of the tip by this plane alone [m].
        set_anew: Whether the distance was set in this tick, instead of corrected.
        since_plane: Time since the capture of the last accepted plane [s].
        rate_noise: Standard deviation of the rate [m/s].
        variance: Of one sample of the acceleration along the normal [m^2/s^4].
        lever_speed: Speed of the tip into the wall by the body's rotation [m/s].
    """

    def __init__(self, signals: Signals, config: ControllerConfig, tick: Tick, history: MotionHistory) -> None:
        self._signals, self._tick, self._history = signals, tick, history
        self._settings = settings = config.contact.estimation
        self._tip = ca.DM(config.vehicle.tip_position_m)
        self._tip_from_camera = ca.DM(np.subtract(config.vehicle.tip_position_m, config.vehicle.camera_position_m))
        self.known, self.offset = signals.state("wall.known"), signals.state("wall.offset")
        self.anew = signals.state("wall.anew")
        self.since_plane = signals.state("wall.since_plane", start=NEVER_S) + tick.elapsed
        self._gap = either(signals.state("wall.gap"), tick.elapsed > GAP_S, tick.doubt)
        self._kalman = LateKalman(signals, "wall", CHAIN, INITIAL_STD, tick.elapsed)
        self.accepted = ca.SX(0.0)
        self._predict(config.tick_s, settings.acceleration_filter_s)

    def _predict(self, tick_s: float, filter_s: float) -> None:
        """Rotate the normal with the gyro and integrate the accelerometer along it; without one, speed is constant."""
        signals, tick, settings = self._signals, self._tick, self._settings
        normal = signals.state("wall.normal", 3, (1.0, 0.0, 0.0))
        normal = normal + tick.dt * ca.cross(normal, tick.rate)
        self.normal = normal / ca.norm_2(normal)
        self.lever_speed = ca.dot(self.normal, ca.cross(tick.rate, self._tip))
        measured = ca.dot(self.normal, tick.acceleration)
        distance, speed, bias = ca.vertsplit(signals.state("wall.state", 3))
        filtered, gain = signals.state("wall.filtered"), 1.0 - ca.exp(-tick.dt / filter_s)
        self._filtered = signals.remember("wall.filtered", filtered + gain * (bias - measured - filtered))
        self.variance = vibration_variance(signals, measured, tick.dt, settings.vibration_time_s)
        ratio = 1.0 - math.exp(-tick_s / filter_s)
        self._ratio = ratio / (2.0 - ratio)  # variance of filtered white noise per variance of a sample
        density = noise_density(self.variance, settings.acceleration_noise, tick.dt)
        # The bias is learnt as fast in any vibration.
        self._kalman.noise = (DISTANCE_NOISE, density, density / settings.bias_time_s**2)
        self._state = ca.vertcat(
            distance - tick.dt * (speed + self.lever_speed), speed + tick.dt * (measured - bias), bias
        )
        self.rate_noise = ca.sqrt(self._kalman.variance(SPEED))
        yaw = signals.state("wall.yaw") + tick.dt * ca.dot(tick.down, tick.rate)
        self._yaw = signals.remember("wall.yaw", wrapped(yaw))

    def correct(self, plane: Plane, tip_stationary: ca.SX) -> None:
        """Correct with a plane at its capture; those of a camera with mirrored axes are refused for good."""
        signals, kalman = self._signals, self._kalman
        seen, raw = self._seen(plane.values)
        self.measured = distance = raw - self.offset
        past, past_normal, past_yaw = self._at(plane.age)
        last_age = signals.state("wall.last_age") + self._tick.elapsed
        signals.remember("wall.last_age", where(plane.new, plane.age, last_age))
        mirrored = mirrored_normal(signals, plane.new, last_age - plane.age, seen, past_yaw)
        new = both(plane.new, no(mirrored))
        first = both(new, either(no(self.known), self._gap))
        trusted, past_normal = self._trusts(both(new, no(first)), seen, past_normal)
        covered = self._history.covers(plane.age)
        kalman.go_to(both(trusted, covered), plane.age)
        corrected, restart = self._correct_distance(both(trusted, covered), plane.age, distance, past, tip_stationary)
        kalman.set_entry(first, DISTANCE, FIRST_DISTANCE_STD)
        kalman.set_entry(both(first, self._gap), SPEED, GAP_SPEED_STD)
        self.set_anew = anew = either(first, restart)
        self._set(anew, DISTANCE, raw)
        self.offset, self.anew = where(anew, 0.0, self.offset), either(self.anew, anew)
        self.accepted = either(first, corrected)
        moved = self.normal + self._settings.normal_gain * (seen - past_normal)
        self.normal = where(first, seen, where(corrected, moved / ca.norm_2(moved), self.normal))
        self.known, self._gap = either(self.known, first), both(self._gap, no(first))
        self.since_plane = where(self.accepted, plane.age, self.since_plane)

    def _seen(self, plane: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Normal in B and distance of the tip by a plane in C; see `ibvs_qp.frames.plane_in_body`."""
        scaled = ca.DM(R_BODY_CAMERA) @ (-plane[:3] / plane[3])
        length = ca.norm_2(scaled)
        return scaled / length, (1.0 - ca.dot(scaled, self._tip_from_camera)) / length

    def _at(self, age: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
        """State, normal and yaw at a past time: the present ones, carried back."""
        normal, angle = self.normal, ca.SX.zeros(3)
        distance, speed, bias = ca.vertsplit(self._state)
        for part in self._history.since(age):
            before = speed - ca.dot(normal, part.change) + bias * part.duration
            turned = ca.dot(normal, ca.cross(part.angle, self._tip))
            distance, speed = distance + 0.5 * part.duration * (before + speed) + turned, before
            angle = angle + part.angle
        turn = ca.cross(normal, angle)
        past = normal - turn + 0.5 * ca.cross(turn, angle)
        return ca.vertcat(distance, speed, bias), past / ca.norm_2(past), self._yaw - ca.dot(self._tick.down, angle)

    def _trusts(self, new: ca.SX, seen: ca.SX, past: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Whether a measured normal agrees with the one predicted by the gyro, or has disagreed for long.

        A false gyro sample leaves the prediction wrong, so a normal is taken after all, but not again and again: a
        mirrored one would turn the vehicle away. One that never agrees is a wall that is lost (`ibvs_qp.supervision`).

        Returns:
            The answer, and the normal expected at the capture: the measured one where that was taken after all.
        """
        odd, agreed, reopened = (self._signals.state(f"wall.{name}") for name in ("odd", "agreed", "reopened"))
        agrees = both(new, ca.dot(past, seen) >= math.cos(math.radians(self._settings.normal_gate_deg)))
        differs = both(new, no(agrees))
        agreed = where(agrees, agreed + 1.0, where(differs, 0.0, agreed))
        odd = where(agrees, 0.0, odd + differs)
        reopened = where(both(agrees, agreed >= AGREED_PLANES), 0.0, reopened)
        reopens = both(differs, odd >= ODD_PLANES, reopened < MOST_REOPENED)
        self._signals.remember("wall.odd", where(reopens, 0.0, odd))
        self._signals.remember("wall.agreed", ca.fmin(agreed, AGREED_PLANES))
        self._signals.remember("wall.reopened", reopened + reopens)
        self.normal = where(reopens, seen, self.normal)
        return either(agrees, reopens), where(reopens, seen, past)

    def _correct_distance(
        self, new: ca.SX, age: ca.SX, distance: ca.SX, past: ca.SX, tip_stationary: ca.SX
    ) -> tuple[ca.SX, ca.SX]:
        """Correct distance and speed; whether the plane is accepted, and whether the distance starts again from it.

        A plane beyond the gate counts little, and a jump not at all, until the next ones lie on the same side: then
        the filter is wrong, and starts again.
        """
        settings, kalman, signals = self._settings, self._kalman, self._signals
        deviation = where(tip_stationary, settings.stationary_distance_std_m, settings.distance_std_m)
        within = both(new, kalman.within(DISTANCE, distance - past[DISTANCE], deviation**2, settings.gate_sigmas))
        outlier, nearer = both(new, no(within)), distance < past[DISTANCE]
        refused, side = signals.state("wall.refused"), signals.state("wall.nearer")
        refused = where(both(refused > 0.0, nearer == side), refused + 1.0, 1.0)
        first_age = signals.state("wall.first_age") + self._tick.elapsed
        first_distance = signals.state("wall.first_distance")
        starts = both(outlier, refused <= 1.0)
        first_age, first_distance = where(starts, age, first_age), where(starts, distance, first_distance)
        restart = both(outlier, refused >= settings.refused_frames)
        counts_little = both(outlier, no(restart), ca.fabs(distance - past[DISTANCE]) < settings.jump_m)
        accepted = either(within, restart, counts_little)
        kept = where(either(within, restart), 0.0, where(outlier, refused, signals.state("wall.refused")))
        for name, value in {
            "refused": kept,
            "nearer": where(outlier, nearer, side),
            "first_age": ca.fmin(first_age, NEVER_S),
            "first_distance": first_distance,
        }.items():
            signals.remember(f"wall.{name}", value)

        variance = where(within, deviation**2, settings.outlier_std_m**2)
        innovation = ca.vertcat(distance, -self.lever_speed) - past[:2]
        at_capture = kalman.correct(either(within, counts_little), DISTANCE, innovation[DISTANCE], variance)
        # The tip stands: so does the body, except for its rotation.
        slip, speed_variance = innovation[SPEED] - at_capture[SPEED], settings.stationary_speed_std_m_s**2
        stands = both(within, tip_stationary, kalman.within(SPEED, slip, speed_variance, settings.gate_sigmas))
        change = at_capture + kalman.correct(stands, SPEED, slip, speed_variance)
        first, second = kalman.growth(change)
        self._state = self._state + change + age * first + 0.5 * age**2 * second
        # A filter that refuses for long has a wrong speed as well: both from the refused planes.
        interval = ca.fmax(first_age - age, SHORTEST_JUMPS)
        kalman.restart(restart, (FIRST_DISTANCE_STD, JUMP_SPEED_STD, INITIAL_STD[BIAS]))
        self._set(restart, SPEED, (first_distance - distance) / interval - self.lever_speed)
        return accepted, restart

    def touch(self, happens: ca.SX, another: ca.SX) -> None:
        """Put the tip at the wall, at any value of the drifting distance; the accelerometer's bias stays.

        Args:
            happens: Whether it rests there.
            another: Whether the planes are right, and of another surface: the next ones count from the felt one.
        """
        self.set_anew = either(self.set_anew, happens)
        self.offset = self.offset + where(both(happens, another), self._state[DISTANCE], 0.0)
        self._kalman.set_entry(happens, DISTANCE, TOUCH_STD)
        self._kalman.set_entry(happens, SPEED, self._settings.stationary_speed_std_m_s)
        self._set(happens, DISTANCE, ca.SX(0.0))
        self._set(happens, SPEED, -self.lever_speed)

    def _set(self, condition: ca.SX, index: int, value: ca.SX) -> None:
        entries = ca.vertsplit(self._state)
        entries[index] = where(condition, value, entries[index])
        self._state = ca.vertcat(*entries)

    def store(self, confirmed: ca.SX) -> None:
        """Remember the states for the next tick; ``confirmed`` by a contact at the wall."""
        self._signals.remember("wall.anew", where(confirmed, 0.0, self.anew))
        for name, value in {
            "normal": self.normal,
            "state": self._state,
            "known": self.known,
            "offset": self.offset,
            "gap": self._gap,
            "since_plane": ca.fmin(self.since_plane, NEVER_S),
        }.items():
            self._signals.remember(f"wall.{name}", value)
        self._kalman.store()

    @property
    def distance(self) -> ca.SX:
        """Tip to wall [m], `FAR_AWAY` while unknown."""
        return where(self.known, self._state[DISTANCE], FAR_AWAY)

    @property
    def distance_variance(self) -> ca.SX:
        """Of the distance [m^2]."""
        return self._kalman.variance(DISTANCE)

    @property
    def rate(self) -> ca.SX:
        """Rate of the distance [m/s]: of the centre of mass, and of the tip that rotates with the body."""
        return where(self.known, -self._state[SPEED] - self.lever_speed, 0.0)

    @property
    def acceleration(self) -> ca.SX:
        """Filtered second derivative of the distance [m/s^2], weighted by its ratio of signal to noise."""
        quiet = self._settings.acceleration_quiet_m_s2
        return self._filtered / (1.0 + self._ratio * self.variance / quiet**2)

    @property
    def bias(self) -> ca.SX:
        """Measured minus true acceleration along the normal [m/s^2]; 0 while no wall is known."""
        return where(self.known, self._state[BIAS], 0.0)

    @property
    def speed(self) -> ca.SX:
        """Speed of the centre of mass into the wall [m/s]."""
        return -self.rate - self.lever_speed

    @property
    def depth(self) -> ca.SX:
        """Camera to wall along the normal [m], about `FAR_AWAY` while unknown."""
        return self.distance + ca.dot(self.normal, self._tip_from_camera)


def mirrored_normal(signals: Signals, new: ca.SX, since_last: ca.SX, normal: ca.SX, yaw: ca.SX) -> ca.SX:
    """Whether the normal turns against the vehicle's yaw; following it would turn the vehicle to the wall's side.

    Args:
        signals: Registry.
        new: Whether a normal was measured in this tick.
        since_last: Time from the capture of the last measured normal to this one's [s].
        normal: The normal in B, (3,).
        yaw: Integrated yaw at its capture [rad].
    """
    names = ("started", "time", "seen", "yaw", "square", "product", "found")
    started, time, first, begun, square, product, found = (signals.state(f"turns.{name}") for name in names)
    seen = -ca.atan2(normal[1], normal[0])  # the wall turns the other way in B
    time = where(started, time + since_last, 0.0)
    due = both(new, started, time >= TURN_S)
    felt, turned = wrapped(yaw - begun), wrapped(seen - first)
    square, product = square + where(due, felt * felt, 0.0), product + where(due, felt * turned, 0.0)
    evaluated = both(due, square >= LEAST_TURN**2)
    found = either(found, both(evaluated, product < OPPOSED * square))
    begins = both(new, either(no(started), due))
    kept = {
        "started": either(started, new),
        "time": where(begins, 0.0, where(new, time, signals.state("turns.time"))),
        "seen": where(begins, seen, first),
        "yaw": where(begins, yaw, begun),
        "square": where(evaluated, 0.0, square),
        "product": where(evaluated, 0.0, product),
        "found": found,
    }
    for name, value in kept.items():
        signals.remember(f"turns.{name}", value)
    return found
