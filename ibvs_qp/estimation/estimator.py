"""All estimates of a flight: one compiled function a tick, one a measurement of a picture, both with explicit state."""

from __future__ import annotations

import math
import struct
from collections.abc import Collection, Mapping, Sequence
from typing import Protocol

import casadi as ca
import numpy as np

from ibvs_qp.config import LONGEST_TICK, ControllerConfig, EstimationConfig
from ibvs_qp.estimation.attitude import continuous_attitude, gyro_bias
from ibvs_qp.estimation.contact import contact_state, no_contact, read_contact
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.force_sensor import contact_wrench
from ibvs_qp.estimation.inertial_fallback import InertialFallback
from ibvs_qp.estimation.inputs import gravity_direction
from ibvs_qp.estimation.motion_history import MotionHistory
from ibvs_qp.estimation.plane_acceleration import plane_force
from ibvs_qp.estimation.tick_history import TickHistory, sample_interval
from ibvs_qp.estimation.wall_distance import Plane, Tick
from ibvs_qp.estimation.wall_lines import WallAxes
from ibvs_qp.estimation.wall_motion import SLOTS, STATES, WallMotion, predicted_motion, unrolled
from ibvs_qp.frames import down_in_body, plane_in_body
from ibvs_qp.measurement import FeatureFrame, SensorFrame
from ibvs_qp.symbolic.function import StepFunction
from ibvs_qp.symbolic.logic import both, either, no, where
from ibvs_qp.symbolic.signals import GatedSignals, Signals

#: Inertial sensors of a frame.
INERTIAL = ("attitude", "angular_velocity", "specific_force")
#: Inputs of a tick in the order of packing: times since the last one, bounded and not [s]; attitude, gyro,
#: accelerometer, whether all of them are measured, and whether the gyro is; sample of the force sensor, and time since
#: the last one [s], 0 without a new one; contact wrench in its place, if any, and time since the last one that counts
#: [s]; plane, whether it is new, its age [s]; whether the tip shall press; whether ticks are missing; specific force by
#: the motors' model [m/s^2]; whether the velocity in the wall plane is young; curvature of the wall [1/m].
INPUTS = {
    "dt": 1,
    "elapsed": 1,
    "attitude": 4,
    "rate": 3,
    "force": 3,
    "measured": 1,
    "gyro": 1,
    "sample": 6,
    "sample_interval": 1,
    "replaced": 1,
    "replacement": 6,
    "interval": 1,
    "plane": 4,
    "plane_new": 1,
    "plane_age": 1,
    "press": 1,
    "doubt": 1,
    "motors_force": 3,
    "velocity_young": 1,
    "curvature": 3,
}
#: Row of a tick in the history, the first states of the function: motion in the wall plane, integrated gyro [rad],
#: attitude and angular velocity.
ROW = {"motion": STATES, "turn": 3, "flown_attitude": 4, "flown_rate": 3}
TURN, ATTITUDE, RATE = slice(STATES, STATES + 3), slice(STATES + 3, STATES + 7), slice(STATES + 7, STATES + 10)
#: A plane, (A, B, C, D); and the least part of its distance at which the tip can touch a surface before it.
Plane4 = tuple[float, float, float, float]
LEAST_RATIO = 0.1
#: Standard deviation of a rate of climb in the wash of the rotors (assumed: twice the slow error that is flown); and of
#: the velocity in a direction that a measurement does not show [m/s].
HEIGHT_RATE_STD, UNSEEN_STD = 0.1, 30.0
_NO_WRENCH = (0.0,) * 6
#: Curvature of a flat wall.
FLAT = [0.0] * 3


class MotorsModel(Protocol):
    """Signals of the motors' model at the controller's last step."""

    @property
    def angular_acceleration(self) -> list[float]:
        """Angular acceleration [rad/s^2], (3,)."""
        ...

    @property
    def modelled_force(self) -> list[float]:
        """Specific force with contact and observed force [m/s^2], (3,)."""
        ...

    @property
    def motors_force(self) -> list[float]:
        """Specific force of the motors alone [m/s^2], (3,)."""
        ...


