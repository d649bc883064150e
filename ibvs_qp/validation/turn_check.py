"""Turns of the attitude against those of the gyro."""

from __future__ import annotations

import math
from collections.abc import Sequence

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
