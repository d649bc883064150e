"""The tip's height learnt from the fresh paint beside the brush."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.measurement import HORIZONTAL
from ibvs_qp.painting.command import PainterInput
from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.guide_line import GuideLine
from ibvs_qp.painting.tip_height import TIP_SIGMAS, TIP_STD, TipHeight

CONFIG = PaintingConfig()
HALF, TICK = 0.5 * CONFIG.brush_width_m, 0.004


def edge(offset: float, side: int, kind: str = "paint", weight: float = 1.0) -> TrackedLine:
    return TrackedLine(
        track_id=side + 5, role=HORIZONTAL, slot=0, angle=1.57, deviation=3e-4, seen_ns=0, offset=offset,
        weight=weight, surface_side=side, kind=kind,
    )  # fmt: skip


def seen(*lines: TrackedLine) -> PainterInput:
    return PainterInput(
        time_s=0.0, lines={line.track_id: line for line in lines}, odometer=(0.0, 0.0), velocity=(0.0, 0.0),
        distance=0.0, wall_known=True, in_contact=True, time_since_touch=1.0, push=5.0, push_reference=5.0, tared=True,
    )  # fmt: skip


def learnt(*lines: TrackedLine, seconds: float = 10.0) -> float:
    tip = TipHeight(CONFIG)
    for _ in range(int(seconds / TICK)):
        tip.look(seen(*lines), TICK)
    return tip.error


@pytest.mark.parametrize("error", [-0.005, 0.0, 0.004])
def test_both_edges_of_the_stroke_show_the_error(error: float) -> None:
    upper, lower = edge(-HALF + error, -1), edge(HALF + error, 1)
    for lines in ((upper,), (lower,), (upper, lower)):
        assert learnt(*lines) == pytest.approx(error, abs=0.05 * abs(error) + 1e-9)


def test_a_wider_brush_than_believed_is_no_error_of_the_tip() -> None:
    assert learnt(edge(-HALF - 0.002, -1), edge(HALF + 0.002, 1)) == pytest.approx(0.0, abs=1e-9)


def test_a_short_look_counts_little() -> None:
    line = edge(-HALF + 0.004, -1)
    assert 0.0 < learnt(line, seconds=0.1) < 0.002 < learnt(line, seconds=2.0) < learnt(line) < 0.004


def test_other_edges_do_not_count() -> None:
    far = TIP_SIGMAS * TIP_STD + 0.001
    others = (
        edge(-HALF + 0.004, -1, kind="board"),
        edge(-HALF + 0.004, -1, weight=0.5),
        edge(-HALF + far, -1),
        edge(-HALF + 0.004, 0),
    )
    for line in others:
        assert learnt(line) == 0.0


def test_a_later_row_keeps_its_pitch_to_the_painted_one() -> None:
    guide = GuideLine(CONFIG)
    assert guide.fresh_offset == CONFIG.fresh_edge_m
    for _ in range(5000):
        guide.tip.look(seen(edge(-HALF + 0.005, -1)), TICK)
    assert guide.fresh_offset == pytest.approx(CONFIG.fresh_edge_m + 0.005, abs=5e-4)
    assert np.isfinite(guide.tip.error)
