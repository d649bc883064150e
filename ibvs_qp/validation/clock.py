"""Time stamps: a monotonic time from a stream of stamps whose clock may stop, leap or be set back."""

from __future__ import annotations

from typing import Any

import numpy as np

#: Largest step from the last stamp that is accepted at once [ns].
LEAP_NS = 1_000_000_000
#: Consecutive stamps that must agree before a clock that was set back is followed.
RESTART_STAMPS = 25
#: Stamps end here: 63 bits hold the sum of two.
STAMP_END = 2**62


def is_stamp(value: Any) -> bool:
    """Whether a value is a time stamp: a whole number of nanoseconds below `STAMP_END`."""
    if type(value) is not int and (not isinstance(value, (int, np.integer)) or isinstance(value, bool)):
        return False
    return bool(0 <= value < STAMP_END)


class MonotonicClock:
    """Maps stamps to a time that only increases.

    A stamp that leaps is refused, and so are the following ones until they agree with each other: two stamps ahead,
    `RESTART_STAMPS` behind. A clock that was set back is then followed by a shift, so earlier times stay valid.

    Attributes:
        shift_ns: Added to a stamp to obtain the time.
        last_ns: Time of the last accepted stamp, -1 before the first.
        restarted: Whether the last accepted stamp began a new time base, behind the old one.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """As before the first stamp."""
        self.shift_ns, self.last_ns, self.restarted = 0, -1, False
        self._odd_first = self._odd_last = -1
        self._odd_count = 0

    def accept(self, stamp: Any) -> str:
        """Advance to a stamp.

        Returns:
            Why the stamp is refused; empty if it was accepted, and then `last_ns` is its time.
        """
        if not is_stamp(stamp):
            return "not a whole number of nanoseconds"
        stamp = int(stamp)
        time = stamp + self.shift_ns
        if self.last_ns < 0 or 0 < time - self.last_ns <= LEAP_NS:
            self.last_ns, self._odd_count, self.restarted = time, 0, False
            return ""
        ahead = time > self.last_ns
        follows = self._odd_count > 0 and 0 < stamp - self._odd_last <= LEAP_NS
        if not follows:
            self._odd_first, self._odd_count = stamp, 0
        step = stamp - self._odd_last
        self._odd_last, self._odd_count = stamp, self._odd_count + 1
        if not follows or not (ahead or self._odd_count >= RESTART_STAMPS):
            return "far ahead of the last one" if ahead else "not after the last one"
        self._odd_count, self.restarted = 0, not ahead
        # The refused stamps behind count as time that passed, each with its own step.
        self.last_ns = time if ahead else self.last_ns + stamp - self._odd_first + step
        self.shift_ns = self.last_ns - stamp
        return ""
