"""Attitude and turn at the time of a picture that arrives late."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ibvs_qp.estimation.stamps import HISTORY, StampRing
from ibvs_qp.frames import Vector3, add_scaled


class AttitudeHistory:
    """Attitude and integrated gyro of the last ticks.

    Args:
        ticks: Stamps of the ticks.
    """

    def __init__(self, ticks: StampRing) -> None:
        self._ticks = ticks
        self.reset()

    def reset(self) -> None:
        """As before the first tick."""
        self._turn: Vector3 = (0.0, 0.0, 0.0)  # integrated gyro [rad]
        self._attitudes, self._turns = [[1.0, 0.0, 0.0, 0.0]] * HISTORY, [self._turn] * HISTORY
        self._rates: list[Sequence[float]] = [self._turn] * HISTORY

    def remember(self, attitude: list[float], rate: Sequence[float], dt: float) -> None:
        """Store attitude (w, x, y, z) and angular velocity [rad/s] of the newest tick, ``dt`` [s] after the last."""
        self._turn = add_scaled(self._turn, dt, rate)
        slot = self._ticks.slot(0)
        self._attitudes[slot], self._turns[slot], self._rates[slot] = attitude, self._turn, tuple(rate)

    def attitude(self, stamp_ns: int) -> list[float]:
        """Attitude at a stamp, (w, x, y, z)."""
        return self._attitudes[self._ticks.nearest_slot(stamp_ns)]

    def rate(self, stamp_ns: int) -> Sequence[float]:
        """Angular velocity at a stamp [rad/s], (3,)."""
        return self._rates[self._ticks.nearest_slot(stamp_ns)]

    def turn(self, begin_ns: int, end_ns: int) -> np.ndarray:
        """Integral of the angular velocity between two stamps [rad], (3,)."""
        begin, end = (self._turns[self._ticks.nearest_slot(stamp)] for stamp in (begin_ns, end_ns))
        return np.subtract(end, begin)
