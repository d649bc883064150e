"""Time of samples: the remembered tick of a late measurement, and the interval between two force samples."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence

import numpy as np

#: Time remembered [s], far beyond any camera's latency.
HISTORY_S = 0.512
#: A stamp may lie this many nominal ticks ahead of the newest tick, and this many before the oldest.
AHEAD, BEFORE = 1.5, 0.5
#: Interval of the first force sample: 100 Hz; and the longest one that filters count [s].
FIRST_INTERVAL, LONGEST_INTERVAL = 0.01, 0.1


class TickHistory:
    r"""Rows of numbers of the ticks of the last `HISTORY_S`, found by time: uneven ticks do no harm.

    Attributes:
        rows: All rows, also unused ones; may be written.
        place: Of the newest row.

    Args:
        start: Row of a time before the first tick, (n,).
        tick_s: Nominal control period [s].
    """

    def __init__(self, start: Sequence[float] | np.ndarray, tick_s: float) -> None:
        self._start, self._tick_ns = np.array(start, float), max(1, round(tick_s * 1e9))
        self._most = max(2, round(HISTORY_S / tick_s))
        # Twice as long as needed: a full buffer moves its newest half to the front, so that history is one slice.
        self.rows = np.zeros((2 * self._most, len(self._start)))
        self.reset()

    def reset(self) -> None:
        """Forget every tick."""
        self.rows[:] = self._start
        self._stamps, self._lengths = list[int](), list[float]()
        self.place, self._growth = 0, (-1, np.zeros((1, 3)))  # of a place, until the next tick

    @property
    def newest(self) -> np.ndarray:
        """Row of the newest tick, (n,): a view."""
        return self.rows[self.place]

    def add(self, stamp_ns: int, row: np.ndarray, dt: float) -> None:
        """Add a tick, later than all before, ``dt`` [s] after the last one."""
        if len(self._stamps) == len(self.rows):
            self.rows[: self._most] = self.rows[self._most :]
            self._stamps, self._lengths = self._stamps[self._most :], self._lengths[self._most :]
        self._stamps.append(stamp_ns)
        self._lengths.append(dt)
        self.place = len(self._stamps) - 1
        self.rows[self.place] = row
        self._growth = -1, self._growth[1]

    def find(self, stamp_ns: int) -> int | None:
        """Place of the tick nearest to a stamp; None outside the remembered time."""
        stamps, first = self._stamps, max(len(self._stamps) - self._most, 0)
        if not stamps or stamp_ns - stamps[first] < -BEFORE * self._tick_ns:
            return None
        if stamp_ns - stamps[-1] > AHEAD * self._tick_ns:
            return None
        return self._nearest(stamp_ns, first)

    def _nearest(self, stamp_ns: int, first: int) -> int:
        stamps = self._stamps
        after = bisect_left(stamps, stamp_ns, first)
        if after == len(stamps) or (after > first and stamp_ns - stamps[after - 1] <= stamps[after] - stamp_ns):
            after -= 1
        return after

    def at(self, stamp_ns: int) -> np.ndarray:
        """Row of the tick nearest to a stamp; outside the remembered time of the newest or the oldest one."""
        if not self._stamps:
            return self.newest
        return self.rows[self._nearest(stamp_ns, max(len(self._stamps) - self._most, 0))]

    def change(self, place: int, changes: np.ndarray) -> None:
        """Add a change of the tick at a place, carried along (`LateKalman`), to it and to all later ticks.

        Args:
            place: By `find`.
            changes: dx, G dx and G^2 dx of the first k entries of a row, (3, k).
        """
        if self._growth[0] != place:
            once = twice = 0.0
            factors = [(once, twice)]
            for length in self._lengths[place + 1 :]:
                once, twice = once + length, twice + length * once
                factors.append((once, twice))
            self._growth = place, np.array(factors)
        once, twice = self._growth[1].T[:, :, None]
        carried = changes[0] + once * changes[1] + twice * changes[2]  # no matrix product: added in this order in C too
        self.rows[place : self.place + 1, : changes.shape[1]] += carried


def sample_interval(stamp_ns: int, last_ns: int) -> float:
    """Time since the last force sample [s], bounded; ``last_ns`` is -1 before the first one."""
    return FIRST_INTERVAL if last_ns < 0 else min((stamp_ns - last_ns) * 1e-9, LONGEST_INTERVAL)
