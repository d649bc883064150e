"""A start beside the beginning of stroke 1, along it: its end says where it begins."""

from __future__ import annotations

import re

import pytest
from painted_wall import assert_started_well, started


@pytest.mark.parametrize(
    ("along", "across"),
    [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5), (0.35, 0.35), (0.35, -0.35), (-0.35, 0.35), (-0.35, -0.35)],
)
@pytest.mark.parametrize(("kind", "start"), [("rows", "bottom-right"), ("columns", "top-left")])
def test_stroke_one_begins_at_its_place_from_anywhere(kind: str, start: str, along: float, across: float) -> None:
    assert_started_well(started(along, across, pattern=kind, start=start, stroke_m=1.0))


def test_without_a_mark_at_the_start_a_survey_finds_the_end() -> None:
    world = started(0.2, 0.0, stroke_m=1.0)
    world.fly(10.0, until="survey")
    assert world.painter.phase == "survey"
    assert max(c.velocity @ world.to_wall(1.0, 0.0) for c in world.fly(30.0, until="approach")) == pytest.approx(
        world.config.survey_speed_m_s, rel=0.03
    )
    _, _, reason = world.painter.log[-1]
    assert re.search(r"stroke 1 begins -[67]\d\d mm from here", reason)
    assert_started_well(world)


def test_an_approach_that_cannot_move_names_the_way_that_is_left() -> None:
    world = started(-0.2, 0.0, timeout_s=8.0, stroke_m=0.5)
    world.fly(20.0, until="approach")
    world.stuck = True
    world.fly(30.0, until="retreat")
    assert re.fullmatch(
        r"time-out after \d+ s in approach: the beginning, 1\d\d mm away, limit 60 mm", world.painter.reason
    )
