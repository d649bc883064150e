"""Lines in pattern coordinates against a geometric construction."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from painted_wall import GUIDE, NEAR, PaintedWall, Piece, short

from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.pilot.painting.pattern import CORNERS, PATTERNS, Pattern
from ibvs_qp.pilot.painting.pattern_lines import pattern_lines

TEN_DEG = math.radians(10.0)
patterns = st.builds(Pattern, st.sampled_from(PATTERNS), st.sampled_from(CORNERS))
angles, places = st.floats(-TEN_DEG, TEN_DEG), st.floats(-0.5, 0.5)


def line_through(first: np.ndarray, last: np.ndarray, side: np.ndarray) -> TrackedLine:
    """The tracked line from one point (right, down) to another, with the surface towards a vector."""
    along = (last - first) / np.linalg.norm(last - first)
    normal = np.array((along[1], -along[0]))
    role = HORIZONTAL if abs(normal[1]) > abs(normal[0]) else VERTICAL
    normal = normal if normal[1 if role == HORIZONTAL else 0] > 0.0 else -normal
    angle, middle = math.atan2(normal[1], normal[0]), 0.5 * (first + last)
    return TrackedLine(
        track_id=1,
        role=role,
        slot=0,
        angle=angle,
        deviation=1e-3,
        seen_ns=0,
        offset=float(normal @ middle),
        weight=1.0,
        surface_side=1 if normal @ side > 0.0 else -1,
        seen_angle=angle,
        middle=float(np.array((-normal[1], normal[0])) @ middle),
        length=float(np.linalg.norm(last - first)),
    )


@settings(max_examples=300, deadline=None, derandomize=True)
@given(patterns, angles, angles, places, places, st.booleans(), st.sampled_from((-1, 1)))
def test_a_line_has_the_coordinates_of_the_points_that_it_was_drawn_through(
    pattern: Pattern, turn: float, lean: float, u: float, v: float, parallel: bool, side: int
) -> None:
    """Two points in turned pattern coordinates, to the wall and back."""

    def to_wall(point: np.ndarray) -> np.ndarray:
        c, s = math.cos(turn), math.sin(turn)
        return np.array(pattern.to_wall(c * point[0] - s * point[1], s * point[0] + c * point[1]))

    middle, slope = np.array((u, v)), math.tan(lean)
    half = 0.1 * (np.array((1.0, slope)) if parallel else np.array((slope, 1.0)))
    towards = side * (np.array((0.0, 1.0)) if parallel else np.array((1.0, 0.0)))
    track = line_through(to_wall(middle - half), to_wall(middle + half), to_wall(towards))
    (found,) = pattern_lines([track], pattern, turn)
    expected = v - slope * u if parallel else u - slope * v
    assert found.parallel == parallel and found.side == side
    assert found.place == pytest.approx(expected, abs=1e-9)
    assert found.lean == pytest.approx(slope, abs=1e-9)
    assert found.middle == pytest.approx((u, v), abs=1e-9)
    assert found.length == pytest.approx(0.2 / math.cos(lean), abs=1e-9)
    assert found.place * found.scale == pytest.approx(track.offset, abs=1e-9)


def test_lines_without_weight_or_direction_are_left_out() -> None:
    diagonal = line_through(np.array((0.0, 0.0)), np.array((0.1, 0.105)), np.array((1.0, -1.0)))
    faded = line_through(np.array((-0.1, 0.05)), np.array((0.1, 0.05)), np.array((0.0, -1.0)))
    faded.weight = 0.0
    assert pattern_lines([diagonal, faded], Pattern(), math.radians(3.0)) == []


def test_a_line_without_ends_has_a_place_and_no_middle() -> None:
    track = line_through(np.array((-0.1, 0.05)), np.array((0.1, 0.05)), np.array((0.0, -1.0)))
    track.middle, track.length = math.nan, 0.0
    (found,) = pattern_lines([track], Pattern(), 0.0)
    assert found.place == pytest.approx(-0.05) and all(map(math.isnan, found.middle))


@pytest.mark.parametrize("slope_deg", [-10.0, 4.0])
@pytest.mark.parametrize(("kind", "start"), [(kind, start) for kind in PATTERNS for start in CORNERS])
def test_a_sloped_board_s_edges_lie_at_their_nominal_places(kind: str, start: str, slope_deg: float) -> None:
    world = PaintedWall(short(pattern=kind, start=start), slope=math.radians(slope_deg))
    world.tip = np.array((0.02, 0.03))
    found = {line.track.track_id: line for line in pattern_lines(world.lines().values(), world.pattern, world.slope)}
    assert (found[GUIDE].place, found[GUIDE].side) == (pytest.approx(-0.03), 1)
    assert (found[NEAR].place, found[NEAR].side) == (pytest.approx(-0.07), 1)


@pytest.mark.parametrize("slope", [0.0, 0.15])
@pytest.mark.parametrize("error", [-0.01, 0.0, 0.02])
@pytest.mark.parametrize("piece", [Piece.parallel(1, -0.05, 1), Piece.upright(2, 0.06, -1)], ids=["along", "across"])
def test_a_tip_that_moves_until_its_line_is_at_the_target_has_lost_its_error(
    piece: Piece, error: float, slope: float
) -> None:
    """The tip moves along v or u by the error; the line's offset is then the target."""
    world = PaintedWall(short(), slope=slope)
    world.tip, world.board = np.zeros(2), [piece]
    (line,) = pattern_lines(world.lines().values(), world.pattern, 0.0)
    target = line.target(error)
    world.tip = np.array(world.to_board(*world.pattern.to_wall(*((0.0, error) if line.parallel else (error, 0.0)))))
    assert world.lines()[piece.identity].offset == pytest.approx(target, abs=1e-9)


@given(patterns, angles)
def test_a_turn_of_the_picture_leans_edges_along_and_across_the_strokes_opposite_ways(
    pattern: Pattern, turn: float
) -> None:
    """From u to v: an edge along u goes to v, one along v to -u."""
    c, s = math.cos(turn), math.sin(turn)
    along, across = np.array((c, s)), np.array((-s, c))
    lines = [
        line_through(np.array(pattern.to_wall(*(0.1 * end))), np.array(pattern.to_wall(*(-0.1 * end))), np.ones(2))
        for end in (along, across)
    ]
    seen = {line.parallel: line.lean for line in pattern_lines(lines, pattern, 0.0)}
    assert seen == {True: pytest.approx(math.tan(turn)), False: pytest.approx(-math.tan(turn))}
