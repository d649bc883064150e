"""Start-up self-check: sensor data in other axes than front-right-down and north-east-down, found before contact.

Level and at rest many wrong conventions look right. So the check goes on until the first touch: accelerometer and load
of the force sensor at rest, attitude against accelerometer and gyro, and the force of the first touch against the
wall's normal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.frames import GRAVITY, Vector3, add_scaled, dot, down_in_body
from ibvs_qp.validation.load_check import LoadCheck

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


#: Beyond this distance the sensor's mean is the load without contact [m]; averaging time at least and at most [s].
FREE_DISTANCE, LEAST_TIME, LONGEST_TIME = 0.04, 0.5, 5.0
#: A touch is evaluated within this distance of the wall [m], beyond this force [N] and this many standard deviations in
#: free flight; the force is filtered over this time [s].
TOUCH_DISTANCE, TOUCH_FORCE, TOUCH_SIGMAS, FILTER_TIME = 0.02, 2.0, 6.0, 0.1
#: Cosine of the angle between the force and the normal out of the wall: at least with a friction of 0.8 and right
#: axes; at most with wrong ones.
LEAST_RIGHT, LARGEST_WRONG = 0.7, 0.5


class TouchCheck:
    """Finds a force sensor whose axes are swapped or of the wrong sign.

    It reads the raw sensor: the tare trusts the moments, which are wrong as well then.

    Attributes:
        passed: Whether a touch was felt in the right direction.
        faults: In words.
    """

    def __init__(self) -> None:
        self.passed = False
        self.faults: tuple[str, ...] = ()
        self._load: Vector3 = (0.0, 0.0, 0.0)
        self._force: Vector3 = (0.0, 0.0, 0.0)
        self._time = 0.0

    def add(self, raw: Sequence[float], noise: float, normal: Sequence[float], distance: float, dt: float) -> None:
        """Add a tick; arguments as of `ibvs_qp.validation.self_check.SelfCheck.contact`."""
        if distance > FREE_DISTANCE:
            self._time = min(self._time + dt, LONGEST_TIME)
            gain = dt / max(self._time, dt)
            self._load = add_scaled(self._load, gain, add_scaled(raw, -1.0, self._load))
            self._force = (0.0, 0.0, 0.0)
            return
        touch, gain = add_scaled(self._load, -1.0, raw), 1.0 - math.exp(-dt / FILTER_TIME)
        self._force = add_scaled(self._force, gain, add_scaled(touch, -1.0, self._force))
        size = math.hypot(*self._force)
        if self._time < LEAST_TIME or distance > TOUCH_DISTANCE or size < max(TOUCH_FORCE, TOUCH_SIGMAS * noise):
            return
        cosine = -dot(self._force, normal) / size
        self.passed = cosine >= LEAST_RIGHT
        if cosine <= LARGEST_WRONG:
            x, y, z = self._force
            self.faults = (
                f"wrench: the first touch is ({x:.1f}, {y:.1f}, {z:.1f}) N on the vehicle, not against the approach; "
                "axes of the force sensor swapped or of the wrong sign",
            )


#: Duration of one turn [s]. An axis is checked once its gyro turns, as root of the sum of squares, exceed an angle
#: [rad] and this multiple of the noise in one turn of the attitude [-]. The standard deviation of the correlation is
#: then at most 0.2.
TURN_TIME, LEAST_TURN, LEAST_RATIO = 0.25, math.radians(0.7), 5.0
#: Turns after which that noise is known.
LEAST_TURNS = 4
#: Correlation of both over the gyro's square, below which they oppose each other: 1 right, -1 with a wrong sign.
OPPOSED = -0.5
#: A turn of the attitude counts up to this multiple of the gyro's: yaw is arbitrary and may jump.
LARGEST_RATIO = 2.0
#: Largest difference of the two turns that enters the noise [rad]; a jump of yaw is larger.
LARGEST_NOISE = math.radians(3.0)


class TurnCheck:
    """Finds an attitude that turns against the gyro about some axis: one is FRD, the other FLU.

    Attributes:
        faults: In words.
    """

    def __init__(self) -> None:
        self.faults: tuple[str, ...] = ()
        self._start: Sequence[float] | None = None
        self._time, self._turn = 0.0, [0.0, 0.0, 0.0]
        self._square, self._product, self._opposed = [0.0] * 3, [0.0] * 3, [False] * 3
        self._turns, self._same_sign, self._other_sign = 0, [0.0] * 3, [0.0] * 3

    def add(self, attitude: Sequence[float], rate: Sequence[float], dt: float) -> None:
        """Add a tick: quaternion B in I, gyro [rad/s], time since the last tick [s]."""
        if self._start is None:
            self._start = attitude
            return
        self._time += dt
        self._turn = [turn + dt * entry for turn, entry in zip(self._turn, rate, strict=True)]
        if self._time < TURN_TIME:
            return
        turns = list(zip(turned(self._start, attitude), self._turn, strict=True))
        noise = self._noise(turns)
        for axis, (seen, felt) in enumerate(turns):
            largest = LARGEST_RATIO * abs(felt)
            self._square[axis] += felt * felt
            self._product[axis] += felt * min(max(seen, -largest), largest)
            if self._turns >= LEAST_TURNS and self._square[axis] >= max(LEAST_TURN**2, LEAST_RATIO**2 * noise):
                self._opposed[axis] = self._product[axis] < OPPOSED * self._square[axis]
                self._square[axis] = self._product[axis] = 0.0
        self._start, self._time, self._turn = attitude, 0.0, [0.0, 0.0, 0.0]
        axes = " and ".join([name for name, opposed in zip("xyz", self._opposed, strict=True) if opposed])
        self.faults = (f"attitude: turns against the gyro about {axes}; one of both is FLU, not FRD",) if axes else ()

    def _noise(self, turns: Sequence[tuple[float, float]]) -> float:
        """Add (attitude's, gyro's) turns of the axes [rad]; the noise of a turn of the worst axis, mean square [rad^2].

        The gyro has either the sign of the attitude or the opposite one. The smaller residual of both is noise.
        """
        self._turns += 1
        for axis, (seen, felt) in enumerate(turns):
            self._same_sign[axis] += min(abs(seen - felt), LARGEST_NOISE) ** 2
            self._other_sign[axis] += min(abs(seen + felt), LARGEST_NOISE) ** 2
        return max(map(min, self._same_sign, self._other_sign)) / self._turns


def turned(start: Sequence[float], end: Sequence[float]) -> tuple[float, float, float]:
    """Small rotation from one attitude (w, x, y, z) to another, in B [rad], (3,)."""
    (a, b, c, d), (w, x, y, z) = start, end
    sign = 2.0 if a * w + b * x + c * y + d * z >= 0.0 else -2.0
    return (
        sign * (a * x - b * w - c * z + d * y),
        sign * (a * y + b * z - c * w - d * x),
        sign * (a * z - b * y + c * x - d * w),
    )


class SelfCheck:
    """Checks the axes of attitude, inertial sensors and force sensor; `faults` has its findings.

    Attributes:
        done: Whether nothing is left to check: after a first touch with the right axes, or disabled.

    Args:
        enabled: Whether anything is checked.
        load: Check of the force sensor's load, for raw readings; None for a tared wrench.
    """

    def __init__(self, enabled: bool, load: LoadCheck | None = None) -> None:
        self._enabled, self._load = enabled, load
        self.reset()

    def reset(self) -> None:
        """As before the first tick."""
        self._rest, self._turn, self._touch = RestCheck(), TurnCheck(), TouchCheck()
        if self._load is not None:
            self._load.reset()
        self.done = not self._enabled

    @property
    def passed(self) -> bool:
        """Whether the vehicle may approach the wall: the sensors agreed at rest, and nothing was found since."""
        return self.done or (self._rest.passed and not self.faults())

    def faults(self) -> tuple[str, ...]:
        """Findings in words; empty without a fault, and after a first touch with the right axes."""
        if self.done:
            return ()
        load = () if self._load is None else self._load.faults
        return (*self._rest.faults, *self._turn.faults, *load, *self._touch.faults)

    @property
    def note(self) -> str:
        """Finding of the check of the force sensor's load that is no fault."""
        return "" if self._load is None else self._load.note

    def inertial(self, attitude: Sequence[float], rate: Sequence[float], force: Sequence[float], dt: float) -> None:
        """Add a tick: quaternion B in I, gyro [rad/s], accelerometer [m/s^2], time since the last tick [s]."""
        if self.done:
            return
        if not self._rest.passed:
            self._rest.add(down_in_body(attitude), rate, force, dt)
        self._turn.add(attitude, rate, dt)

    def load(self, wrench: np.ndarray, stamp_ns: int, force: Sequence[float], free: bool, dt: float) -> None:
        """Add the raw force sensor of one tick; arguments as of `ibvs_qp.validation.load_check.LoadCheck.add`."""
        if not self.done and self._load is not None:
            self._load.add(wrench, stamp_ns, force, free, dt)

    def contact(self, raw: Sequence[float], noise: float, normal: Sequence[float], distance: float, dt: float) -> None:
        """Add the force sensor of one tick.

        Args:
            raw: Its force, vehicle on tool [N], (3,).
            noise: Standard deviation of the filtered push in free flight [N].
            normal: Unit vector into the wall, in B, (3,).
            distance: Tip to wall [m], infinite while unknown.
            dt: Time since the last tick [s].
        """
        if not self.done:
            self._touch.add(raw, noise, normal, distance, dt)
            self.done = self._touch.passed and self.passed
