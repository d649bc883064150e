"""A felt push against the distance of another surface: after a hole in the data, open loop, and in a whole approach."""

from __future__ import annotations

import dataclasses
import math

import pytest

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
