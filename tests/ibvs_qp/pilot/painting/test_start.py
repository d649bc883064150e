"""Begin of a paint job on a synthetic wall: where the vehicle starts, how it finds its place, and what it waits for."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable

import numpy as np
import pytest
from painted_wall import END, GUIDE, NEAR, PLACE, PaintedWall, Piece, assert_started_well, flown, started, wall

#: Starts beside the beginning of stroke 1, along it and across it [m].
PLACES = [place for place in itertools.product((-0.35, 0.0, 0.35), repeat=2) if place != (0.0, 0.0)]
PLACES += [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)]


@pytest.mark.parametrize(("along", "across"), PLACES)
@pytest.mark.parametrize(("kind", "start"), [("rows", "bottom-right"), ("columns", "top-left")])
def test_stroke_one_begins_at_its_place_from_anywhere(kind: str, start: str, along: float, across: float) -> None:
    assert_started_well(started(along, across, pattern=kind, start=start, stroke_m=1.0))


@pytest.mark.parametrize("across", [-0.5, 0.5])
def test_the_vehicle_steps_back_until_the_guide_is_in_view(across: float) -> None:
    world = started(0.0, across)
    assert GUIDE not in world.lines()
    world.fly(1.5)
    assert world.distance == pytest.approx(0.3, abs=1e-6)  # it looks first
    world.fly(15.0, until="approach")
    assert world.painter.phase == "approach" and 0.5 < world.distance < world.config.wide_view_m + 0.01
    assert_started_well(world)


def test_a_mark_that_is_in_view_but_not_at_the_margin_begins_no_stroke() -> None:
    """6 cm beside the margin: an edge in view is no mark; where the job begins follows from its end."""
    world = started(0.06, 0.0, stroke_m=1.0)
    assert NEAR in world.lines()
    assert_started_well(world)
    assert "survey" in world.phases()


def test_without_a_mark_at_the_start_a_survey_finds_the_end() -> None:
    world = started(0.2, 0.0, stroke_m=1.0)
    world.fly(10.0, until="survey")
    speeds = [command.velocity @ world.to_wall(1.0, 0.0) for command in world.fly(30.0, until="approach")]
    assert max(speeds) == pytest.approx(world.config.survey_speed_m_s, rel=0.03)
    assert re.search(r"stroke 1 begins -[67]\d\d mm from here", world.painter.log[-1][2])
    assert_started_well(world)


def test_a_survey_without_an_end_gives_up_after_the_stroke_and_claims_nothing() -> None:
    world = wall(rows=1, hidden={NEAR, END})
    assert world.finish() == "no edge at the end of stroke 1"
    assert "survey" in world.phases() and world.reached[1] < world.config.stroke_m + PLACE


def test_decoys_are_not_taken_for_the_guide() -> None:
    """A joint, the edge of another board, old paint and a picture's frame lie nearer than the true edge."""
    world = started(0.0, 0.03)
    # The surface of the second one lies on the other side.
    decoys = [(50, 0.13, 1, ""), (51, 0.03, -1, "board"), (52, 0.028, 1, "paint"), (53, -0.15, 1, "board")]
    world.extra = [Piece.parallel(*decoy) for decoy in decoys]
    world.extra[0].weight = 0.6
    world.fly(10.0, until="approach")
    world.step()
    assert world.guide == GUIDE
    assert_started_well(world)


def test_an_uncertain_guide_begins_nothing() -> None:
    world = wall()
    world.board[0].weight = 0.5
    world.fly(5.0)
    assert world.painter.phase == "start"


@pytest.mark.parametrize(("error", "held_s", "more_s"), [(0.005, 2.0, 0.0), (0.006, 2.5, 1.0)])
def test_an_alignment_needs_stillness_and_place_and_its_tolerances_open(
    error: float, held_s: float, more_s: float
) -> None:
    """Twice the tolerance is reached after sqrt(2) times the patience; less after the tip was let go."""
    world = flown("align")
    world.jolt(0.0, error)
    world.stuck = True
    world.fly(held_s)
    assert world.painter.phase == "align"
    world.stuck = more_s > 0.0
    world.fly(more_s or 5.0, until="press")
    assert world.painter.phase == "press"


def test_press_waits_for_the_push() -> None:
    world = flown("press")
    world.contact_allowed = False
    world.fly(8.0)
    assert world.painter.phase == "press"
    world.contact_allowed, world.push = True, 4.0
    world.fly(3.0)
    assert world.painter.waits_for(world.inputs).startswith("push 4.00 N, commanded 5.00 N, limit ")
    assert world.painter.phase == "press"  # contact is not enough, and 80 % of the push are not
    world.push = 4.5
    world.fly(1.0, until="paint")
    assert world.painter.phase == "paint" and world.painter.row == 1


