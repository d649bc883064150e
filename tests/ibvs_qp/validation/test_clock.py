"""Stamps of clocks that are set back, leap or stumble: time only increases."""

from __future__ import annotations

from ibvs_qp.validation.clock import MonotonicClock

TICK_NS = 4_000_000


def test_time_increases_over_every_set_back() -> None:
    clock, last, accepted = MonotonicClock(), -1, 0
    for stamp in [k * TICK_NS for k in (*range(1000, 1100), *range(10, 110), *range(5, 105))]:
        if not clock.accept(stamp):
            assert clock.last_ns > last
            assert clock.restarted == (accepted in (100, 176))
            accepted, last = accepted + 1, clock.last_ns
    assert accepted == 300 - 2 * 24
    assert clock.last_ns == (1099 + 200) * TICK_NS, "the refused ticks count as time"
    for odd in (None, 1.5, -3, "now", 2**70, True):
        assert clock.accept(odd) == "not a whole number of nanoseconds"


def test_a_leap_ahead_is_accepted_at_the_second_stamp_that_agrees() -> None:
    clock, leap = MonotonicClock(), 10**11
    for stamp in (TICK_NS, 2 * TICK_NS):
        assert clock.accept(stamp) == ""
    assert clock.accept(leap) == "far ahead of the last one"
    assert clock.accept(3 * TICK_NS) == "", "the old clock goes on"
    assert clock.accept(2 * leap) and clock.accept(leap), "two leaps that disagree"
    assert clock.accept(leap + TICK_NS) == ""
    assert (clock.last_ns, clock.shift_ns, clock.restarted) == (leap + TICK_NS, 0, False)
