"""Kernels of the plane fit give the same as plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.vision.appearance.colors import BOARD, PAINT
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.layout import CoarseGrid
from ibvs_qp.vision.surface.plane import choose_samples, connected_samples, fit_plane, residual_squares
from ibvs_qp.vision.surface.search import score_planes

PLANE, SHAPE = np.array([0.3, -0.2, 2.0]), (12, 20)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(4)


def samples(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Design and 1/Z of noisy samples of the plane."""
    y, x = np.mgrid[-0.3 : 0.3 : SHAPE[0] * 1j, -0.5 : 0.5 : SHAPE[1] * 1j]
    design = np.column_stack((x.ravel(), y.ravel(), np.ones(x.size)))
    return design, design @ PLANE * (1.0 + 0.01 * rng.standard_normal(x.size))


def test_least_squares_and_residuals(rng: np.random.Generator) -> None:
    design, inverse = samples(rng)
    component = rng.random(SHAPE) < 0.7
    chosen = component.reshape(-1)
    solved, plane, normal_matrix_inverse = fit_plane(design, inverse, chosen)
    assert solved
    np.testing.assert_allclose(plane, np.linalg.lstsq(design[chosen], inverse[chosen])[0], rtol=1e-10)
    np.testing.assert_allclose(normal_matrix_inverse, np.linalg.inv(design[chosen].T @ design[chosen]), atol=1e-10)
    residual = np.where(chosen, inverse - design @ plane, 0.0).reshape(SHAPE)
    blocks = residual[:10].reshape(2, 5, 4, 5).sum(axis=(1, 3))
    wanted = (np.sum(residual**2), np.sum(blocks**2))
    np.testing.assert_allclose(residual_squares(design, inverse, component, plane, 5), wanted)


def test_samples_on_a_line_determine_no_plane(rng: np.random.Generator) -> None:
    design, inverse = samples(rng)
    assert not fit_plane(design, inverse, design[:, 0] == design[0, 0])[0]


@pytest.mark.parametrize("own_depth", [False, True])
@pytest.mark.parametrize("least", [10, 1000])
def test_colours_choose_where_they_are_enough(rng: np.random.Generator, own_depth: bool, least: int) -> None:
    design, inverse = samples(rng)
    usable, labels = rng.random(len(inverse)) < 0.8, rng.integers(0, 3, len(inverse)).astype(np.uint8)
    relative, chosen = choose_samples(design, inverse, usable, labels, PLANE, own_depth, 0.01, 0.5, least)
    ratio = inverse / (design @ PLANE)
    away = np.abs((ratio if own_depth else 1.0 / ratio) - 1.0)
    np.testing.assert_allclose(np.abs(relative[usable]), away[usable], atol=1e-12)
    near = usable & (away < 0.01)
    colored = near & ((labels == BOARD) | ((labels == PAINT) & (away < 0.005)))
    np.testing.assert_array_equal(chosen, colored if least == 10 else near)


def test_planes_are_scored_by_what_agrees(rng: np.random.Generator) -> None:
    design, inverse = samples(rng)
    seed, pairs, judges = 110, rng.integers(0, len(inverse), (2, 30)), np.arange(0, len(inverse), 3)
    pairs[:, 0] = 7  # no plane
    planes, scores = score_planes(design, inverse, seed, inverse[seed], pairs, judges, 0.015, 0.25, 1e-4)
    weight = np.exp(-((design[judges] - design[seed]) ** 2).sum(axis=1) / 0.25**2)
    np.testing.assert_allclose(planes @ design[seed], inverse[seed])
    np.testing.assert_array_equal(planes[0], (0.0, 0.0, inverse[seed]))
    one, two = (np.vecdot(planes, design[place]) - inverse[place] for place in pairs)
    spans = np.any(planes[:, :2] != 0.0, axis=1)
    np.testing.assert_allclose(np.abs(one[spans]) + np.abs(two[spans]), 0.0, atol=1e-9)
    agrees = np.abs(planes @ design[judges].T - inverse[judges]) < 0.015 * inverse[judges]
    np.testing.assert_allclose(scores, agrees @ weight)


def test_depth_is_read_where_it_is_in_range(rng: np.random.Generator) -> None:
    depth = rng.uniform(0.5, 2.0, (30, 40)).astype(np.float32)
    depth[::5], depth[::7, ::2], depth[::4, ::3] = 0.0, np.nan, np.inf
    config = PlaneConfig(grid_columns=20, distance_min_m=0.6, distance_max_m=1.9)
    grid = CoarseGrid((40.0, 40.0, 19.5, 14.5), np.zeros((30, 40), np.uint8), config)
    v, u = np.mgrid[1:30:2, 1:40:2]
    z = depth[v, u].astype(float)
    wanted = np.divide(1.0, z, out=np.zeros_like(z), where=(z > 0.6) & (z < 1.9))
    np.testing.assert_array_equal(grid.inverse_depth(depth), wanted)
    z = np.mean([depth[r, c].astype(float) for r in (v - 1, v) for c in (u - 1, u)], axis=0)
    wanted = np.divide(1.0, z, out=np.zeros_like(z), where=(z > 0.6) & (z < 1.9))
    np.testing.assert_allclose(grid.mean_inverse_depth(depth), wanted, rtol=1e-6)


def test_hidden_samples_connect_the_surface() -> None:
    mask = np.zeros((120, 200), np.uint8)
    mask[:, 96:104] = 255
    grid = CoarseGrid((150.0, 150.0, 99.5, 59.5), mask, PlaneConfig(grid_columns=50))
    inlier = grid.free.copy()
    inlier[:, 40] = inlier[10] = False
    upper = inlier.copy()
    upper[10:], upper[:, 40:] = False, False
    assert not grid.free.all()
    lower = inlier & (np.arange(50) < 40) & (np.arange(30)[:, None] > 10)
    np.testing.assert_array_equal(connected_samples(inlier, grid, None), upper | lower)
    right = inlier & (np.arange(50) > 40) & (np.arange(30)[:, None] > 10)
    np.testing.assert_array_equal(connected_samples(inlier, grid, (20, 45)), right)
