"""Clocks that are set back, leap or stumble: the pilot's own time runs on, and late pictures find their tick."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from closed_loop_rigs import short_scene

from ibvs_qp.command import Outcome
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World

TICK_NS = 4_000_000
SECOND = 1_000_000_000


def moved(frame: SensorFrame, by_ns: int) -> SensorFrame:
    """The frame on a clock that differs."""
    changes: dict[str, Any] = {"stamp_ns": frame.stamp_ns + by_ns, "wrench_stamp_ns": frame.wrench_stamp_ns + by_ns}
    seen = frame.features
    if seen is not None:
        later = {"stamp_ns": seen.stamp_ns + by_ns, "velocity_stamp_ns": seen.velocity_stamp_ns + by_ns}
        changes["features"] = dataclasses.replace(seen, **later)
    return dataclasses.replace(frame, **changes)


def test_a_clock_set_back_is_followed_and_nothing_is_forgotten() -> None:
    """A tenth of a second of holding, then lines, wall and phase go on; commands answer in the frames' own time."""
    scene = short_scene(stroke_m=0.2, rows=1)
    options = FlightOptions(features="geometric", video=False)
    config = pilot_config(scene, options)
    pilot, world = Pilot(config), World(scene, options, config)
    outcomes, clock = [], 60 * SECOND
    for _ in range(300):
        world.act(pilot.step(moved(world.sense(), clock)).thrusts)
    known, begun = set(pilot.motion.lines), world.plant.position
    assert pilot.painter.phase == "approach" and known
    clock = 5 * SECOND
    for _ in range(120):
        frame = moved(world.sense(), clock)
        command = pilot.step(frame)
        outcomes.append(command.outcome)
        if command.outcome is Outcome.SOLVED:
            assert command.stamp_ns == frame.stamp_ns and not command.rejected
        world.act(command.thrusts)
    assert set(outcomes[:24]) == {Outcome.HOLD} and set(outcomes[26:]) == {Outcome.SOLVED}
    assert pilot.painter.phase in ("approach", "align")
    assert known <= set(pilot.motion.lines), "the same lines as before"
    assert np.linalg.norm(world.plant.position - begun) < 0.2
    newest = max(line.seen_ns for line in pilot.motion.lines.values())
    assert pilot.measurement is not None
    assert 0 <= pilot.measurement.stamp_ns - newest < 0.12 * SECOND, "pictures are taken in again"


@pytest.mark.parametrize("law", ["qp", "paper"])
def test_one_stamp_far_ahead_blinds_nobody(law: str) -> None:
    scene = short_scene(stroke_m=0.2, rows=1)
    options = FlightOptions(law=law, features="geometric", video=False)
    config = pilot_config(scene, options)
    pilot, world = Pilot(config), World(scene, options, config)
    for tick in range(60):
        frame = world.sense()
        command = pilot.step(moved(frame, 3600 * SECOND) if tick == 40 else frame)
        assert bool(command.rejected) == (tick == 40)
        world.act(command.thrusts)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["qp", "paper"])
@pytest.mark.parametrize(
    ("leap_ns", "ticks"),
    [(3600 * SECOND, 10_000), (-50 * SECOND, 10_000), (2**62 - 100 * SECOND, 2), (3600 * SECOND, 2), (1, 1), (-1, 1)],
)
def test_leaps_of_any_size_are_recovered_from_and_no_time_that_passed(law: str, leap_ns: int, ticks: int) -> None:
    """For good, or for two frames that agree with each other; meanwhile the F/T sensor fails."""
    scene = short_scene(stroke_m=0.2, rows=1)
    options = FlightOptions(law=law, features="geometric", video=False)
    config = pilot_config(scene, options)
    pilot, world = Pilot(config), World(scene, options, config)
    for tick in range(450):
        leaps = 300 <= tick < 300 + ticks
        frame = moved(world.sense(), 60 * SECOND + leap_ns * leaps)
        if 300 <= tick < 310:
            frame = dataclasses.replace(frame, wrench=np.full(6, np.nan))
        command = pilot.step(frame)
        if tick >= 300 + 125:
            assert command.outcome is Outcome.SOLVED and command.rejected == (), tick
            assert command.stamp_ns == frame.stamp_ns
        world.act(command.thrusts)
    assert pilot.painter.phase in ("approach", "align") and not pilot.painter.finished
    assert pilot.measurement is not None
    assert abs(pilot.measurement.stamp_ns - 60 * SECOND - 450 * TICK_NS) < SECOND // 5, (
        "time went on by the ticks alone"
    )
    newest = max(line.seen_ns for line in pilot.motion.lines.values())
    for age_ns in (pilot.measurement.stamp_ns - newest, pilot.measurement.stamp_ns - pilot.measurement.wrench_stamp_ns):
        assert 0 <= age_ns < 0.12 * SECOND
