"""Sample times of a sensor in integer nanoseconds."""

from __future__ import annotations

NS = 1_000_000_000


class SampleClock:
    """Sample times of a sensor; integer nanoseconds, so that no rounding drifts.

    A sample falls on the first control tick at or after its time; a sensor faster than the ticks samples on each.

    Attributes:
        next_ns: Time of the next sample [ns].
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate = rate_hz
        self._count = self.next_ns = 0

    def due(self, now_ns: int) -> bool:
        """Whether a sample is due at this tick."""
        if now_ns < self.next_ns:
            return False
        while self.next_ns <= now_ns:
            self._count += 1
            self.next_ns = round(self._count * NS / self._rate)
        return True
