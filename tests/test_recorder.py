"""The recorder when Ctrl-C strikes in the middle of a tick."""

from __future__ import annotations

import pytest

from sim.closed_loop import FlightOptions, fly
from sim.metrics import compute_metrics
from sim.recorder import Recorder
from sim.scene import Scene


@pytest.mark.parametrize("entry", [500, 507])
def test_a_half_written_tick_is_dropped(monkeypatch, entry):
    add, count = Recorder._add, 0

    def interrupted(self, name, value):
        nonlocal count
        count += 1
        if count == entry:
            raise KeyboardInterrupt
        add(self, name, value)

    monkeypatch.setattr(Recorder, "_add", interrupted)
    trace = fly(Scene(), FlightOptions(features="geometric", video=False))
    assert trace.reason == "interrupted"
    assert {len(trace.t), len(trace.tip), len(trace.active), len(trace.contact_1khz) // 4} == {len(trace.t)}
    assert compute_metrics(trace)["completed"] is False
