"""Stamps of clocks that are set back, leap or stumble: time only increases, and no leap counts."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

from ibvs_qp.validation.clock import LEAD_NS, MonotonicClock

TICK_NS = 4_000_000
SECOND = 1_000_000_000


def accepted(clock: MonotonicClock, stamps: Iterable[int]) -> list[int]:
    """Places of the accepted stamps; time increases with every one."""
    places, last = [], clock.last_ns
    for place, stamp in enumerate(stamps):
        if not clock.accept(stamp):
            assert clock.last_ns > last
            places.append(place)
            last = clock.last_ns
    return places


def ticks(first: int, count: int, step: int = TICK_NS) -> range:
    return range(first, first + count * step, step)


def test_time_increases_over_every_set_back() -> None:
    clock = MonotonicClock()
    first, second, third = (ticks(tick * TICK_NS, 100) for tick in (1000, 10, 5))
    assert accepted(clock, (*first, *second, *third)) == [*range(100), *range(124, 200), *range(224, 300)]
    assert clock.last_ns == (1099 + 200) * TICK_NS, "the refused ticks count as time"


@pytest.mark.parametrize("odd", [None, 1.5, -3, "now", 2**62, 2**70, True, np.bool_(1), np.array(5), np.float64(5.0)])
def test_what_is_no_stamp(odd: object) -> None:
    clock = MonotonicClock()
    assert clock.accept(odd).startswith("not a whole number of nanoseconds")
    assert clock.sample_time(odd) is None


@pytest.mark.parametrize("kind", [np.int8, np.uint8, np.int32, np.uint32, np.int64, np.uint64, int])
def test_every_whole_number_is_a_stamp_and_becomes_a_plain_one(kind: type) -> None:
    clock = MonotonicClock()
    assert clock.accept(kind(5)) == "" and clock.accept(kind(7)) == ""
    assert clock.last_ns == 7 and type(clock.last_ns) is int
    assert type(clock.sample_time(kind(6))) is int


@pytest.mark.parametrize("leap", [2 * SECOND, 3600 * SECOND, 10**17, 2**62 - 2 * SECOND])
def test_a_leap_ahead_is_followed_at_the_second_stamp_and_is_no_time_that_passed(leap: int) -> None:
    clock = MonotonicClock()
    for stamp in (TICK_NS, 2 * TICK_NS):
        assert clock.accept(stamp) == ""
    assert clock.accept(leap) == "far ahead of the last one"
    assert clock.accept(3 * TICK_NS) == "", "the old clock goes on"
    assert clock.accept(leap - 2 * SECOND) and clock.accept(leap), "two leaps that disagree"
    assert clock.accept(leap + TICK_NS) == ""
    assert clock.last_ns == 3 * TICK_NS + 2 * TICK_NS
    assert clock.sample_time(leap) == clock.last_ns - TICK_NS, "samples keep their age"


@pytest.mark.parametrize("step", [TICK_NS // 4, TICK_NS, 20_000_000])
@pytest.mark.parametrize("first", [SECOND, 2**62 - 10 * SECOND])
@pytest.mark.parametrize("odd", [[2**62 - 9, 2**62 - 5], [5, 9], [2**61 + 5] * 3, [2**62 - 9, 2**62 - 5, 3, 4, 2**40]])
def test_after_whatever_stamps_good_ones_are_accepted_within_a_fifth_of_a_second(
    odd: list[int], first: int, step: int
) -> None:
    clock = MonotonicClock()
    accepted(clock, odd)
    for begin in (first, first + SECOND):
        good = ticks(begin, SECOND // 2 // step, step)
        places = accepted(clock, good)
        assert places[0] * step <= 0.2 * SECOND
        assert places == list(range(places[0], len(good)))
        accepted(clock, odd)
    assert clock.last_ns < 2**62


def test_a_stamp_that_repeats_does_not_delay_the_recovery() -> None:
    clock = MonotonicClock()
    accepted(clock, ticks(400 * SECOND, 10))
    repeated = [stamp for stamp in ticks(SECOND, 60) for _ in range(2)]
    assert accepted(clock, repeated) == list(range(48, 120, 2))


def test_late_stamps_from_a_queue_do_not_set_the_clock_back() -> None:
    clock = MonotonicClock()
    accepted(clock, ticks(SECOND, 100))
    assert accepted(clock, ticks(SECOND // 2, 20)) == []
    assert clock.accept(SECOND + 100 * TICK_NS) == "" and clock.shift_ns == 0


def test_a_sample_may_lead_its_tick_a_little() -> None:
    clock = MonotonicClock()
    clock.accept(SECOND)
    assert clock.sample_time(SECOND + LEAD_NS) == SECOND + LEAD_NS
    assert clock.sample_time(SECOND + LEAD_NS + 1) is None
