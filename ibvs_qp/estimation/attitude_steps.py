"""Steps of the attitude that the gyro did not see: absorbed at once, given back slowly."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ibvs_qp.quaternion import Quaternion, angle_between, conjugate, multiply, normalized

#: Least difference between an attitude and the one predicted by the gyro that is a step [rad], and least one in root
#: mean squares of that difference [-]: noise that counts as steps makes the attitude a random walk, 20 deg in 30 s at
#: 0.3 deg a sample.
STEP, STEP_SIGMAS = math.radians(1.0), 6.0
#: Averaging time of that mean square at 100 Hz and more [s], time for which one sample counts at most, late as it may
#: be [s], and its largest root [rad]: 0.3 deg a sample and axis, or a spell of steps.
NOISE_TIME, LONGEST_SAMPLE, MOST_NOISE = 1.0, 0.01, math.radians(0.8)
#: Rate at which an absorbed step is given back [rad/s]: half a degree per second, slow against the filters that learn
#: the direction of gravity.
RETURN_RATE = math.radians(0.5)

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
        self._power = 0.0  # mean square of the difference of a sample from its prediction [rad^2]

    def update(self, attitude: Sequence[float], rate: Sequence[float], dt: float) -> list[float] | None:
        """The continuous attitude (w, x, y, z), or None while it is the measured one.

        Args:
            attitude: Measured, (4,).
            rate: Angular velocity in B [rad/s], (3,).
            dt: Time since the last call [s].
        """
        w, x, y, z = attitude
        measured = (w, x, y, z)
        last = self._last or measured
        half = 0.5 * dt
        predicted = multiply(last, (1.0, half * rate[0], half * rate[1], half * rate[2]))
        if self.offset is not IDENTITY:
            self._give_back(dt)
        given = measured if self.offset is IDENTITY else multiply(measured, self.offset)
        step, gate = angle_between(predicted, given), max(STEP, STEP_SIGMAS * math.sqrt(self._power))
        self._power += min(dt, LONGEST_SAMPLE) / NOISE_TIME * (min(step, gate, MOST_NOISE) ** 2 - self._power)
        if step > gate:
            self.offset = normalized(multiply(conjugate(measured), predicted))
            given = normalized(predicted)
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
