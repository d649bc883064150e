"""Missing data in flight: broken raw sensors, clocks that jump, a hole before another surface is touched."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from closed_loop_rigs import short_scene

from ibvs_qp.command import Outcome
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot
from sim.experiments.scenes import short_job
from sim.flight.closed_loop import make_pilot
from sim.flight.jobs import PaintJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.world.worlds import in_world

SCENE = in_world(short_job(0.7, rows=1), "datasheet")
OPTIONS = FlightOptions(features="geometric", video=False)
CONFIG = pilot_config(SCENE, OPTIONS)
#: For replays: the recorded vehicle does not fly the commands, which looks like missing thrust.
DEAF = dataclasses.replace(
    CONFIG, safety=dataclasses.replace(CONFIG.safety, missing_lift_n=100.0, missing_thrust_n=50.0)
)
#: The hole begins this long after the stroke has begun; the replay goes on for this long after the hole [s].
BEGINS_S, LONGEST_S, AFTER_S = 1.0, 4.0, 1.5
#: From the board to the wall behind it [m].
GAP_M = SCENE.board.gap_m


@pytest.fixture(scope="module")
def flight() -> tuple[int, list[tuple[SensorFrame, float]]]:
    """Index of the first frame of the hole, and all frames with the distance that the flying pilot estimated."""
    pilot, world = make_pilot(SCENE, OPTIONS, CONFIG, PaintJob()), World(SCENE, OPTIONS, CONFIG)
    rows: list[tuple[SensorFrame, float]] = []
    begin = math.inf
    while len(rows) * CONFIG.controller.tick_s < begin + BEGINS_S + LONGEST_S + AFTER_S:
        frame = world.sense()
        world.act(pilot.step(frame).thrusts)
        rows.append((frame, pilot.contact.state.distance))
        if pilot.painter.phase == "paint":
            begin = min(begin, len(rows) * CONFIG.controller.tick_s)
    world.close()
    return round((begin + BEGINS_S) / CONFIG.controller.tick_s), rows


def behind(frame: SensorFrame) -> SensorFrame:
    """The frame with the plane of the wall behind the board."""
    features = frame.features
    if features is None or features.plane is None:
        return frame
    a, b, c, d = features.plane
    ratio = 1.0 + GAP_M * math.hypot(a, b, c) / abs(d)
    return dataclasses.replace(
        frame, features=dataclasses.replace(features, plane=(a / ratio, b / ratio, c / ratio, d))
    )


@pytest.mark.slow
@pytest.mark.parametrize("wall_seen", [False, True])
@pytest.mark.parametrize("hole_s", [0.3, 0.9, 1.5, 2.5, LONGEST_S])
def test_a_contact_survives_a_hole_in_the_data(
    hole_s: float, wall_seen: bool, flight: tuple[int, list[tuple[SensorFrame, float]]]
) -> None:
    first, rows = flight
    last = first + round(hole_s / CONFIG.controller.tick_s)
    pilot = Pilot(DEAF)
    for frame, _ in rows[:first]:
        pilot.step(frame)
    assert pilot.contact.state.in_contact
    replayed = rows[last : last + round(AFTER_S / CONFIG.controller.tick_s)]
    for frame, _ in replayed:
        pilot.step(behind(frame) if wall_seen else frame)
        assert pilot.contact.state.in_contact
    state, (_, distance) = pilot.contact.state, replayed[-1]
    print(f"hole of {hole_s} s: {1e3 * state.distance:.1f} mm, flown {1e3 * distance:.1f} mm, push {state.push:.1f} N")
    assert state.distance == pytest.approx(distance, abs=6e-3)
    assert pilot.status.safety in ("nominal", "degraded") and pilot.painter.phase == "paint"
    noted = [text for _, kind, text in pilot.painter.log if kind == "wall"]
    assert len(noted) == wall_seen and all(" mm before the observed surface" in text for text in noted)


def test_a_board_before_the_seen_wall_is_pressed_softly() -> None:
    """Vision takes the wall for the board from the start: the tip meets the board before the estimated surface."""
    pilot, world = make_pilot(SCENE, OPTIONS, CONFIG, PaintJob()), World(SCENE, OPTIONS, CONFIG)
    largest = 0.0
    while pilot.painter.phase != "paint" and pilot.supervision.state == "nominal":
        world.act(pilot.step(behind(world.sense())).thrusts)
        largest = max(largest, float(world.plant.pushes.max()))
    world.close()
    print(f"largest push {largest:.1f} N, offset {1e3 * pilot.contact.surface_offset:.0f} mm")
    assert pilot.painter.phase == "paint" and pilot.contact.state.in_contact
    assert pilot.contact.surface_offset == pytest.approx(GAP_M, abs=5e-3)
    assert largest < 8.0


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