@pytest.mark.parametrize(
    ("phase", "condition"),
    [
        ("press", "contact, tip "),
        ("paint", "the end of the paint"),
        ("climb", "place "),
        ("retreat", "distance "),
    ],
)
def test_a_phase_names_the_condition_that_it_waits_for(phase: str, condition: str) -> None:
    world = flown(phase, rows=2)
    world.step()
    assert world.painter.phase == phase
    assert world.painter.waits_for(world.inputs).startswith(condition)


@pytest.mark.parametrize("aside", [(0.012, 0.0), (0.0, 0.012), (0.0, -0.012)])
def test_a_touch_beside_the_beginning_is_taken_back(aside: tuple[float, float]) -> None:
    """A sway moves the tip by 12 mm just before it touches, along or across the strokes."""
    world = flown("press", rows=1)
    world.jolt(*aside)
    world.stuck = True
    world.fly(20.0, until="approach")
    assert world.painter.phase == "approach" and " mm from the beginning" in world.painter.log[-1][2]
    world.stuck = False
    assert_started_well(world)


@pytest.mark.parametrize(("sways", "taken_back"), [(1, 1), (9, 2)])
def test_a_touch_is_taken_back_but_not_for_ever(sways: int, taken_back: int) -> None:
    """A sway moves the tip along the stroke before the brush is pressed: at one touch, then at every touch."""
    world, touches = wall(rows=1), 0
    while not world.painter.finished and world.time < 100.0:
        before = world.in_contact
        world.step()
        if world.in_contact and not before and world.painter.phase == "press":
            touches += 1
            world.stuck = touches <= sways
            world.jolt(-0.01 * world.stuck)
        if not world.in_contact or world.painter.phase == "paint":
            world.stuck = False
    assert world.phases().count("press") - 1 == taken_back and world.phases().count("paint") == 1
    assert world.finish() == "" or sways > 1


# -------------------------------------------------------------------------------------------------------- time-outs


def lost_guide(world: PaintedWall) -> None:
    world.hidden.add(GUIDE)


def stuck(world: PaintedWall) -> None:
    world.stuck = True


def stuck_beside(world: PaintedWall) -> None:
    world.jolt(0.0, 0.03)
    world.stuck = True


def no_contact(world: PaintedWall) -> None:
    world.contact_allowed = False


def far_away(world: PaintedWall) -> None:
    world.distance = 50.0


def weak(world: PaintedWall) -> None:
    world.push = 3.0


def nothing(_world: PaintedWall) -> None:
    pass


@pytest.mark.parametrize(
    ("phase", "changes", "break_it", "reason"),
    [
        ("start", {}, lost_guide, "the board's edge that guides stroke 1"),
        ("start", {"blind_wall": True}, nothing, "wall"),
        ("start", {"tared_after": 99.0}, nothing, "tare of the force sensor"),
        ("survey", {"tip": np.array((0.2, 0.05)), "stroke_m": 1.0}, stuck, r"the edge at the end .*, 0\.0\d m flown"),
        ("approach", {}, far_away, r"stand-off \d+\.\d+ m, goal 0.06 m within 0.01 m"),
        ("approach", {"tip": np.array((-0.2, 0.05))}, stuck, "the beginning, 1\\d\\d mm away, limit 60 mm"),
        ("align", {}, stuck_beside, r"line error \d+.\d mm, limit 15 mm; speed 0 mm/s, limit 25 mm/s"),
        ("press", {}, no_contact, r"contact, tip -?\d mm from the wall"),
        ("press", {}, weak, r"push 3.00 N, commanded 5.00 N, limit 0.75 N"),
        ("climb", {}, no_contact, r"contact, tip -?\d mm from the wall"),
    ],
)
def test_a_time_out_names_what_it_waited_for_with_value_and_limit(
    phase: str, changes: dict, break_it: Callable[[PaintedWall], None], reason: str
) -> None:
    world = flown(phase, timeout_s=8.0, **changes)
    break_it(world)
    commands = world.fly(7.0)
    assert phase not in ("start", "press") or world.painter.phase == phase
    world.fly(40.0, until="retreat")
    assert re.fullmatch(rf"time-out after \d+ s in {phase}: {reason}", world.painter.reason), world.painter.reason
    world.distance = min(world.distance, 1.0)
    commands = (commands if phase == "start" else []) + world.fly(9.0)
    assert world.painter.finished and world.painter.failed and not any(command.contact for command in commands)


def test_a_stroke_that_never_ends_times_out_and_a_retreat_too() -> None:
    world = flown("paint", timeout_s=5.0)
    world.stuck = True
    world.fly(40.0, until="retreat")
    reason = world.painter.reason
    assert world.painter.phase == "retreat"
    assert re.fullmatch(r"time-out in row 1: \d+ mm are left after \d+ s", reason), reason
    for _ in range(400):
        world.distance = -0.002  # held by something
        world.step()
    assert world.painter.finished and world.painter.reason == reason
    texts = [text for _, _, text in world.painter.log]
    assert any(re.fullmatch(r"time-out after 5 s in retreat: distance -?0.00 m, goal 0.35 m", text) for text in texts)
