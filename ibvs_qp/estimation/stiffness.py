"""Stiffness of brush and wall, estimated while pressing."""

from __future__ import annotations

import math

#: Stiffness assumed while nothing is known [N/m]; stiff, because a stiff wall forgives least (design 4.2).
ASSUMED_STIFFNESS = 10_000.0


class StiffnessEstimator:
    """Slope of push against penetration over the press, by least squares with the running means removed."""

    #: Push spread needed before the slope is believed [N].
    NEEDED_SPREAD = 1.0
    #: Time after touch during which samples count [s].
    WINDOW = 3.0
    #: Filter of the penetration, equal to that of the push so that both lag alike [Hz].
    FILTER_HZ = 8.0
    #: Range that brushes and walls can have [N/m].
    RANGE = (300.0, 30_000.0)

    def __init__(self) -> None:
        self.value = ASSUMED_STIFFNESS
        self.known = False
        self.start()

    def start(self) -> None:
        """Begin anew at a touch; the last estimate stays until a better one is there."""
        self._time = self._count = 0.0
        self._depth = math.nan
        self._sums = [0.0, 0.0, 0.0, 0.0, 0.0]

    def add(self, push: float, penetration: float, dt: float) -> None:
        """Take in one filtered push [N] and the penetration [m]."""
        self._time += dt
        if self._time > self.WINDOW:
            return
        share = 1.0 - math.exp(-2.0 * math.pi * self.FILTER_HZ * dt)
        self._depth = penetration if math.isnan(self._depth) else self._depth + share * (penetration - self._depth)
        sums, x, y = self._sums, self._depth, push
        for index, term in enumerate((1.0, x, y, x * y, y * y)):
            sums[index] += term
        count, mean_x, mean_y = sums[0], sums[1] / sums[0], sums[2] / sums[0]
        spread = sums[4] / count - mean_y * mean_y
        cross = sums[3] / count - mean_x * mean_y
        # Regress penetration on push: the push is the cleaner signal, so the slope is not biased low.
        if spread > self.NEEDED_SPREAD**2 and cross > 0.0 and count > 30:
            self.value = min(max(spread / cross, self.RANGE[0]), self.RANGE[1])
            self.known = True
