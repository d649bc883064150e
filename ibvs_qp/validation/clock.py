"""Time stamps: a monotonic time without jumps from a stream of stamps whose clock may stop, jump or be set back.

The one rule of pilot and controllers. A sample may be stamped up to `LEAD_NS` ahead of its tick, because two clocks
never agree exactly; farther ahead it is refused.
"""

from __future__ import annotations

import dataclasses
from typing import Any

from ibvs_qp.command import Command
from ibvs_qp.validation.numbers import whole

#: Largest step from the last stamp that is accepted at once [ns]: a longer one is a jump.
JUMP_NS = 1_000_000_000
#: Stamps behind must agree for this long, and so many of them, before the clock counts as set back [ns]: a queue of
#: late samples is shorter.
RESTART_NS, RESTART_STAMPS = 96_000_000, 5
#: Stamps end here: 63 bits hold the sum of two.
STAMP_END = 2**62
#: Largest lead of a sample's stamp over the tick's [ns].
LEAD_NS = 20_000_000
#: Reason of a sample's stamp that is refused.
NO_PAST_TIME = f"not a time in nanoseconds at most {LEAD_NS / 1e6:g} ms after the tick"


def stamp_of(value: Any) -> int | None:
    """A whole number of nanoseconds from 0 to `STAMP_END` as a plain integer; None for anything else."""
    return whole(value, 0, STAMP_END - 1)


class MonotonicClock:
    """Maps stamps to a time that only increases, without the jumps of the clock.

    A stamp that jumps is refused, and so are the following ones until they agree with each other: two stamps ahead;
    stamps behind for `RESTART_NS`. The clock is then followed by a shift, and the refused stamps count as time that
    passed, each with its own step. Everything remembered in this time therefore keeps its age.

    Attributes:
        shift_ns: Added to a stamp to obtain the time.
        last_ns: Time of the last accepted stamp, -1 before the first.
        jumps: Jumps so far. A jump of the clock and a stall of the loop look the same.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """As before the first stamp."""
        self.shift_ns, self.last_ns, self.jumps = 0, -1, 0
        self._odd_first = self._odd_last = -1
        self._odd_count = 0

    def accept(self, stamp: Any) -> str:
        """Advance to a stamp.

        Returns:
            Why the stamp is refused; empty if it was accepted, and then `last_ns` is its time.
        """
        stamp = stamp_of(stamp)
        if stamp is None:
            return f"not a whole number of nanoseconds from 0 to {STAMP_END:.2g}"
        if self.last_ns < 0:  # a false first stamp near the end would leave no room for the time after it
            self.shift_ns = -stamp if stamp >= STAMP_END // 2 else 0
        time = stamp + self.shift_ns
        if self.last_ns < 0 or 0 < time - self.last_ns <= JUMP_NS:
            self.last_ns, self._odd_count = time, 0
            return ""
        ahead = time > self.last_ns
        if self._odd_count > 0 and stamp == self._odd_last:
            return "the same as the last one"
        follows = self._odd_count > 0 and 0 < stamp - self._odd_last <= JUMP_NS
        if not follows:
            self._odd_first, self._odd_count = stamp, 0
        step, passed = stamp - self._odd_last, stamp - self._odd_first
        self._odd_last, self._odd_count = stamp, self._odd_count + 1
        if not follows or not (ahead or (passed >= RESTART_NS and self._odd_count >= RESTART_STAMPS)):
            return "far ahead of the last one" if ahead else "not after the last one"
        self._odd_count, self.jumps = 0, self.jumps + 1
        self.last_ns += passed + step
        self.shift_ns = self.last_ns - stamp
        return ""

    def follow(self, time: int) -> bool:
        """Advance to a time of another such clock; False where that is no plain next step."""
        step = time - self.last_ns
        if self.shift_ns or self.last_ns < 0 or not 0 < step <= JUMP_NS:
            return False
        self.last_ns, self._odd_count = time, 0
        return True

    def sample_time(self, stamp: Any) -> int | None:
        """Time of a sample of the tick accepted last; None for an invalid stamp or one too far ahead of the tick."""
        stamp = stamp_of(stamp)
        if stamp is None:
            return None
        time = stamp + self.shift_ns if self.shift_ns else stamp  # the same object, where nothing changes
        return time if time <= self.last_ns + LEAD_NS else None

    def answered(self, command: Command) -> Command:
        """The command in the time of the stamps instead of this clock's."""
        if not self.shift_ns:
            return command
        return dataclasses.replace(command, stamp_ns=command.stamp_ns - self.shift_ns)
