"""Twice the errors of an ordinary vehicle, white vibration included: the job is done, the push stays bounded."""

from __future__ import annotations

import pytest

from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.world.scene import Scene
from sim.world.worlds import in_world

WORLD = "twice_harsh"


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_twice_harsh(seed: int) -> None:
    trace = fly(in_world(Scene(), WORLD), FlightOptions(seed=seed, features="geometric", law="qp", video=False))
    figures = compute_metrics(trace)
    assert figures["not_completed"] is None, (figures["not_completed"], trace.reason)
    assert figures["push_peak_ratio"] < 2.5