def prediction_signals(config: ControllerConfig, estimation: EstimationConfig) -> Signals:
    """One tick: attitude, contact wrench, wall and contact, and motion in the wall plane."""
    signals, vehicle = Signals(), config.vehicle
    value = {name: signals.input(name, size) for name, size in INPUTS.items()}
    rates = ca.reshape(signals.input("rates", 2 * SLOTS), 2, SLOTS).T
    starts = {"flown_attitude": (1.0, 0.0, 0.0, 0.0)}
    motion, turn, flown_attitude, _ = (signals.state(name, size, starts.get(name, 0.0)) for name, size in ROW.items())
    dt, rate, force = value["dt"], value["rate"], value["force"]

    held = GatedSignals(signals, ca.SX(0.0), no(value["measured"]))  # while the attitude is an estimate
    continuous = continuous_attitude(held, value["attitude"], flown_attitude, rate, dt)
    attitude = where(value["measured"], continuous, value["attitude"])
    bias = gyro_bias(signals, value["measured"], value["attitude"], rate, dt, value["elapsed"])
    rate -= where(value["gyro"], bias, ca.DM.zeros(3))
    down = gravity_direction(attitude)
    tick = Tick(dt, value["elapsed"], rate, force, ca.SX(1.0), down, value["doubt"])

    far = signals.state("wall.state", 3)[0] > estimation.tare_distance_m
    free = both(no(signals.state("touch.in_contact")), either(no(signals.state("wall.known")), far))
    tared, ready = contact_wrench(
        signals,
        vehicle,
        estimation,
        sample=value["sample"],
        interval=value["sample_interval"],
        force=force,
        dt=dt,
        free=free,
    )
    wrench = where(value["replaced"], value["replacement"], tared)
    history = MotionHistory(signals, tick.elapsed, rate, tick.acceleration, config.tick_s)
    plane = Plane(new=value["plane_new"], age=value["plane_age"], values=value["plane"])
    contact = contact_state(signals, config, tick, history, plane, wrench, value["interval"], value["press"])

    axes = WallAxes.of_symbols(contact["normal"], down)
    felt = plane_force(
        GatedSignals(signals, value["doubt"], ca.SX(0.0)),
        estimation,
        dt=dt,
        measured=force,
        motors=value["motors_force"],
        contact=wrench[:3] / vehicle.mass_kg,
        delay_s=config.brush.force_delay_s,
        normal=contact["normal"],
        use_model=both(contact["in_contact"], value["velocity_young"]),
    )
    tip = vehicle.tip_position_m
    shrinks = unrolled(value["curvature"], contact["distance"])
    moved = predicted_motion(motion, rates, axes, tip, dt=dt, force=felt.force, rate=rate, shrinks=shrinks)
    signals.remember("motion", moved)
    signals.remember("turn", turn + dt * rate)
    signals.remember("flown_attitude", attitude)
    signals.remember("flown_rate", rate)
    axis = {"axis_right": axes.right, "axis_down": axes.down, "gravity": down}
    for name, result in {**contact, **axis, "wrench": wrench, "tared": ready, "density": felt.density}.items():
        signals.output(name, result)
    return signals


class WallContact:
    """Wall and contact as estimated.

    Attributes:
        state: Result of the last tick.
        plane_ns: Capture time of the last accepted plane, -1 before the first.
        surface_offset: Distance from the felt surface to the observed one [m], 0 while they are one.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first measurement."""
        self.state, self.plane_ns, self.surface_offset = no_contact(self._config), -1, 0.0

    def on_felt_surface(self, plane: Plane4) -> Plane4:
        """A measured plane (A, B, C, D) in C, moved to the surface that the tip touches."""
        if self.surface_offset == 0.0:
            return plane
        a, b, c, d = plane
        ratio = max(1.0 - self.surface_offset * math.sqrt(a * a + b * b + c * c) / abs(d), LEAST_RATIO)
        return a / ratio, b / ratio, c / ratio, d


