"""A camera beside the arm's plane: both laws hold the tip, not the image's centre, at its place."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from ibvs_qp.pilot import PilotConfig
from sim.evaluate.metrics import compute_metrics
from sim.experiments.scenes import near_wall
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.vehicles.configuration import with_vehicle

#: The camera is so far to the right of the arm [m]; the error of a start mark that ignores it is as large.
BESIDE_M = 0.03


@pytest.mark.slow
@pytest.mark.parametrize("law", ["qp", "paper"])
def test_a_row_begins_at_its_place(law: str) -> None:
    config = PilotConfig(law=law)
    vehicle = dataclasses.replace(config.controller.vehicle, camera_position_m=(0.20, BESIDE_M, 0.08))
    scene = near_wall(board={"width_m": 0.5}, paint={"rows": 1, "stroke_m": 0.4})
    trace = fly(scene, FlightOptions(law=law, features="geometric", video=False), config=with_vehicle(config, vehicle))
    assert compute_metrics(trace)["completed"], trace.reason
    painting = np.flatnonzero(trace.phase == trace.phases.index("paint"))
    right_end = scene.board.width_m - scene.paint.edge_margin_m
    assert abs(trace.tip[painting[0], 1] - right_end) < 0.4 * BESIDE_M
