"""A force sensor that drifts by 7 N within a job, in gusts: the vehicle leaves the wall all the same."""

from __future__ import annotations

import dataclasses

import pytest

from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.world.scene import Scene
from sim.world.worlds import in_world


@pytest.mark.slow
@pytest.mark.parametrize("seed", [13, 16])
def test_a_vehicle_with_a_drifted_force_sensor_leaves_the_wall(seed: int) -> None:
    """Without contact a measured pull of 5 N counted as one, and the rotors held the brush at the wall against it."""
    scene = in_world(Scene(), "harsh")
    sensor = dataclasses.replace(scene.errors.force_torque, drift_n_min=9.0)
    scene = dataclasses.replace(scene, errors=dataclasses.replace(scene.errors, force_torque=sensor))
    trace = fly(scene, FlightOptions(seed=seed, law="qp", features="geometric", video=False))
    assert trace.claimed and trace.push_true[-1] == 0.0, trace.events[-1]
