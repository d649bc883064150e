"""Columns flown from pictures, from a corner whose edges the arm and the wall around the board make hard to see."""

from __future__ import annotations

import pytest

from sim.evaluate.metrics import compute_metrics
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.world.scene import BoardScene, PaintScene, Scene
from sim.world.worlds import in_world


@pytest.mark.slow
@pytest.mark.parametrize(("start", "seed"), [("top-right", 2), ("top-right", 1)])
def test_columns_flown_from_pictures_are_at_their_places(start: str, seed: int) -> None:
    """Seed 2 took the wall for the board; seed 1 laid column 4 7 mm aside, by an edge that left the picture."""
    scene = Scene(
        board=BoardScene(width_m=0.488, height_m=0.5),
        paint=PaintScene(rows=4, stroke_m=0.4, pattern="columns", start=start),
    )
    trace = fly(in_world(scene, "datasheet"), FlightOptions(seed=seed, features="rendered", law="qp", video=False))
    figures = compute_metrics(trace)
    assert figures["not_completed"] is None and trace.claimed, (figures["not_completed"], trace.reason)
