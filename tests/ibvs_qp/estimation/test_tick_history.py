"""Remembered ticks: found by their time, whatever their lengths, and changed along the chain of a filter."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.estimation.tick_history import HISTORY_S, TickHistory

TICK_S, TICK_NS = 0.004, 4_000_000
COUNT = round(HISTORY_S / TICK_S)
CHAIN = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])  # distance, speed, bias


def test_a_stamp_finds_the_nearest_tick_whatever_the_ticks_lengths() -> None:
    rng, history = np.random.default_rng(0), TickHistory([-1.0], TICK_S)
    assert history.find(0) is None and history.at(0) == -1.0
    stamps: list[int] = []
    for tick in range(3 * COUNT):
        gap = int(rng.choice([TICK_NS // 4, TICK_NS, 3 * TICK_NS, 40 * TICK_NS], p=[0.7, 0.2, 0.08, 0.02]))
        stamps.append((stamps[-1] if stamps else 0) + gap + int(rng.integers(-500_000, 500_000)))
        history.add(stamps[-1], np.array([float(tick)]), TICK_S)
    kept = np.array(stamps[-COUNT:])
    for wanted in rng.integers(kept[0], kept[-1], 200):
        place = history.find(int(wanted))
        assert place is not None
        found = stamps[int(history.rows[place, 0])]
        assert abs(found - wanted) == np.abs(kept - wanted).min()
    for outside, nearest in ((int(kept[0]) - TICK_NS, 2 * COUNT), (stamps[-1] + 2 * TICK_NS, 3 * COUNT - 1)):
        assert history.find(outside) is None and history.at(outside) == nearest


def test_a_change_of_a_past_tick_equals_the_replay_of_every_input() -> None:
    """Over uneven ticks, as frames dropped on the way."""
    rng = np.random.default_rng(1)
    lengths, inputs, change = (
        TICK_S * rng.choice([1, 1, 1, 2, 5], 60),
        rng.normal(0.0, 0.01, (60, 3)),
        rng.normal(0, 1, 3),
    )

    def run(changed_at: int) -> np.ndarray:
        """Rows after the change of tick 40 at a later tick."""
        history = TickHistory(np.zeros(3), TICK_S)
        for tick, dt in enumerate(lengths):
            history.add(tick * TICK_NS, history.newest + dt * (CHAIN @ history.newest) + inputs[tick], dt)
            if tick == changed_at:
                place = history.find(40 * TICK_NS)
                assert place is not None
                for part in (0.5, 0.5):
                    history.change(place, part * np.array((change, CHAIN @ change, CHAIN @ CHAIN @ change)))
        return history.rows[1:61].copy()

    np.testing.assert_allclose(run(55), run(40), atol=1e-12)
    np.testing.assert_array_equal(run(55)[:40], run(40)[:40])


@pytest.mark.parametrize("tick_s", [0.002, 0.004, 0.02])
def test_the_remembered_time_is_one_of_seconds(tick_s: float) -> None:
    history = TickHistory([0.0], tick_s)
    ticks = round(2.0 / tick_s)
    for tick in range(ticks):
        history.add(round(1e9 * tick * tick_s), np.zeros(1), tick_s)
    now = round(1e9 * (ticks - 1) * tick_s)
    assert history.find(now - round(1e9 * (HISTORY_S - 1.5 * tick_s))) is not None
    assert history.find(now - round(1e9 * (HISTORY_S + tick_s))) is None
