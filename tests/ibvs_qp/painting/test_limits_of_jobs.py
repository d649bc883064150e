"""Jobs at the limits of what can be flown: short boards, stuck vehicles, edges that come into view late."""

from __future__ import annotations

import re

import numpy as np
from painted_wall import PaintedWall, short

from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.painting.along_track import AlongTrack
from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.pattern_lines import PatternLine

CONFIG = PaintingConfig(stroke_m=1.0)
MARGIN = CONFIG.edge_margin_m


def upright(track: int, place: float, side: int) -> PatternLine:
    line = TrackedLine(track_id=track, role="vertical", slot=0, angle=0.0, deviation=1e-3, seen_ns=0)
    line.weight, line.kind = 1.0, "board"
    return PatternLine(line, False, place, 0.0, side, 1.0, (place, 0.0), 0.4)


def test_the_edge_beside_the_beginning_that_comes_into_view_later_is_as_uncertain_as_u() -> None:
    along = AlongTrack(CONFIG)
    along.find_end([upright(3, 0.2, -1)])
    along.predict(-0.8)
    along.look([upright(2, -MARGIN - along.u + 0.1, 1)])
    assert np.linalg.eigvalsh(along._p).min() >= 0.0
    along.look([upright(2, -MARGIN - along.u + 0.1, 1)])


def test_no_stroke_runs_off_a_board_that_is_shorter_than_the_job() -> None:
    world = PaintedWall(short(rows=2, stroke_m=1.0), length=1.0)
    world.fly(100.0)
    assert world.reached[0] > -0.003


def test_the_time_out_of_a_stroke_names_value_and_limit() -> None:
    world = PaintedWall(short(timeout_s=5.0))
    world.fly(60.0, until="paint")
    world.stuck = True
    world.fly(40.0, until="retreat")
    assert re.search(r"\d+ mm are left after \d+ s", world.painter.reason), world.painter.reason


def test_a_survey_that_does_not_move_times_out() -> None:
    world = PaintedWall(short(stroke_m=1.0))
    world.tip[0] = 0.2
    world.fly(10.0, until="survey")
    world.stuck = True
    world.fly(120.0)
    assert world.painter.finished
