"""Snapshots in every phase of a flown job: a new pilot continues each with the same commands bit by bit."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from ibvs_qp.pilot import Pilot
from sim.experiments.scenes import short_job
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World

TICKS = 300
PHASES = ("approach", "align", "press", "paint", "climb", "retreat")


@pytest.mark.slow
def test_every_phase_of_a_job_continues_in_a_new_pilot() -> None:
    scene, options = short_job(0.3, rows=2), FlightOptions(features="geometric", video=False)
    config = pilot_config(scene, options)
    pilot, world, frames, thrusts, states = Pilot(config), World(scene, options, config), [], [], {}
    phase, taken = "", {}
    while not pilot.painter.finished and len(frames) < 20_000:
        if pilot.painter.phase != phase and len(frames) - max(taken.values(), default=-TICKS) >= 20:
            phase = pilot.painter.phase
            if phase not in taken:
                states[phase], taken[phase] = pickle.dumps(pilot.state()), len(frames)
        frames.append(world.sense())
        thrusts.append(pilot.step(frames[-1]).thrusts.copy())
        world.act(thrusts[-1])
    world.close()
    assert set(PHASES) <= set(states), f"{taken}, {pilot.painter.reason}"
    other = Pilot(config)
    for phase, state in states.items():
        begin = taken[phase]
        other.restore(pickle.loads(state))
        for tick in range(begin, min(begin + TICKS, len(frames))):
            if tick in taken.values() and tick > begin:
                other.state()  # the solver sets up anew, as in the first one
            np.testing.assert_array_equal(other.step(frames[tick]).thrusts, thrusts[tick], err_msg=f"{phase} {tick}")
