"""Turns of the measured wall normal against those of the gyro: a depth camera with mirrored axes."""

from __future__ import annotations

import math
from collections.abc import Sequence

#: Turns are compared over this time [ns], and judged once the gyro's have this root sum of squares [rad]: five times
#: the noise of a turn by two normals of 0.6 deg each over the threshold's distance from a right sign.
TURN_NS, LEAST_TURN = 250_000_000, math.radians(3.0)
#: Correlation of both over the gyro's square, below which they oppose each other: 1 right, -1 mirrored.
OPPOSED = -0.5


class NormalTurns:
    """Finds a normal that turns against the vehicle's yaw; following it would turn the vehicle to the wall's side.

    Attributes:
        mirrored: Whether it was found.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """As before the first plane."""
        self.mirrored = False
        self._start: tuple[int, float, float] | None = None
        self._square = self._product = 0.0

    def add(self, stamp_ns: int, normal: Sequence[float], turn: float) -> None:
        """Add a measured normal in B, (3,), of a capture time [ns], and the integrated yaw of that time [rad]."""
        seen = -math.atan2(normal[1], normal[0])  # the wall turns the other way in B
        if self._start is None:
            self._start = stamp_ns, seen, turn
        then, first, begun = self._start
        if stamp_ns - then < TURN_NS:
            return
        self._start = stamp_ns, seen, turn
        felt = turn - begun
        self._square += felt * felt
        self._product += felt * math.remainder(seen - first, math.tau)
        if self._square >= LEAST_TURN**2:
            self.mirrored = self.mirrored or self._product < OPPOSED * self._square
            self._square = self._product = 0.0
