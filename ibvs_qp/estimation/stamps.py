"""Which remembered tick a late measurement belongs to: found by time, not by counting nominal ticks."""

from __future__ import annotations

#: Ticks of history kept; at 250 Hz half a second, far beyond any camera's latency.
HISTORY = 128


class StampRing:
    """Stamps of the last `HISTORY` ticks; slots of a ring in which others keep what they remember of them.

    Attributes:
        now: Number of ticks remembered so far; the newest lies in slot ``now % HISTORY``.

    Args:
        tick_s: Nominal control period [s]: where the search begins, and how far ahead of the newest a stamp may lie.
    """

    def __init__(self, tick_s: float) -> None:
        self._tick_ns = max(1, round(tick_s * 1e9))
        self.reset()

    def reset(self) -> None:
        """Forget every tick."""
        self._stamps = [-1] * HISTORY
        self.now = 0
        self._newest = -1
        self._asked: tuple[int, int] | None = None  # the last question, its answer in `_answer`
        self._answer: int | None = None

    def add(self, stamp_ns: int) -> int:
        """Remember one more tick; returns its slot."""
        self.now += 1
        slot = self.now % HISTORY
        self._stamps[slot] = self._newest = stamp_ns
        return slot

    def slot(self, age: int) -> int:
        """Slot of the tick so many ticks ago."""
        return (self.now - age) % HISTORY

    def age(self, stamp_ns: int) -> int | None:
        """How many ticks ago the tick nearest to a stamp was; None where none is remembered so far back or ahead."""
        question = stamp_ns, self.now  # everything in a picture asks the same
        if question != self._asked:
            self._asked, self._answer = question, self._find(stamp_ns)
        return self._answer

    def _find(self, stamp_ns: int) -> int | None:
        stamps, now, newest, tick = self._stamps, self.now, self._newest, self._tick_ns
        filled = min(HISTORY, now)
        if not filled or newest - stamp_ns < -1.5 * tick:
            return None
        age = min(max(round((newest - stamp_ns) / tick), 0), filled - 1)
        here = abs(stamps[(now - age) % HISTORY] - stamp_ns)
        # On a regular clock the first guess is the nearest; otherwise walk there, the stamps only ever grow.
        while age + 1 < filled and (there := abs(stamps[(now - age - 1) % HISTORY] - stamp_ns)) < here:
            age, here = age + 1, there
        while age > 0 and (there := abs(stamps[(now - age + 1) % HISTORY] - stamp_ns)) < here:
            age, here = age - 1, there
        # Before the oldest tick there is nothing; half a tick is rounding.
        return None if age == filled - 1 and stamp_ns < stamps[(now - age) % HISTORY] - 0.5 * tick else age
