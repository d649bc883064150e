"""Attitude and rate while inertial sensors fail: the motors' model, corrected by the remaining sensors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from ibvs_qp.estimation.kalman import LateKalman
from ibvs_qp.estimation.tick_history import TickHistory
from ibvs_qp.estimation.wall_lines import WallAxes, wall_line
from ibvs_qp.frames import Vector3, add_scaled, cross, down_in_body, plane_in_body
from ibvs_qp.measurement import VERTICAL, FeatureFrame
from ibvs_qp.quaternion import small_difference, turned
from ibvs_qp.symbolic.function import StepFunction
from ibvs_qp.symbolic.logic import both, either, where
from ibvs_qp.symbolic.signals import Signals

#: Order of the filter's state: rotation since the failure [rad], rate [rad/s], unmodelled acceleration [rad/s^2].
ANGLE, RATE, BIAS = slice(0, 3), slice(3, 6), slice(6, 9)
#: The chain of one axis.
CHAIN = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
#: Spectral densities: of the angle itself, of the rate by the motors' model [rad^2/s^3], and of the error of that model
#: [rad^2/s^5].
NOISE = (1e-10, 0.05**2, 0.03**2)
#: Standard deviations at the failure: attitude [rad], rate [rad/s], unmodelled acceleration [rad/s^2].
START_STD = (2e-3, 0.01, 0.3)
#: Standard deviations of the remaining sensors: attitude and plane or line of a picture [rad], gyro [rad/s].
ATTITUDE_STD, PICTURE_STD, GYRO_STD = 2e-3, 8e-3, 5e-3
#: Refused beyond this many standard deviations.
GATE_SIGMAS = 6.0
#: The attitude is lost when its standard deviation exceeds this [rad], the largest error that a descent tolerates.
LOST_STD = math.radians(20.0)
#: Inputs of a correction: time since the last one [s]; age of the measurement [s] and state then; which of angles and
#: rates it measures, their values and the deviation of the angles; a line of a picture, whether there is one, the angle
#: on the wall that it had before, if any, gravity and the wall's normal then.
INPUTS = {"elapsed": 1, "age": 1, "past": 9, "known": 6, "values": 6, "angle_std": 1} | {
    name: 1 for name in ("line", "rho", "theta", "vertical", "before", "before_known")
}
WALL = {"gravity": 3, "normal": 3}
#: No line.
_NO_LINE = (0.0,) * 6 + (0.0, 0.0, 1.0, 1.0, 0.0, 0.0)


def correction_signals(tip_from_camera: list[float]) -> Signals:
    """Correction of angles and rates by one measurement of a past time: a filter of three states for every axis."""
    signals = Signals()
    value = {name: signals.input(name, size) for name, size in (INPUTS | WALL).items()}
    rho, theta, no_end = value["rho"], value["theta"], (ca.SX(0.0), ca.SX(0.0))
    axes = WallAxes.of_symbols(value["normal"], value["gravity"])
    seen = wall_line(rho, theta, value["vertical"], (no_end, no_end), axes, tip_from_camera, ca.SX(1.0))
    by_line = both(value["line"], seen.known)
    known, values = ca.vertsplit(value["known"]), ca.vertsplit(value["values"])
    known[0] = either(known[0], by_line)
    turned = where(value["before_known"], value["before"] - seen.angle, 0.0)
    values[0] = where(by_line, value["past"][0] + turned, values[0])
    changes = [ca.SX(9, 1) for _ in range(3)]
    for axis in range(3):
        kalman = LateKalman(signals, f"axis_{axis}", CHAIN, START_STD, value["elapsed"])
        kalman.noise, change = NOISE, ca.SX.zeros(3)
        kalman.go_to(either(*known), value["age"])
        for entry, std in ((1, GYRO_STD), (0, value["angle_std"])):
            place = axis + 3 * entry
            innovation = values[place] - value["past"][place] - change[entry]
            good = both(known[place], kalman.within(entry, innovation, std * std, GATE_SIGMAS))
            change += kalman.correct(good, entry, innovation, std * std)
        kalman.store()
        for total, part in zip(changes, (change, *kalman.growth(change)), strict=True):
            total[axis::3] = part
    signals.output("changes", ca.vertcat(*changes))
    signals.output("line_known", seen.known)
    signals.output("line_angle", seen.angle)
    return signals


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
        compiled: Whether it runs as machine code.
    """

    CONSTANTS = ("_covariances",)

    def __init__(self, tip_from_camera: list[float], tick_s: float, compiled: bool = False) -> None:
        self._tip_from_camera = tip_from_camera
        self._step = StepFunction(correction_signals(tip_from_camera), to_machine_code=compiled)
        self._covariances = [self._step.states[f"axis_{axis}.covariance"] for axis in range(3)]
        self._history = TickHistory(np.zeros(9), tick_s)
        self.reset()

    def reset(self) -> None:
        """Not running."""
        self.active, self._stamp, self._corrected, self._evaluated = False, -1, -1, -1
        self.attitude: list[float] = [1.0, 0.0, 0.0, 0.0]

    @property
    def rate(self) -> list[float]:
        """Angular velocity [rad/s], (3,)."""
        return self._history.newest[RATE].tolist()

    @property
    def lost(self) -> bool:
        """Whether the attitude is too uncertain for control."""
        if not self.active:
            return False
        dt = (self._stamp - self._corrected) * 1e-9
        noise = NOISE[1] * dt**3 / 3.0 + NOISE[2] * dt**5 / 20.0
        # Of angle + dt rate + dt^2/2 bias, by the covariance at the last correction, column by column.
        ahead = np.array((1.0, 2.0 * dt, dt**2, dt**2, dt**3, 0.25 * dt**4))
        return any(float(ahead @ covariance) + noise > LOST_STD**2 for covariance in self._covariances)

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
        self.reset()
        self._step.reset()
        self._history.reset()
        self._history.rows[:, RATE] = rate
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
        state = self._history.newest.copy()
        state[ANGLE] += dt * state[RATE]
        state[RATE] += dt * (acceleration + state[BIAS])
        self._history.add(stamp_ns, state, dt)
        self._stamp = stamp_ns
        if self._corrected < 0 or rate is not None or attitude is not None:
            self._corrected = stamp_ns
        if rate is not None or attitude is not None:
            known = (attitude is not None,) * 3 + (rate is not None,) * 3
            rotation = (0.0,) * 3 if attitude is None else small_difference(self._start, attitude)
            self._correct(stamp_ns, (*known, *rotation, *((0.0,) * 3 if rate is None else rate), ATTITUDE_STD))
        self._turn()

    def correct(self, frame: FeatureFrame, distance: float) -> None:
        """Correct with the wall's plane and lines of a picture at its capture; distance of the tip then [m]."""
        if frame.plane is None:
            return
        normal, _ = plane_in_body(frame.plane, self._tip_from_camera)
        self._corrected = max(self._corrected, frame.stamp_ns)
        rotation = cross(self._normal, add_scaled(self._normal, -1.0, normal))
        self._correct(frame.stamp_ns, (0, 1, 1, 0, 0, 0, *rotation, 0, 0, 0, PICTURE_STD))
        for line in frame.lines:
            if (place := self._history.find(frame.stamp_ns)) is None:
                return
            gravity = down_in_body(turned(self._start, self._history.rows[place, ANGLE].tolist()))
            before = self._angles.get(line.track_id)
            values = 1.0, line.rho, line.theta, line.role == VERTICAL, before or 0.0, before is not None
            self._correct(frame.stamp_ns, (*(0.0,) * 12, PICTURE_STD), (*values, *gravity, *normal))
            if self._step.outputs["line_known"].item():
                self._angles.setdefault(line.track_id, self._step.outputs["line_angle"].item())
        self._turn()

    def _correct(self, stamp_ns: int, measured: Sequence[float], line: Sequence[float] = _NO_LINE) -> None:
        place, last = self._history.find(stamp_ns), self._evaluated
        if place is None:
            return
        elapsed = (self._stamp - last) * 1e-9 if last >= 0 else 0.0
        past = self._history.rows[place].tolist()
        self._step.values[:] = elapsed, (self._stamp - stamp_ns) * 1e-9, *past, *measured, *line
        self._step.evaluate()
        self._step.advance()
        self._evaluated = self._stamp
        self._history.change(place, self._step.outputs["changes"].reshape(3, 9))

    def _turn(self) -> None:
        self.attitude = list(turned(self._start, self._history.newest[ANGLE].tolist()))
