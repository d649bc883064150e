"""The loop at a fixed rate, on a clock of its own."""

from __future__ import annotations

import pytest

from ibvs_qp import ConfigError
from ibvs_qp.pilot.runner import run

MS = 1_000_000


class Computer:
    """Time that passes only while it computes or sleeps."""

    def __init__(self, durations_ms: dict[int, float]) -> None:
        self.now, self._durations, self.begun = 0, durations_ms, list[int]()

    def clock(self) -> int:
        return self.now

    def sleep(self, seconds: float) -> None:
        assert seconds >= 0.0
        self.now += round(1e9 * seconds)

    def tick(self, stamp_ns: int) -> bool:
        assert stamp_ns == self.now
        self.begun.append(stamp_ns // MS)
        self.now += round(MS * self._durations.get(len(self.begun), 1.0))
        return len(self.begun) < 10


def test_ticks_lie_on_a_grid_whatever_they_take() -> None:
    computer = Computer({3: 2.5, 5: 3.9})
    timing = run(computer.tick, 250.0, clock=computer.clock, sleep=computer.sleep)
    assert computer.begun == [4 * number for number in range(10)]
    assert (timing.ticks, timing.overruns, timing.left_out) == (10, 0, 0)
    assert timing.p50_us == 1000.0 and timing.max_us == 3900.0


def test_a_late_tick_is_counted_and_those_meanwhile_are_left_out() -> None:
    computer = Computer({3: 9.0})
    timing = run(computer.tick, 250.0, clock=computer.clock, sleep=computer.sleep)
    # Tick 3 begins at 8 ms and ends at 17 ms: the one due at 12 ms begins at once, the one due at 16 ms is left out.
    assert computer.begun[2:6] == [8, 17, 20, 24]
    assert (timing.overruns, timing.left_out) == (1, 1)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), 1e6])
def test_a_rate_out_of_range_is_refused(rate: float) -> None:
    with pytest.raises(ConfigError, match=r"rate_hz .* Hz"):
        run(lambda _: False, rate)
