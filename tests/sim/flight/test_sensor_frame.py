"""Broken raw sensors: the pilot flies on, names them, and nothing stays in a filter."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from closed_loop_rigs import short_scene

from ibvs_qp.pilot import Pilot
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World

NAN3, NAN6 = np.full(3, np.nan), np.full(6, np.nan)


@pytest.mark.slow
@pytest.mark.parametrize(
    "broken",
    [
        {"angular_velocity": NAN3},
        {"specific_force": np.full(3, np.inf)},
        {"wrench": NAN6},
        {"wrench": None},
        {"attitude": np.zeros(4)},
        {"angular_velocity": np.full(3, 1e300)},
        {"image": "no picture"},
        {"wrench_stamp_ns": 10**18},
    ],
)
def test_one_broken_tick_changes_little_and_leaves_nothing_behind(broken: dict[str, Any]) -> None:
    scene = short_scene(stroke_m=0.2, rows=1)
    options = FlightOptions(features="geometric", video=False)
    config = pilot_config(scene, options)
    pilot, clean, world = Pilot(config), Pilot(config), World(scene, options, config)
    for tick in range(400):
        frame = world.sense()
        expected = clean.step(frame)
        given = dataclasses.replace(frame, **broken) if tick == 200 else frame
        command = pilot.step(given)
        assert np.isfinite(command.thrusts).all()
        assert (command.thrusts >= 1.2 - 1e-9).all() and (command.thrusts <= 52.56 + 1e-9).all()
        assert bool(command.rejected) == (tick == 200)
        world.act(expected.thrusts)
    assert np.abs(command.thrusts - expected.thrusts).max() < 0.3


@pytest.mark.parametrize("frame", [None, 7, "frame"])
def test_what_is_no_frame_is_answered(frame: Any) -> None:
    command = Pilot().step(frame)
    assert np.isfinite(command.thrusts).all() and command.rejected


def test_time_that_stands_still_is_named_and_the_next_tick_flies() -> None:
    scene = short_scene(stroke_m=0.2, rows=1)
    options = FlightOptions(features="geometric", video=False)
    config = pilot_config(scene, options)
    pilot, world = Pilot(config), World(scene, options, config)
    for _ in range(50):
        frame = world.sense()
        world.act(pilot.step(frame).thrusts)
    again = pilot.step(frame)
    assert any("stamp_ns" in name for name in again.rejected)
    assert not pilot.step(world.sense()).rejected
