"""Time of a stream of frames that never runs backwards, whatever the clock behind their stamps does."""

from __future__ import annotations

from typing import Any

from ibvs_qp.validation.measurement import LEAP_NS, RESTART_STAMPS, STAMP_END, is_stamp


class StampFollower:
    """Maps stamps to a time of one's own that only ever runs on.

    One stamp that leaps blinds nobody: it is refused, and so are the next until they agree with each other (two ahead,
    `RESTART_STAMPS` behind). A clock that was set back is then followed by a shift, so that all who remember earlier
    times go on with theirs.

    Attributes:
        shift_ns: Added to a stamp to give the time of one's own.
        last_ns: The last time accepted, -1 before the first.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """As before the first stamp."""
        self.shift_ns, self.last_ns = 0, -1
        self._odd_first = self._odd_last = -1
        self._odd_count = 0

    def goes_on(self, stamp: Any) -> bool:
        """Whether a stamp surely follows the last one and is accepted; where it is not sure, `refuse` finds out."""
        if type(stamp) is not int or stamp >= STAMP_END or self._odd_count or self.last_ns < 0:
            return False
        time = stamp + self.shift_ns
        if not (stamp >= 0 and 0 < time - self.last_ns <= LEAP_NS):
            return False
        self.last_ns = time
        return True

    def refuse(self, stamp: Any) -> str:
        """Why a stamp is refused; empty if it is not, and then `last_ns` is its time."""
        if not is_stamp(stamp):
            return "not a whole number of nanoseconds"
        time = int(stamp) + self.shift_ns
        if self.last_ns < 0 or 0 < time - self.last_ns <= LEAP_NS:
            self.last_ns, self._odd_count = time, 0
            return ""
        follows = self._odd_count > 0 and 0 < stamp - self._odd_last <= LEAP_NS
        step = int(stamp) - self._odd_last if follows else 0
        self._odd_first = self._odd_first if follows else int(stamp)
        self._odd_last, self._odd_count = int(stamp), self._odd_count + 1 if follows else 1
        ahead = time > self.last_ns
        if not follows or not (ahead or self._odd_count >= RESTART_STAMPS):
            return "far ahead of the last one" if ahead else "not after the last one"
        self._odd_count = 0
        if not ahead:
            self.last_ns += int(stamp) - self._odd_first + step
            self.shift_ns = self.last_ns - int(stamp)
        else:
            self.last_ns = time
        return ""
