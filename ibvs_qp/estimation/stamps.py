"""Time of samples: the remembered tick of a late measurement, and the interval between two force samples."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque

import numpy as np

#: Ticks remembered; at 250 Hz half a second, far beyond any camera's latency.
HISTORY = 128
#: A stamp may lie this many nominal ticks ahead of the newest tick, and this many before the oldest.
AHEAD, BEFORE = 1.5, 0.5
#: Interval of the first force sample: 100 Hz; and the longest one that filters count [s].
FIRST_INTERVAL, LONGEST_INTERVAL = 0.01, 0.1


class StampRing:
    """Stamps of the last `HISTORY` ticks, and the slots of a ring in which other classes store what belongs to them.

    Late measurements find their tick by time, so dropped and uneven ticks do no harm.

    Attributes:
        now: Number of ticks so far; the newest has slot ``now % HISTORY``.

    Args:
        tick_s: Nominal control period [s].
    """

    def __init__(self, tick_s: float) -> None:
        self._tick_ns = max(1, round(tick_s * 1e9))
        self.reset()

    def reset(self) -> None:
        """Forget every tick."""
        self._stamps: deque[int] = deque(maxlen=HISTORY)
        self.now = 0

    def add(self, stamp_ns: int) -> int:
        """Add a tick, later than all before, and return its slot."""
        self.now += 1
        self._stamps.append(stamp_ns)
        return self.now % HISTORY

    def slot(self, age: int) -> int:
        """Slot of the tick ``age`` ticks ago."""
        return (self.now - age) % HISTORY

    def age(self, stamp_ns: int) -> int | None:
        """How many ticks ago the tick nearest to a stamp was; None outside the remembered time."""
        stamps = self._stamps
        if not stamps or not -BEFORE * self._tick_ns <= stamp_ns - stamps[0]:
            return None
        if stamp_ns - stamps[-1] > AHEAD * self._tick_ns:
            return None
        after = bisect_left(stamps, stamp_ns)
        if after == len(stamps) or (after > 0 and stamp_ns - stamps[after - 1] <= stamps[after] - stamp_ns):
            after -= 1
        return len(stamps) - 1 - after

    def nearest_slot(self, stamp_ns: int) -> int:
        """Slot of the tick nearest to a stamp; outside the remembered time of the newest or the oldest one."""
        age = self.age(stamp_ns)
        if age is None:
            newest = not self._stamps or stamp_ns > self._stamps[-1]
            age = 0 if newest else len(self._stamps) - 1
        return self.slot(age)

    def slots_since(self, stamp_ns: int) -> np.ndarray:
        """Slots of the tick nearest to a stamp and of every later one, oldest first, (age + 1,)."""
        return np.arange(self.now - (self.age(stamp_ns) or 0), self.now + 1) % HISTORY


def sample_interval(stamp_ns: int, last_ns: int) -> float:
    """Time since the last force sample [s], bounded; ``last_ns`` is -1 before the first one."""
    return FIRST_INTERVAL if last_ns < 0 else min((stamp_ns - last_ns) * 1e-9, LONGEST_INTERVAL)
