"""Completed by the truth: each condition fails alone, is named, and holds at its bound."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest
from press_trace import press_trace
from synthetic_trace import Errors, synthetic_trace

from sim.evaluate.metrics import compute_metrics, false_claims
from sim.evaluate.strokes import painted_strokes
from sim.evaluate.truth import Assessment
from sim.flight.trace import INTERRUPTED, KILLED, Event, Trace
from sim.world.board import BoardGeometry
from sim.world.scene import BoardScene, PaintScene, Scene, WindScene
from sim.world.worlds import in_world

THREE_ROWS = Scene(paint=PaintScene(rows=3, stroke_m=0.6))
PATTERNS = [(kind, f"{high}-{side}") for kind in ("rows", "columns") for high in ("bottom", "top")
            for side in ("right", "left")]  # fmt: skip


def shortfall(trace: Trace) -> str | None:
    return Assessment(trace).shortfall


def three_rows(*offsets: float, **errors: float) -> Trace:
    return synthetic_trace(Errors(row_offset_m=offsets or (0.0, 0.0, 0.0), **errors), THREE_ROWS)


def moved(trace: Trace, ticks: np.ndarray, across_m: float) -> Trace:
    """The trace with some ticks moved across their stroke."""
    board = BoardGeometry(trace.scene)
    spots = board.board_coordinates(trace.tip[ticks, 1:])
    spots = board.from_pattern(board.to_pattern(spots) + np.array([0.0, across_m]))
    trace.arrays["tip"] = trace.tip.copy()
    trace.arrays["tip"][ticks, 1:] = board.point(*spots.T)
    return trace


def along(trace: Trace) -> np.ndarray:
    """Pattern coordinate u of every tick."""
    board = BoardGeometry(trace.scene)
    return board.to_pattern(board.board_coordinates(trace.tip[:, 1:]))[:, 0]


def test_legs_of_an_own_strategy_are_compared_with_the_way_of_the_tip():
    legs = ((-0.6, 0.0), (0.6, 0.0), (-0.6, 0.0))
    trace = three_rows()
    trace.legs = legs
    metrics = compute_metrics(trace)
    assert shortfall(trace) is None and not false_claims({"qp": metrics})
    assert metrics["rows"] == [] and math.isnan(metrics["coverage"]) and math.isnan(metrics["stroke_m"])
    trace.legs = ((-0.6, 0.0), (0.62, 0.0), (-0.6, 0.0))
    assert shortfall(trace) == "leg 2: 0.600 m long, 0.620 m asked"
    trace.legs = (*legs, (0.0, -0.2))
    assert shortfall(trace) == "leg 4: not painted"
    trace.legs = ((-0.6, 0.0), (0.6, 0.02), (-0.6, 0.0))
    assert shortfall(trace) == "leg 2: it ends 20 mm from its line"
    trace.legs = legs
    u = along(trace)
    middle = (trace.row == 2) & (np.abs(u - np.median(u[trace.row == 2])) < 0.05)
    assert str(shortfall(moved(trace, middle, 0.02))).startswith("leg 2: 1")


def test_without_legs_an_own_strategy_is_completed_as_it_says_unless_it_crashes_or_stays():
    trace = three_rows()
    trace.legs, trace.claimed, trace.reason = (), False, "no edge in view"
    assert shortfall(trace) == "no edge in view"
    trace.claimed = True
    assert shortfall(trace) is None
    trace.phases = tuple("away" if name in ("retreat", "done") else name for name in trace.phases)
    assert shortfall(trace) == "no retreat"


@pytest.mark.parametrize(("kind", "start"), PATTERNS)
def test_a_good_flight_is_completed_in_every_pattern(kind, start):
    size = {"width_m": 0.7, "height_m": 0.7}
    scene = Scene(board=BoardScene(**size), paint=PaintScene(pattern=kind, start=start, rows=3, stroke_m=0.6))
    assert shortfall(synthetic_trace(Errors(row_offset_m=(0.0,) * 3), scene)) is None
    lost = shortfall(synthetic_trace(Errors(row_offset_m=(0.0, -0.02, 0.0)), scene))
    assert lost is not None and lost.startswith(f"{kind[:-1]} 2: 20 mm from its place")
    strokes = painted_strokes(synthetic_trace(Errors(row_offset_m=(0.001, 0.002, 0.003)), scene))
    assert [strokes[k].place_error_m for k in (1, 2, 3)] == pytest.approx([0.001, 0.003, 0.006], abs=1e-9)
    assert [strokes[k].overlap_m for k in (2, 3)] == pytest.approx([0.006, 0.005], abs=1e-9)


def test_the_place_counts_from_the_edge_and_errors_add_up():
    """Every row lies right beside the one before; the third is 9 mm from its place."""
    assert shortfall(three_rows(0.002, 0.003, 0.002)) is None
    assert shortfall(three_rows(0.003, 0.003, 0.003)) == "row 3: 9.0 mm from its place"


def test_a_row_on_the_row_before_is_named():
    """The fifth row of a wall, painted over the fourth: claimed, but not completed."""
    trace = three_rows(0.0, 0.0, -0.054)
    assert shortfall(trace) == "row 3: 54 mm from its place; overlaps row 2 by 62 mm, nominal 8.0 mm"
    metrics = compute_metrics(trace)
    assert metrics["claimed"] and not metrics["completed"] and metrics["place_error_m"] == pytest.approx(-0.054)
    assert [row["completed"] for row in metrics["rows"]] == [True, True, False]
    assert false_claims({"qp": metrics}) == [f"QP law: claimed as completed, but {metrics['not_completed']}"]


@pytest.mark.parametrize(("gap_m", "last_m", "missing"), [
    (0.0079, 0.3, None), (0.009, 0.3, "row 2: gap of 1.0 mm to row 1"), (0.03, 0.018, None),
    (0.03, 0.06, "row 2: gap of 22 mm to row 1"), (0.03, 0.04, None), (-0.0159, 0.1, None),
    (-0.017, 0.1, "row 2: overlaps row 1 by 25 mm, nominal 8.0 mm"),
])  # fmt: skip
def test_bands_touch_everywhere_but_in_the_last_two_centimetres(gap_m, last_m, missing):
    """Row 2 ends at the beginning of row 1, u = 0.05 m on this board; a round brush reaches over 2 cm of a gap."""
    trace = synthetic_trace(Errors(row_offset_m=(0.0, 0.0)), Scene(board=BoardScene(width_m=0.7),
                                                                   paint=PaintScene(stroke_m=0.6)))  # fmt: skip
    # Within a corner: the straight part, and with it the place error, stays as it is.
    place = along(trace) - BoardGeometry(trace.scene).stroke_ends[0]
    inside = place <= last_m if last_m <= 0.1 else (place > 0.2) & (place < 0.25)
    assert shortfall(moved(trace, (trace.row == 2) & inside, gap_m)) == missing


def retouched(trace: Trace, row: int, reach_u: tuple[float, float], *across_m: float) -> Trace:
    """The trace with a part of a row painted again, that far outside its place, in the last second of the press.

    Two numbers are the way out and back.
    """
    board, ticks = BoardGeometry(trace.scene), (trace.t > 5.0) & (trace.t < 6.0)
    count = int(ticks.sum())
    parts = np.array_split(np.linspace(0.0, 1.0, count), len(across_m))
    path = np.concatenate(
        [
            np.column_stack(
                (
                    np.linspace(*(reach_u if way == 0 else reach_u[::-1]), len(part)),
                    np.full(len(part), board.stroke_place(row) + across),
                )
            )
            for way, (part, across) in enumerate(zip(parts, across_m, strict=True))
        ]
    )
    trace.phases = (*trace.phases, "retouch")
    for name in ("phase", "row", "tip"):
        trace.arrays[name] = trace.arrays[name].copy()
    trace.arrays["phase"][ticks], trace.arrays["row"][ticks] = len(trace.phases) - 1, row
    trace.arrays["tip"][ticks, 1:] = board.point(*board.from_pattern(path).T)
    return trace


def test_the_band_of_a_stroke_is_that_of_both_passes():
    def with_gap(row: int) -> Trace:
        trace, board = three_rows(), BoardGeometry(THREE_ROWS)
        inside = np.abs(along(trace) - board.stroke_ends[0] - 0.225) < 0.06
        return moved(trace, (trace.row == row) & inside, 0.009)

    begin = BoardGeometry(THREE_ROWS).stroke_ends[0]
    assert shortfall(with_gap(2)) == "row 2: gap of 1.0 mm to row 1"
    assert shortfall(retouched(with_gap(2), 2, (begin + 0.15, begin + 0.3), -0.004)) is None
    assert shortfall(retouched(with_gap(2), 2, (begin + 0.24, begin + 0.3), -0.004)) == "row 2: gap of 1.0 mm to row 1"
    assert shortfall(retouched(with_gap(2), 3, (begin + 0.15, begin + 0.3), -0.004)) == "row 2: gap of 1.0 mm to row 1"
    too_far = "row 2: overlaps row 1 by 25 mm, nominal 8.0 mm"
    assert shortfall(retouched(three_rows(), 2, (begin + 0.15, begin + 0.3), -0.017)) == too_far
    both_ways = retouched(with_gap(2), 2, (begin + 0.15, begin + 0.3), 0.009, -0.0005)
    assert shortfall(both_ways) is None, "one way back closes it, however the other one lies"
    hole = retouched(with_gap(2), 2, (begin + 0.15, begin + 0.3), -0.004)
    lifted = (hole.t > 5.0) & (hole.t < 6.0) & (np.abs(along(hole) - begin - 0.225) < 0.03)
    hole.arrays["push_true"] = np.where(lifted, 0.0, hole.push_true)
    assert shortfall(hole) == "row 2: gap of 1.0 mm to row 1", "it did not touch there"
    long = retouched(three_rows(), 2, (begin - 0.012, begin + 0.3), 0.0)
    assert shortfall(long) == "row 2: 0.612 m long, 0.600 m asked"
    # Row 3 overlaps the outer side of both passes of row 2: at most 24 mm.
    outside = retouched(three_rows(0.0, 0.0, -0.007), 2, (begin + 0.15, begin + 0.3), 0.01)
    assert shortfall(outside) == "row 3: overlaps row 2 by 25 mm, nominal 8.0 mm"


@pytest.mark.parametrize(("longer_m", "good"), [(0.0, True), (0.0095, True), (0.011, False), (-0.011, False)])
def test_a_stroke_has_its_length(longer_m, good):
    """Rows 1 and 2 both have another length if row 1 ends elsewhere."""
    found = shortfall(synthetic_trace(Errors(row_offset_m=(0.0, 0.0), longer_m=longer_m)))
    assert (found is None) is good
    assert good or found.startswith(f"row 1: {1.3 + longer_m:.3f} m long, 1.300 m asked; row 2: 1.")


def test_what_is_painted_beside_the_board_is_no_stroke():
    scene = Scene(board=BoardScene(height_m=0.19), paint=PaintScene(rows=3, stroke_m=1.3))
    trace = synthetic_trace(Errors(row_offset_m=(0.0, 0.0, 0.0)), scene)
    assert shortfall(trace) == "row 3: not painted"
    metrics = compute_metrics(trace)
    assert metrics["off_board_share"] == pytest.approx(1.304 / 4.044, abs=1e-3)  # row 3 and the end of its climb
    assert metrics["rows"][2]["off_board_share"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("share", "scene", "good"), [
    (0.019, Scene(), True), (0.021, Scene(), False),
    (0.09, Scene(wind=WindScene(gust_n_rms=1.0)), True), (0.11, Scene(wind=WindScene(gust_n_rms=1.0)), False),
    (0.09, in_world(Scene(), "harsh"), True), (0.11, in_world(Scene(), "harsh"), False),
    (0.09, in_world(Scene(), "datasheet"), False),
    (0.04, in_world(Scene(), "field"), True), (0.11, in_world(Scene(), "field"), False),
])  # fmt: skip
def test_contact_lasts(share, scene, good):
    trace = synthetic_trace(Errors(row_offset_m=(0.0, 0.0)), scene)
    painting = np.flatnonzero(trace.painting_1khz)
    trace.arrays["contact_1khz"][painting[4000 : 4000 + round(share * len(painting))]] = 0.0
    found = shortfall(trace)
    assert (found is None) if good else found.startswith("contact in ")


@pytest.mark.parametrize(("hole_m", "good"), [(0.045, True), (0.055, False)])
def test_a_brush_covers_a_hole_of_half_its_width(hole_m, good):
    trace = synthetic_trace(Errors(row_offset_m=(0.0, 0.0)))
    painted = along(trace)[trace.row == 2]
    middle = 0.5 * (painted.min() + painted.max())
    lifted = (trace.row == 2) & (np.abs(along(trace) - middle) < 0.5 * hole_m)
    trace.arrays["push_true"] = np.where(lifted, 0.0, trace.push_true)
    found = shortfall(trace)
    assert (found is None) if good else re.fullmatch(r"row 2: a hole: no contact over 5\d mm, limit 50 mm", found)


def test_the_vehicle_backs_away():
    trace = synthetic_trace(Errors(row_offset_m=(0.0, 0.0)))
    trace.arrays["tip"] = trace.tip.copy()
    trace.arrays["tip"][-1, 0] = -0.05
    assert shortfall(trace) == "no retreat: the tip ends 50 mm from the board"
    trace = synthetic_trace(Errors(row_offset_m=(0.0, 0.0)))
    trace.phases = tuple("away" if name in ("retreat", "done") else name for name in trace.phases)
    assert shortfall(trace) == "no retreat"


@pytest.mark.parametrize("reason", ["crash: propeller strike", "time-out after 15 s in retreat", INTERRUPTED, KILLED,
                                    "time-out after 142 s of flight"])  # fmt: skip
def test_some_ends_complete_no_job(reason):
    trace = synthetic_trace(Errors(row_offset_m=(0.0, 0.0)))
    trace.reason = reason
    assert shortfall(trace) == reason


def test_a_job_that_was_done_and_not_claimed_is_marked_too():
    trace = synthetic_trace(Errors(row_offset_m=(0.0, 0.0)))
    trace.claimed, trace.reason = False, "no guide"
    assert false_claims({"paper": compute_metrics(trace)}) == [
        "analytic law: completed, but not claimed by the pilot (no guide)"
    ]


def test_a_reduced_push_has_a_reason():
    trace = synthetic_trace(Errors(row_offset_m=(0.0, 0.0), push_error_n=-0.24))
    assert compute_metrics(trace)["push_reduced"] is None
    trace = synthetic_trace(Errors(row_offset_m=(0.0, 0.0), push_error_n=-0.26))
    metrics = compute_metrics(trace)
    assert metrics["push_reduced"] == "the push was not reached"
    assert (metrics["push_asked_n"], metrics["push_commanded_n"]) == (5.0, 5.0)
    assert metrics["push_flown_n"] == pytest.approx(4.74)
    trace.events += [Event(t=9.0, kind="push reduced", text=text) for text in ("friction not yet learnt", "reach")]
    assert compute_metrics(trace)["push_reduced"] == "reach"


def press(*, hold_s: float = 8.0, slide_s: float = 0.0, retreat: bool = True, **more) -> Trace:
    """A press of 10 s after the touch, or one that slides in its last 4 s, and its retreat."""
    trace = press_trace(**more)
    trace.plan = {"press": hold_s, "paint": slide_s, "descend": 5.0}
    phase, t = np.where(trace.t < 1.0, 0, 1), trace.t
    tip = trace.tip.copy()
    if slide_s > 0.0:
        phase[t >= 7.0] = 2
        tip[:, 1] -= 0.1 * np.clip(t - 7.0, 0.0, None)
    if retreat:
        phase[t >= 11.0] = 3
        tip[t >= 11.0, 0] = -0.3
        for name, rate in (("push_true", 1), ("contact_1khz", 4)):
            trace.arrays[name] = trace.arrays[name] * np.repeat(t < 11.0, rate)
    trace.arrays |= {"phase": phase, "tip": tip}
    return trace


def test_a_press_follows_its_plan():
    assert shortfall(press()) is None
    assert shortfall(press(hold_s=9.2)) == "held for 9.0 s, 9.2 s asked"
    assert shortfall(press(retreat=False)) == "no retreat"
    assert shortfall(press(hold_s=4.9, slide_s=3.9)) is None
    assert shortfall(press(hold_s=4.9, slide_s=4.1)) == "slid for 4.0 s, 4.1 s asked"
    stuck = press(hold_s=4.9, slide_s=3.9)
    stuck.arrays["tip"][:, 1] = stuck.tip[0, 1]
    assert shortfall(stuck) == "slid 0.0 mm, at least 195 mm needed"
    untouched = press()
    untouched.arrays["push_true"] = np.zeros(len(untouched.t))
    assert shortfall(untouched) == "no touch"


def test_a_press_that_a_fault_ended_lands_or_descends():
    trace = press(hold_s=20.0, fault_s=6.0)
    assert shortfall(trace) == "descended for 1.0 s, 5 s asked"
    trace.plan["descend"] = 0.9
    assert shortfall(trace) is None
    trace.plan["descend"], trace.reason = 5.0, "landed"
    assert shortfall(trace) is None
    trace.reason = "crash: flipped"
    assert shortfall(trace) == "crash: flipped; descended for 1.0 s, 5 s asked"


def test_a_flight_that_never_began_is_not_completed():
    trace = synthetic_trace()
    for name, values in trace.arrays.items():
        trace.arrays[name] = values if name.startswith("thrust_") else values[:0]
    assert "row 1: not painted" in str(shortfall(trace)) and not compute_metrics(trace)["completed"]
    assert math.isnan(compute_metrics(dataclasses.replace(trace))["push_flown_n"])
