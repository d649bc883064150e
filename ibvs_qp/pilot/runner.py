"""A loop at a fixed rate, for those who have none."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.errors import out_of_range

#: Ticks whose durations are kept: 100 s at 250 Hz.
_KEPT = 25_000
#: Range of the rate [Hz]: that of the controller's tick.
_RATES = (50.0, 2000.0)


@dataclass(frozen=True, kw_only=True)
class Timing:
    """How a loop kept its rate.

    Attributes:
        ticks: Ticks so far.
        overruns: Ticks that ended after the next one was due; those due meanwhile are left out, not made up for.
        left_out: Ticks left out.
        p50_us: Median duration of a tick [us], over the last 25,000.
        p99_us: Its 99th percentile [us].
        max_us: Its largest value [us].
    """

    ticks: int
    overruns: int
    left_out: int
    p50_us: float
    p99_us: float
    max_us: float


def run(
    tick: Callable[[int], bool],
    rate_hz: float = 250.0,
    *,
    clock: Callable[[], int] = time.monotonic_ns,
    sleep: Callable[[float], None] = time.sleep,
) -> Timing:
    """Call a function at a fixed rate until it returns False.

    Deadlines lie on a fixed grid, so that late ticks do not shift those after them.

    Args:
        tick: Senses, steps the pilot and drives the rotors; gets the time of the clock [ns].
        rate_hz: Ticks per second [Hz].
        clock: Monotonic time [ns].
        sleep: Waits for a time [s].

    Returns:
        The timing.

    Raises:
        ConfigError: When the rate is out of range.
    """
    if not _RATES[0] <= rate_hz <= _RATES[1]:
        raise out_of_range("rate_hz", rate_hz, "Hz", f"allowed is {_RATES[0]:g} to {_RATES[1]:g} Hz")
    period, durations = round(1e9 / rate_hz), deque[int](maxlen=_KEPT)
    ticks = overruns = left_out = 0
    due = clock()
    going = True
    while going:
        begin = clock()
        going = tick(begin)
        end = clock()
        durations.append(end - begin)
        ticks, due = ticks + 1, due + period
        if end > due:
            missed = (end - due) // period
            overruns, left_out, due = overruns + 1, left_out + missed, due + missed * period
        else:
            sleep((due - end) * 1e-9)
    us = np.array(durations) * 1e-3
    p50, p99 = (float(value) for value in np.percentile(us, (50, 99)))
    return Timing(ticks=ticks, overruns=overruns, left_out=left_out, p50_us=p50, p99_us=p99, max_us=float(us.max()))
