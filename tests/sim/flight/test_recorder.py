"""The recorder when Ctrl-C strikes in the middle of a tick."""

from __future__ import annotations

import numpy as np
import pytest

from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.columns import Columns
from sim.flight.options import FlightOptions
from sim.world.scene import Scene


@pytest.mark.parametrize("entry", [500, 501])
def test_a_half_written_tick_is_dropped(monkeypatch: pytest.MonkeyPatch, entry: int) -> None:
    """Once between the log's row and the program's, once before the log's row was there."""
    add, count = Columns.add, 0

    def interrupted(self: Columns, *parts: np.ndarray):
        nonlocal count
        count += 1
        if count == entry:
            raise KeyboardInterrupt
        return add(self, *parts)

    monkeypatch.setattr(Columns, "add", interrupted)
    trace = fly(Scene(), FlightOptions(features="geometric", video=False))
    assert trace.reason == "interrupted"
    assert {len(trace.t), len(trace.tip), len(trace.active), len(trace.contact_1khz) // 4} == {len(trace.t)}
    assert compute_metrics(trace)["completed"] is False