class Estimator:
    """Estimates of one flight.

    Attributes:
        contact: Wall and contact.
        motion: Velocity, odometer and lines in the wall plane.
        attitude: (w, x, y, z), without steps that the gyro did not measure.
        rate: Angular velocity, without the gyro's bias [rad/s], (3,).
        force: Specific force [m/s^2], (3,).
        axes: Axes of the wall and gravity in B.
        wrench: Contact wrench on the vehicle at the centre of mass [N, N m], (6,); wrench_ns: its time.
        curvature: Of the wall by the last picture (right right, right down, down down) [1/m].
        tared: Whether the bias of the force sensor has been averaged long enough.

    Args:
        config: Geometry, `contact` settings, tick.
        estimation: Noise models and life times.
    """

    CONSTANTS = ("_memory", "_rates", "_motion", "_row", "_gyro_bias")

    def __init__(self, config: ControllerConfig, estimation: EstimationConfig) -> None:
        self._config, self._estimation, vehicle = config, estimation, config.vehicle
        self._tip_from_camera = np.subtract(vehicle.tip_position_m, vehicle.camera_position_m).tolist()
        self._step = StepFunction(prediction_signals(config, estimation), to_machine_code=config.compiled)
        count, row = sum(INPUTS.values()), sum(ROW.values())
        self._memory = memoryview(self._step.values[:count])  # type: ignore[arg-type]
        self._pack = struct.Struct(f"{count}d").pack_into
        self._rates, self._motion = self._step.inputs["rates"], self._step.states["motion"]
        self._gyro_bias = self._step.states["gyro.excess"]
        self._row = self._step.point[len(self._step.values) :][:row]
        self._history = TickHistory(self._row, config.tick_s)
        self.contact = WallContact(config)
        self.motion = WallMotion(self._tip_from_camera, self._history, estimation, config.compiled)
        self._fallback = InertialFallback(self._tip_from_camera, config.tick_s, config.compiled)
        self._level = down_in_body((1.0, 0.0, 0.0, 0.0))
        self.reset(dict(zip(INERTIAL, ([1.0, 0.0, 0.0, 0.0], [0.0] * 3, [0.0] * 3), strict=True)))

    def reset(self, measured: Mapping[str, list[float]]) -> None:
        """As before the first tick, with the inertial data assumed until then."""
        for part in (self._step, self._history, self.contact, self.motion, self._fallback):
            part.reset()
        self._stamp = self._sample_ns = self._counted_ns = self.wrench_ns = self._plane_ns = self._climb_ns = -1
        self._doubt, self.tared, self._plane = False, False, (0.0, 0.0, 1.0, -1.0)
        self.attitude, self.rate, self.force = (measured[name] for name in INERTIAL)
        self.axes, self.wrench = WallAxes.of(self.contact.state.normal, self._level), [0.0] * 6
        self._rates[:] = 0.0
        self.curvature = FLAT

    @property
    def lost(self) -> bool:
        """Whether the attitude is too uncertain for control."""
        return self._fallback.lost

    def doubt(self) -> None:
        """Ticks are missing for an unknown time."""
        self._doubt = True
        self.motion.doubt()

    def predict(
        self,
        frame: SensorFrame,
        measured: Mapping[str, list[float]],
        missing: Collection[str] = (),
        *,
        motors: MotorsModel,
        wrench: tuple[np.ndarray, int] | None = None,
        plane: Sequence[float] | None = None,
        plane_ns: int = -1,
        press: bool = False,
    ) -> ContactState:
        """Estimates of a tick; samples of the force sensor and planes count once, when their stamps are new.

        Args:
            frame: Stamps and force sensor.
            measured: The last accepted inertial data.
            missing: Names of the inertial sensors that fail.
            motors: Signals of the motors' model.
            wrench: Contact wrench in place of the force sensor's [N, N m], (6,), and its time [ns].
            plane: (A, B, C, D) of the wall in C, or None.
            plane_ns: Time at which it was measured.
            press: Whether the tip shall press.

        Returns:
            Wall and contact.
        """
        stamp, tick_s = frame.stamp_ns, self._config.tick_s
        elapsed = tick_s if self._stamp < 0 else max((stamp - self._stamp) * 1e-9, 0.0)
        self._stamp, dt = stamp, min(elapsed, LONGEST_TICK)
        self._take_inertial(stamp, dt, measured, missing, motors)
        sample, sample_s = frame.wrench.tolist(), 0.0
        if frame.wrench_stamp_ns > self._sample_ns and math.isfinite(sum(sample)):
            sample_s = sample_interval(frame.wrench_stamp_ns, self._sample_ns)
            self._sample_ns = frame.wrench_stamp_ns
        replacement, wrench_ns = (_NO_WRENCH, frame.wrench_stamp_ns) if wrench is None else wrench
        interval, self.wrench_ns = 0.0, wrench_ns
        if wrench_ns > self._counted_ns:
            interval, self._counted_ns = sample_interval(wrench_ns, self._counted_ns), wrench_ns
        plane_new = plane is not None and plane_ns > self._plane_ns
        if plane is not None and plane_new:
            self._plane_ns, self._plane = plane_ns, tuple(plane)
        self._pack(
            self._memory,
            0,
            dt,
            elapsed,
            *self.attitude,
            *self.rate,
            *self.force,
            not missing,
            "angular_velocity" not in missing,
            *(sample if sample_s else _NO_WRENCH),
            sample_s,
            wrench is not None,
            *replacement,
            interval,
            *self._plane,
            plane_new,
            (stamp - self._plane_ns) * 1e-9 if plane_new else 0.0,
            press,
            self._doubt,
            *motors.motors_force,
            self.motion.velocity_age_s < self._estimation.velocity_life_s,
            *self.curvature,
        )
        self._doubt = False
        self._step.evaluate()
        self._step.advance()
        values = self._step.results.tolist()
        density, self.tared, self.wrench = values.pop(), bool(values.pop()), values[-6:]
        rx, ry, rz, dx, dy, dz, gx, gy, gz = values[-15:-6]
        contact, self.contact.state = self.contact, read_contact(values)
        contact.surface_offset, accepted = values[-17:-15]
        if accepted:
            contact.plane_ns = plane_ns
        self.axes = WallAxes(contact.state.normal, (rx, ry, rz), (dx, dy, dz), (gx, gy, gz))
        self.attitude, self.rate = self._row[ATTITUDE].tolist(), self._row[RATE].tolist()
        self.motion.remember(stamp, self._row, dt, density)
        blind = self.motion.velocity_age_s > self._estimation.velocity_life_s
        if frame.height_rate is not None and blind and contact.state.known:
            taken = stamp if frame.height_rate_stamp_ns is None else frame.height_rate_stamp_ns
            self._correct_height_rate(frame.height_rate, taken)
        return contact.state

    def _correct_height_rate(self, height_rate: float, stamp_ns: int) -> None:
        """Correct the vertical velocity of a vehicle that has no young one from pictures; every sample counts once."""
        if stamp_ns <= self._climb_ns:
            return
        self._climb_ns, wall = stamp_ns, self.contact.state
        down = np.array(down_in_body(self.attitude_at(stamp_ns)))
        vertical = np.outer(down, down)
        covariance = HEIGHT_RATE_STD**2 * vertical + UNSEEN_STD**2 * (np.eye(3) - vertical)
        place = (*wall.normal, *down.tolist(), wall.distance)
        self.motion.correct_velocity(-height_rate * down, covariance, stamp_ns, place)
        self._motion[:] = self._history.newest[:STATES]

    def _take_inertial(
        self, stamp: int, dt: float, measured: Mapping[str, list[float]], missing: Collection[str], motors: MotorsModel
    ) -> None:
        """Inertial data of the tick: the measured ones, or estimates of those that fail."""
        fallback = self._fallback
        if not missing:
            fallback.active = False
            self.attitude, self.rate = measured["attitude"], measured["angular_velocity"]
            self.force = measured["specific_force"]
            return
        if not fallback.active:
            angles = {identity: line.angle for identity, line in self.motion.lines.items()}
            fallback.begin(self.attitude, self.rate, self.contact.state.normal, angles)
        attitude, rate, force = (None if name in missing else measured[name] for name in INERTIAL)
        unbiased = None if rate is None else np.subtract(rate, self._gyro_bias).tolist()
        fallback.step(stamp, dt, motors.angular_acceleration, attitude, unbiased)
        self.attitude, self.rate = attitude or fallback.attitude, rate or fallback.rate
        self.force = force or motors.modelled_force

    def correct(self, features: FeatureFrame) -> bool:
        """Correct motion and lines with a picture at the time of its capture; False without a wall to measure on."""
        contact, state = self.contact, self.contact.state
        if features.plane is not None and contact.plane_ns == features.stamp_ns:
            normal, distance = plane_in_body(contact.on_felt_surface(features.plane), self._tip_from_camera)
        elif state.known:
            normal, distance = state.normal, state.distance
        else:
            return False
        self.curvature = FLAT if features.curvature is None else features.curvature.tolist()
        if self._fallback.active:
            self._fallback.correct(features, distance)
        self.motion.correct(features, normal, down_in_body(self.attitude_at(features.stamp_ns)), distance)
        self._motion[:] = self._history.newest[:STATES]
        self._rates[:] = self.motion.rates.ravel()
        return True

    def attitude_at(self, stamp_ns: int) -> list[float]:
        """Attitude at a stamp, (w, x, y, z)."""
        return self._history.at(stamp_ns)[ATTITUDE].tolist()

    def rate_at(self, stamp_ns: int) -> list[float]:
        """Angular velocity at a stamp [rad/s], (3,)."""
        return self._history.at(stamp_ns)[RATE].tolist()

    def turn(self, begin_ns: int, end_ns: int) -> np.ndarray:
        """Integral of the angular velocity between two stamps [rad], (3,)."""
        return self._history.at(end_ns)[TURN] - self._history.at(begin_ns)[TURN]
