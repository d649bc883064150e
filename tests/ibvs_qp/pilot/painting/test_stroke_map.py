"""Where a stroke was painted."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ibvs_qp.pilot.painting.stroke_map import BEYOND_M, BIN_M, StrokeMap, Strokes, band_edge


def straight_map(first: float = 0.0, last: float = 0.6, slope: float = 0.1, length: float = 0.6) -> StrokeMap:
    stroke = StrokeMap(length)
    for u in np.arange(first, last, 0.002):
        stroke.add(float(u), 0.05 + slope * float(u))
    return stroke


@pytest.mark.parametrize("window", [(0.1, 0.3), (0.3, 0.1), (0.25, 0.55)])
def test_the_mean_over_a_window_is_v_at_its_middle(window: tuple[float, float]) -> None:
    assert straight_map().mean(*window) == pytest.approx(0.05 + 0.1 * sum(window) / 2.0, abs=0.1 * BIN_M)


def test_a_slow_part_counts_no_more_than_a_fast_one() -> None:
    stroke = straight_map(slope=0.0)
    for _ in range(1000):
        stroke.add(0.205, 0.07)
    assert stroke.mean(0.1, 0.3) == pytest.approx(0.05 + 0.02 / 21.0, abs=2e-4)


def test_a_window_that_is_half_bare_has_no_mean() -> None:
    stroke = straight_map(0.0, 0.3)
    assert stroke.mean(0.2, 0.36) == pytest.approx(0.075, abs=1e-3)  # ten of seventeen bins
    assert math.isnan(stroke.mean(0.2, 0.45)) and math.isnan(stroke.mean(0.4, 0.5))
    assert math.isnan(StrokeMap(0.6).mean(0.0, 0.1))


def test_the_places_are_those_of_the_bins_and_nan_where_nothing_is_painted() -> None:
    u, v = straight_map(0.0, 0.3).places()
    painted = (u > 0.0) & (u < 0.3)
    np.testing.assert_allclose(v[painted], 0.05 + 0.1 * u[painted], atol=0.1 * BIN_M)
    assert np.isnan(v[~painted]).all()


def test_paint_beside_the_nominal_stroke_is_remembered_and_farther_away_ignored() -> None:
    stroke = StrokeMap(0.6)
    for u in (-0.105, 0.705, -BEYOND_M - 0.1, 0.6 + BEYOND_M + 0.1):
        stroke.add(u, 0.05)
    assert stroke.mean(-0.105, -0.105) == stroke.mean(0.705, 0.705) == pytest.approx(0.05)
    assert math.isnan(stroke.mean(-BEYOND_M - 0.1, -BEYOND_M - 0.1))


def test_a_widened_map_is_the_outermost_of_both_and_has_no_hole_where_one_lies() -> None:
    first, again = StrokeMap(0.3), StrokeMap(0.3)
    for u, v in ((0.105, 0.05), (0.115, 0.05), (0.125, 0.05)):
        first.add(u, v)
    for u, v in ((0.105, 0.052), (0.115, 0.047), (0.205, 0.06)):
        again.add(u, v)
    wide = first.widened(again)
    assert [wide.mean(u, u) for u in (0.105, 0.115, 0.125)] == pytest.approx([0.052, 0.05, 0.05])
    assert wide.mean(0.205, 0.205) == pytest.approx(0.06) and math.isnan(wide.mean(0.305, 0.305))
    assert first.mean(0.105, 0.105) == pytest.approx(0.05)


def test_a_moved_map_has_its_waves_and_holes_elsewhere() -> None:
    stroke = StrokeMap(0.6)
    for u in np.arange(0.0, 0.6, 0.002):
        if not 0.4 <= u < 0.45:
            stroke.add(float(u), 0.05 - (0.01 if 0.2 <= u < 0.3 else 0.0))
    before = np.array([0.6, 0.3, 0.0])
    moved = stroke.moved(before, before + 0.1 * before)
    u, v = moved.places()
    wave = u[v < 0.045]
    assert wave.min() == pytest.approx(0.22, abs=0.006) and wave.max() == pytest.approx(0.33, abs=0.006)
    assert np.isnan(v[(u > 0.455) & (u < 0.475)]).all() and np.isfinite(v[(u > 0.01) & (u < 0.43)]).all()
    assert np.nanmax(u[np.isfinite(v)]) == pytest.approx(0.6 + 0.055, abs=0.01)
    assert stroke.mean(0.25, 0.25) == pytest.approx(0.04)
    assert not np.isfinite(StrokeMap(0.6).moved(before, before).places()[1]).any()


@pytest.mark.parametrize("hole", [1, 3])
@pytest.mark.parametrize("shift", [0.0, 1e-4, -1e-4, 0.03])
def test_a_shift_closes_no_hole_and_paints_nothing_more(hole: int, shift: float) -> None:
    stroke = StrokeMap(0.6)
    for k in range(60):
        if not 30 <= k < 30 + hole:
            stroke.add(BIN_M * (k + 0.5), 0.05)
    place = np.zeros(1)
    painted = np.isfinite(stroke.moved(place, place + shift).places()[1])
    assert painted.sum() == 60 - hole
    np.testing.assert_array_equal(painted, np.roll(np.isfinite(stroke.places()[1]), round(shift / BIN_M)))


@pytest.mark.parametrize("side", [1, -1])
def test_a_round_brush_fills_a_dip_from_both_sides_and_widens_no_line(side: int) -> None:
    u, radius = np.arange(0.0, 0.3, 0.005), 0.04
    slope = 0.1 * u
    edge = band_edge(u, slope, radius, side)
    assert side * (edge - slope)[8:-8] == pytest.approx(radius * (math.sqrt(1.01) - 1.0), abs=2e-5)
    dip = np.where(np.abs(u - 0.15) < 0.021, -side * 0.02, 0.0)
    filled = radius - math.sqrt(radius**2 - 0.025**2)
    assert (side * band_edge(u, dip, radius, side)).min() == pytest.approx(-filled, abs=1e-9)
    assert (side * band_edge(u, -dip, radius, side)).max() == pytest.approx(0.02)


def test_a_pass_over_a_hole_has_an_overlap_there() -> None:
    strokes = Strokes(0.6, 0.04)
    strokes.begin_pass()
    for u in np.arange(0.0, 0.6, 0.002):
        strokes.add(float(u), 0.05)
    strokes.end_stroke()
    for low, high in ((0.0, 0.2), (0.1, 0.5)):  # the second pass lies 12 mm farther out
        strokes.begin_pass()
        for u in np.arange(low, high, 0.002):
            strokes.add(float(u), 0.122 if low == 0.0 else 0.134)
    u, overlap, _ = strokes.overlap(0.0, 0.6)
    assert u.max() > 0.48
    assert overlap[(u > 0.25) & (u < 0.45)] == pytest.approx(0.05 - 0.134, abs=1e-6)
