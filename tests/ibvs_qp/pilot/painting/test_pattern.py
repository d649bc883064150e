"""Directions of the strokes and their nominal places."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ibvs_qp.pilot.painting.pattern import CORNERS, FILL, FILL_REST_M, PATTERNS, Pattern, stroke_count, stroke_place

#: (right, down) of the first stroke's travel and of the step to the next stroke.
DIRECTIONS = {
    ("rows", "bottom-right"): ((-1, 0), (0, -1)),
    ("rows", "top-left"): ((1, 0), (0, 1)),
    ("columns", "bottom-right"): ((0, -1), (-1, 0)),
    ("columns", "top-left"): ((0, 1), (1, 0)),
    ("columns", "top-right"): ((0, 1), (-1, 0)),
}


@pytest.mark.parametrize(("pattern", "expected"), DIRECTIONS.items())
def test_strokes_lead_from_their_corner_into_the_board(pattern, expected) -> None:
    found = Pattern(*pattern)
    assert (found.along, found.across) == expected
    assert found.travel(1) == 1.0 and found.travel(2) == -1.0


@given(st.sampled_from(PATTERNS), st.sampled_from(CORNERS), st.floats(-5, 5), st.floats(-5, 5))
def test_pattern_coordinates_and_wall_axes_are_inverse(kind: str, start: str, right: float, down: float) -> None:
    pattern = Pattern(kind, start)
    assert pattern.to_wall(*pattern.to_pattern(right, down)) == pytest.approx((right, down))


@given(st.floats(0.2, 5.0), st.floats(0.02, 0.2), st.floats(0.01, 0.3))
def test_a_filling_job_covers_the_board_to_its_margin(extent: float, margin: float, pitch: float) -> None:
    job = (FILL, extent, margin, pitch)
    count = stroke_count(*job)
    places = [stroke_place(stroke, *job) for stroke in range(1, count + 1)]
    steps = [b - a for a, b in itertools.pairwise(places)]
    assert all(step == pytest.approx(pitch) for step in steps[:-1])
    assert all(step < pitch + FILL_REST_M + 1e-9 for step in steps)
    assert places[-1] == pytest.approx(max(extent - margin, margin))


def test_a_job_with_a_number_of_strokes_has_that_number() -> None:
    assert stroke_count(3, 5.0, 0.05, 0.07) == 3
    assert stroke_place(3, 3, 5.0, 0.05, 0.07) == pytest.approx(0.19)
