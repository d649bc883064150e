"""Steps of the attitude that the gyro did not see: absorbed at once, given back slowly."""

from __future__ import annotations

import math
from collections.abc import Sequence

#: Difference between an attitude and the one predicted by the gyro that is a step [rad]: 1 degree. The noise of an
#: attitude is a tenth of it.
STEP = math.radians(1.0)
#: A sum of changes of the quaternion's entries below this is no step, at any rate: half a degree at most.
NO_STEP = 4e-3
#: Rate at which an absorbed step is given back [rad/s]: half a degree per second, slow against the filters that learn
#: the direction of gravity.
RETURN_RATE = math.radians(0.5)

Quaternion = tuple[float, float, float, float]
IDENTITY: Quaternion = (1.0, 0.0, 0.0, 0.0)


class AttitudeSteps:
    """Makes an attitude continuous.

    An estimator that re-aligns itself moves its attitude by degrees in one tick. Taken at once, gravity leaks into
    the accelerations along the wall and the wall normal, 0.34 m/s^2 for 2 degrees, faster than any filter learns it.

    Attributes:
        offset: Rotation from the attitude given out to the measured one.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """As before the first attitude."""
        self.offset = IDENTITY
        self._last: Quaternion | None = None

    def update(self, attitude: Sequence[float], rate: Sequence[float], dt: float) -> list[float] | None:
        """The continuous attitude (w, x, y, z), or None while it is the measured one.

        Args:
            attitude: Measured, (4,).
            rate: Angular velocity in B [rad/s], (3,).
            dt: Time since the last call [s].
        """
        w, x, y, z = attitude
        measured = (w, x, y, z)
        last, self._last = self._last or measured, measured
        if (
            self.offset is IDENTITY
            and abs(w - last[0]) + abs(x - last[1]) + abs(y - last[2]) + abs(z - last[3]) < NO_STEP
        ):
            return None
        half = 0.5 * dt
        predicted = _product(last, (1.0, half * rate[0], half * rate[1], half * rate[2]))
        if self.offset is not IDENTITY:
            self._give_back(dt)
        given = measured if self.offset is IDENTITY else _product(measured, self.offset)
        if abs(sum(map(float.__mul__, predicted, given))) < _cosine_of_half(STEP, predicted, given):
            self.offset = _unit(_product(_inverse(measured), predicted))
            given = _unit(predicted)
        self._last = given
        return None if self.offset is IDENTITY else list(given)

    def _give_back(self, dt: float) -> None:
        """Shorten the offset."""
        w, *vector = self.offset
        sine = math.hypot(*vector)
        angle = 2.0 * math.atan2(sine, abs(w))
        left = angle - RETURN_RATE * dt
        if left <= 0.0:
            self.offset = IDENTITY
            return
        scale = math.copysign(math.sin(0.5 * left) / sine, w)
        self.offset = (math.cos(0.5 * left), vector[0] * scale, vector[1] * scale, vector[2] * scale)


def _cosine_of_half(angle: float, first: Quaternion, second: Quaternion) -> float:
    return math.cos(0.5 * angle) * math.hypot(*first) * math.hypot(*second)


def _product(first: Quaternion, second: Quaternion) -> Quaternion:
    (a, b, c, d), (e, f, g, h) = first, second
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )


def _inverse(quaternion: Quaternion) -> Quaternion:
    w, x, y, z = quaternion
    return (w, -x, -y, -z)


def _unit(quaternion: Quaternion) -> Quaternion:
    length = math.hypot(*quaternion)
    w, x, y, z = quaternion
    return (w / length, x / length, y / length, z / length)
