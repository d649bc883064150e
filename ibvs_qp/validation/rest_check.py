"""Accelerometer against gravity, and the attitude's down direction against the accelerometer, at the start."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ibvs_qp.frames import GRAVITY, Vector3, add_scaled, dot

#: Averaging time [s]: as short as the motors' lag, for a vehicle that is switched on in the air.
MEAN_TIME = 0.05
#: At rest the mean specific force has the length of gravity to this error [m/s^2], and no angular velocity exceeds
#: this [rad/s].
REST_FORCE_ERROR, REST_RATE = 1.5, 0.5
#: Largest angle between the attitude's down direction and the measured one, at rest and accelerated [rad].
REST_ANGLE, MOVING_ANGLE = math.radians(15.0), math.radians(45.0)
#: Least length of the integral of down [s], in divisions: an attitude that turns over has none.
LEAST_DOWN = 1e-9
#: Specific force downwards that neither ground nor rotors exert [m/s^2], and largest sideways part of one at rest.
DOWNWARD, SIDEWAYS = 0.5 * GRAVITY, 0.5


class RestCheck:
    """Finds an accelerometer or an attitude in other axes than FRD and NED.

    Attributes:
        passed: Whether both were right during a rest.
        faults: In words.
    """

    def __init__(self) -> None:
        self.passed = False
        self.faults: tuple[str, ...] = ()
        self._begin()

    def _begin(self) -> None:
        self._time = self._rate = 0.0
        self._force: Vector3 = (0.0, 0.0, 0.0)  # integrals
        self._down: Vector3 = (0.0, 0.0, 0.0)

    def add(self, down: Vector3, rate: Sequence[float], force: Sequence[float], dt: float) -> None:
        """Add a tick: unit vector of gravity in B by the attitude, gyro [rad/s], accelerometer [m/s^2], time [s]."""
        self._time, self._rate = self._time + dt, max(self._rate, math.hypot(*rate))
        self._force, self._down = add_scaled(self._force, dt, force), add_scaled(self._down, dt, down)
        if self._time >= MEAN_TIME:
            self._evaluate(add_scaled((0.0, 0.0, 0.0), 1.0 / self._time, self._force))
            self._begin()

    def _evaluate(self, force: Vector3) -> None:
        length = math.hypot(*force)
        at_rest = self._rate <= REST_RATE and abs(length - GRAVITY) <= REST_FORCE_ERROR
        fault = self._force_fault(force, length, at_rest) or self._attitude_fault(force, length, at_rest)
        if fault or at_rest:
            self.passed, self.faults = not fault, (fault,) if fault else ()

    def _force_fault(self, force: Vector3, length: float, at_rest: bool) -> str:
        if force[2] > DOWNWARD:
            kind = "FLU, or its sign is gravity's"
        elif at_rest and math.hypot(force[0], force[1]) > SIDEWAYS * length:
            kind = "swapped"
        else:
            return ""
        x, y, z = force
        return (
            f"specific_force: ({x:.1f}, {y:.1f}, {z:.1f}) m/s^2 at the start, (0, 0, -9.8) in FRD; its axes are {kind}"
        )

    def _attitude_fault(self, force: Vector3, length: float, at_rest: bool) -> str:
        if length < DOWNWARD:
            return ""  # falls
        cosine = -dot(force, self._down) / (length * max(math.hypot(*self._down), LEAST_DOWN))
        if cosine >= math.cos(REST_ANGLE if at_rest else MOVING_ANGLE):
            return ""
        angle = math.degrees(math.acos(max(cosine, -1.0)))
        return f"attitude: down is {angle:.0f} deg off the accelerometer's at the start; it is not that of FRD in NED"
