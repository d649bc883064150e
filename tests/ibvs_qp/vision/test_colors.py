"""What colours mean, and what samples tell of board and paint, by their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.vision.appearance.colors import BOARD, OTHER, PAINT, SurfaceColors
from ibvs_qp.vision.appearance.light import light_of
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.layout import CoarseGrid

GATE, WHITE, RED = 42.0, (200, 204, 196), (180, 40, 50)
SHAPE = (120, 160)


@pytest.fixture
def grid() -> CoarseGrid:
    return CoarseGrid((150.0, 150.0, 79.5, 59.5), np.zeros(SHAPE, np.uint8), PlaneConfig(grid_columns=40))


def noisy(color: tuple[float, ...], shape: tuple[int, ...], seed: int = 1) -> np.ndarray:
    """A colour with noise, uint8 (..., 3)."""
    return np.clip(np.rint(np.random.default_rng(seed).normal(color, 3.0, (*shape, 3))), 0, 255).astype(np.uint8)


def apart(colors: np.ndarray, color) -> np.ndarray:
    """Distance of colours (..., 3) from one, (...)."""
    return np.linalg.norm(colors.astype(float) - color, axis=-1)


@pytest.mark.parametrize("paint", [None, RED, (225, 200, 196)])
def test_a_label_is_that_of_the_nearer_colour_within_the_gate(paint: tuple[int, int, int] | None) -> None:
    colors = np.random.default_rng(2).integers(0, 256, (40, 50, 3)).astype(np.uint8)
    colors[:20] = colors[:20] // 8 + np.array(paint or WHITE, np.uint8) // 8 * 7
    middle = colors // 8 * 8 + 4.0
    wanted = np.where(apart(middle, WHITE) < GATE, BOARD, OTHER)
    surface = SurfaceColors(WHITE, paint, GATE)
    assert surface.paint_distinct == (paint == RED)
    if surface.paint_distinct:
        to_paint = apart(middle, paint)
        wanted[(to_paint < GATE) & (to_paint < apart(middle, WHITE))] = PAINT
    assert set(np.unique(wanted)) == ({OTHER, BOARD, PAINT} if surface.paint_distinct else {OTHER, BOARD})
    np.testing.assert_array_equal(surface.label(colors), wanted)
    np.testing.assert_array_equal(surface.label(colors[::2, ::3]), wanted[::2, ::3])


def test_the_board_is_the_median_of_what_is_neither_painted_nor_unlike_it(grid: CoarseGrid) -> None:
    surface, colors, component = SurfaceColors(None, RED, GATE), noisy(WHITE, grid.shape), np.ones(grid.shape, bool)
    component[:, :5], colors[:, :5] = False, 0
    colors[:, 5:25] = noisy(RED, (grid.shape[0], 20))
    surface.learn(colors, component)
    assert surface.board is not None
    samples = colors[:, 25:].reshape(-1, 3)
    np.testing.assert_array_equal(surface.board, np.sort(samples, axis=0)[len(samples) // 2])
    before = surface.board
    surface.learn(np.full_like(colors, 90), component)
    np.testing.assert_array_equal(surface.board, before)


def test_samples_are_like_the_colour_around_a_seed_or_the_paint(grid: CoarseGrid) -> None:
    colors = noisy(WHITE, grid.shape)
    colors[:10], colors[10:20, :10] = noisy((60, 60, 60), (10, grid.shape[1])), RED
    surface = SurfaceColors(None, RED, GATE)
    labels = surface.like_around(grid, colors, (25, 20), 2)
    assert (labels[:10] == OTHER).all() and (labels[10:20, :10] == PAINT).all() and (labels[20:] == BOARD).all()
    assert (surface.like_around(grid, colors, (15, 4), 2)[10:20, :10] == BOARD).all()
    assert surface.bare(grid, colors, [(15, 4), (25, 20)], 2) == [(25, 20)]


@pytest.mark.parametrize(("light", "known"), [(1.0, 1.0), (0.97, 1.0), (0.6, 0.6), (1.3, 1.3)])
def test_paint_is_learned_in_the_light_that_falls_on_it(grid: CoarseGrid, light: float, known: float) -> None:
    surface, colors = SurfaceColors(WHITE, RED, GATE), noisy(WHITE, grid.shape)
    colors[:12, :8] = noisy(tuple(light * part for part in RED), (12, 8))
    surface.learn_paint(grid, colors, np.arange(colors.size // 3))
    assert surface.paint is not None
    np.testing.assert_allclose(surface.paint, known * np.array(RED), rtol=0.01)
    few = SurfaceColors(WHITE, RED, GATE)
    few.learn_paint(grid, colors, np.arange(8))
    np.testing.assert_array_equal(few.paint, RED)


def test_light_is_even_where_all_that_has_the_tint_has_the_colour(grid: CoarseGrid) -> None:
    colors, (board, paint) = noisy(WHITE, grid.shape), (np.array(color, np.float32) for color in (WHITE, RED))
    colors[:5] = RED  # another tint
    _, _, tinted, even = light_of(colors.reshape(-1, 3).astype(np.float32), board, paint, GATE)
    assert tinted.sum() == even.sum() == colors[5:].size // 3
    colors[20:] = (0.7 * colors[20:]).astype(np.uint8)
    _, _, tinted, even = light_of(colors.reshape(-1, 3).astype(np.float32), board, paint, GATE)
    assert tinted.sum() == colors[5:].size // 3 and even.sum() == colors[5:20].size // 3


def test_light_of_a_sample_is_its_share_of_the_board() -> None:
    board = np.array(WHITE, np.float32)
    samples = np.array([board, 0.5 * board, 0.3 * board, (252, 0, 0), RED, 0.95 * board], np.float32)
    light, cut, tinted, even = light_of(samples, board, None, GATE)
    np.testing.assert_allclose(light[[0, 1, 2, 5]], (1.0, 0.5, 0.3, 0.95), rtol=1e-6)
    assert cut.tolist() == [False, False, False, True, False, False]
    assert tinted.tolist() == [True, True, False, True, False, True]
    assert even.tolist() == [True, False, False, False, False, True]
    assert not light_of(samples, board, board, GATE)[2][0]


def test_colours_in_the_shadow_that_lies_on_the_surface_keep_their_labels() -> None:
    colors = SurfaceColors((228, 226, 220), (40, 90, 200), 42.0)
    seen = np.array([[228, 226, 220], [110, 110, 112], [40, 90, 200], [20, 45, 102], [150, 112, 92]], np.uint8)
    lit, both = [BOARD, OTHER, PAINT, OTHER, OTHER], [BOARD, BOARD, PAINT, PAINT, OTHER]
    assert colors.label(seen, shade=True).tolist() == lit
    colors.shadowed = True
    assert colors.label(seen, shade=True).tolist() == both
    assert colors.label(seen).tolist() == lit
    grey = SurfaceColors((228, 226, 220), (110, 110, 112), 42.0)  # paint of a shadow's tint
    grey.shadowed = True
    assert grey.label(seen[[0, 1]], shade=True).tolist() == [BOARD, PAINT]
    assert grey.label(np.array([[60, 60, 61]], np.uint8), shade=True).tolist() == [BOARD]
