"""Begin of a paint job on a synthetic wall: where the vehicle starts, how it finds its place, and what it waits for."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from painted_wall import END, GUIDE, NEAR, PLACE, PaintedWall, Piece, assert_started_well, short, started

# ------------------------------------------------------------------------------------------------------ from where


@pytest.mark.parametrize("across", [-0.5, 0.5])
@pytest.mark.parametrize(("kind", "start"), [("rows", "bottom-right"), ("columns", "top-left")])
def test_stroke_one_begins_at_its_place_from_beside_it(kind: str, start: str, across: float) -> None:
    assert_started_well(started(0.0, across, pattern=kind, start=start, stroke_m=1.0))


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


def test_a_survey_without_an_end_gives_up_after_the_stroke_and_claims_nothing() -> None:
    world = PaintedWall(short(rows=1), hidden={NEAR, END})
    world.fly(150.0)
    assert "survey" in world.phases()
    assert world.painter.finished and world.painter.failed
    assert world.painter.reason == "no edge at the end of stroke 1"
    assert world.reached[1] < world.config.stroke_m + PLACE


def test_decoys_are_not_taken_for_the_guide() -> None:
    """A joint, the edge of another board, old paint and a picture's frame lie nearer than the true edge."""
    world = started(0.0, 0.03)
    world.extra = [
        Piece.parallel(50, 0.13, 1, ""),
        Piece.parallel(51, 0.03, -1),  # its surface lies on the other side
        Piece.parallel(52, 0.028, 1, "paint"),
        Piece.parallel(53, -0.15, 1),
    ]
    world.extra[0].weight = 0.6
    world.fly(10.0, until="approach")
    world.step()
    assert world.guide == GUIDE
    assert_started_well(world)


# ------------------------------------------------------------------------------------------------- waits, time-outs


@pytest.mark.parametrize(
    ("world", "missing"),
    [
        (lambda: PaintedWall(short(), hidden={GUIDE}), "the board's edge that guides stroke 1"),
        (lambda: PaintedWall(short(), blind_wall=True), "wall"),
        (lambda: PaintedWall(short(), tared_after=99.0), "tare of the force sensor"),
    ],
)
def test_start_waits_for_guide_wall_and_tare(world: Callable[[], PaintedWall], missing: str) -> None:
    flown = world()
    commands = flown.fly(14.0)
    assert flown.painter.phase == "start"
    assert not any(command.contact for command in commands)
    flown.fly(20.0)
    assert flown.painter.reason == f"time-out after 15 s in start: {missing}"


def test_an_uncertain_guide_begins_nothing() -> None:
    world = PaintedWall(short())
    world.board[0].weight = 0.5
    world.fly(5.0)
    assert world.painter.phase == "start"


def test_align_needs_stillness_and_place() -> None:
    world = PaintedWall(short())
    world.fly(20.0, until="align")
    world.tip[1] += 0.005
    world.odometer += world.to_wall(0.0, 0.005)
    world.stuck = True
    world.fly(2.0)
    assert world.painter.phase == "align"
    world.stuck = False
    world.fly(5.0, until="press")
    assert world.painter.phase == "press"


def test_tolerances_of_the_alignment_open_with_time() -> None:
    world = PaintedWall(short())
    world.fly(20.0, until="align")
    world.tip[1] += 0.006  # twice the tolerance: reached after sqrt(2) times the patience
    world.odometer += world.to_wall(0.0, 0.006)
    world.stuck = True
    world.fly(2.5)
    assert world.painter.phase == "align"
    world.fly(1.0)
    assert world.painter.phase == "press"


def test_press_waits_for_the_push() -> None:
    world = PaintedWall(short())
    world.fly(30.0, until="press")
    world.contact_allowed = False
    world.fly(8.0)
    assert world.painter.phase == "press"
    world.contact_allowed, world.push = True, 4.0
    world.fly(3.0)
    assert world.painter.phase == "press"  # contact is not enough, and 80 % of the push are not
    world.push = 4.5
    world.fly(1.0, until="paint")
    assert world.painter.phase == "paint" and world.painter.row == 1


@pytest.mark.parametrize("aside", [(0.012, 0.0), (0.0, 0.012), (0.0, -0.012)])
def test_a_touch_beside_the_beginning_is_taken_back(aside: tuple[float, float]) -> None:
    """A sway moves the tip by 12 mm just before it touches, along or across the strokes."""
    world = started(0.0, 0.0)
    world.fly(60.0, until="press")
    moved = np.array(aside)
    world.tip = world.tip + moved
    world.odometer = world.odometer + np.array(world.to_wall(*moved))
    world.stuck = True
    world.fly(20.0, until="approach")
    assert world.painter.phase == "approach" and " mm from the beginning" in world.painter.log[-1][2]
    world.stuck = False
    assert_started_well(world)


def _off_place(world: PaintedWall) -> None:
    world.tip = world.tip + np.array((0.0, 0.03))
    world.odometer = world.odometer + world.to_wall(0.0, 0.03)
    world.stuck = True


@pytest.mark.parametrize(
    ("phase", "break_it", "reason"),
    [
        ("start", lambda world: world.hidden.add(GUIDE), "the board's edge that guides stroke 1"),
        (
            "approach",
            lambda world: setattr(world, "distance", 50.0),
            r"stand-off \d+\.\d+ m, goal 0.06 m within 0.01 m",
        ),
        ("align", _off_place, r"line error \d+.\d mm, limit 15 mm; speed 0 mm/s, limit 25 mm/s"),
        ("press", lambda world: setattr(world, "contact_allowed", False), r"contact, tip -?\d mm from the wall"),
        ("press", lambda world: setattr(world, "push", 3.0), r"push 3.00 N, commanded 5.00 N, limit 0.75 N"),
        ("climb", lambda world: setattr(world, "contact_allowed", False), r"contact, tip -?\d mm from the wall"),
    ],
)
def test_a_time_out_names_what_it_waited_for_with_value_and_limit(
    phase: str, break_it: Callable[[PaintedWall], object], reason: str
) -> None:
    world = PaintedWall(short(timeout_s=8.0))
    world.fly(60.0, until=phase)
    assert world.painter.phase == phase
    break_it(world)
    world.fly(20.0, until="retreat")
    assert "retreat" in world.phases() and world.painter.failed
    assert re.fullmatch(rf"time-out after \d+ s in {phase}: {reason}", world.painter.reason)
    world.distance = min(world.distance, 1.0)
    commands = world.fly(9.0)
    assert world.painter.finished and world.painter.failed and not any(command.contact for command in commands)


def test_a_stroke_that_never_ends_times_out_and_a_retreat_too() -> None:
    world = PaintedWall(short(timeout_s=5.0))
    world.fly(60.0, until="paint")
    world.stuck = True
    world.fly(40.0, until="retreat")
    assert world.painter.phase == "retreat" and world.painter.reason.startswith("time-out in row 1")
    reason = world.painter.reason
    for _ in range(400):
        world.distance = -0.002  # held by something
        world.step()
    assert world.painter.finished and world.painter.reason == reason
    assert any(re.fullmatch(r"time-out after 5 s in retreat: distance -?0.00 m, goal 0.35 m", r)
               for _, _, r in world.painter.log)  # fmt: skip
