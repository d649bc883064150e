"""The inverse-depth plane: truth, honest covariance, the board and not the wall behind it, refusals."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from ibvs_qp.vision.appearance.colors import BOARD, OTHER
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.layout import CoarseGrid
from ibvs_qp.vision.surface.plane import PlaneEstimate, depth_noise, refit_plane
from ibvs_qp.vision.surface.search import PlaneSearch

FOCAL, SHAPE = 625.2, (480, 640)
INTRINSICS = (FOCAL, FOCAL, 319.5, 239.5)
DOWN = np.array([0.0, 1.0, 0.0])
CONFIG = PlaneConfig()
SEED = (17, 28)  # left of the brush at the tip's height


def grid() -> CoarseGrid:
    return CoarseGrid(INTRINSICS, np.zeros(SHAPE, np.uint8), CONFIG)


def plain(seed: int) -> np.ndarray:
    """No colour anywhere."""
    return np.full(grid().shape, OTHER, np.uint8)


def inverse_plane(distance: float, yaw_deg: float = 0.0, lean_deg: float = 0.0) -> np.ndarray:
    """(a, b, c) of a plane with the given distance and turned normal."""
    yaw, lean = math.radians(yaw_deg), math.radians(lean_deg)
    return np.array([math.sin(yaw) * math.cos(lean), math.sin(lean), math.cos(yaw) * math.cos(lean)]) / distance


def render(
    board: np.ndarray, gap: float, rng: np.random.Generator, edge_row: int = 202, noise: float = 0.005
) -> np.ndarray:
    """Depth of a board above a row and a parallel wall below it, white plus correlated noise, holes at the edge."""
    u, v = np.meshgrid(np.arange(SHAPE[1]), np.arange(SHAPE[0]))
    x, y = (u - INTRINSICS[2]) / FOCAL, (v - INTRINSICS[3]) / FOCAL
    slope = board[0] * x + board[1] * y + board[2]
    distance = 1.0 / np.linalg.norm(board)
    depth = np.where(v < edge_row, 1.0 / slope, (distance + gap) / distance / slope)
    smooth = cv2.GaussianBlur(rng.standard_normal(SHAPE), (0, 0), 20.0)
    depth *= 1.0 + noise * (rng.standard_normal(SHAPE) + smooth / smooth.std())
    depth[np.abs(v - edge_row) <= 2] = 0.0
    return depth.astype(np.float32)


def search(depth: np.ndarray, config: PlaneConfig | None = None, down: np.ndarray | None = DOWN) -> PlaneEstimate | str:
    config = config or CONFIG
    places = grid()
    return PlaneSearch(config).search_plane(places, places.inverse_depth(depth), [SEED], down, plain)


@pytest.mark.parametrize("gap", [0.05, 0.03])
@pytest.mark.parametrize("yaw", [0.0, 5.0, -10.0])
def test_board_and_not_the_wall_that_fills_most_of_the_picture(gap: float, yaw: float) -> None:
    board = inverse_plane(0.5, yaw)
    for seed in range(10):
        found = search(render(board, gap, np.random.default_rng(seed)))
        assert isinstance(found, PlaneEstimate), found
        assert abs(found.distance_m - 0.5) < 0.004
        truth = -board / np.linalg.norm(board)
        assert math.degrees(math.acos(min(1.0, float(found.normal @ truth)))) < 1.5
        assert not found.component[27:].any(), "wall samples"


def test_covariance_is_honest_under_correlated_noise() -> None:
    board = inverse_plane(0.5)
    distances = []
    for seed in range(60):
        found = search(render(board, 0.05, np.random.default_rng(seed)), PlaneConfig(common_mode_m=0.0))
        assert isinstance(found, PlaneEstimate)
        error = found.inverse_depth - board
        distances.append(float(error @ np.linalg.solve(found.covariance, error)))
    assert 1.0 < np.mean(distances) < 9.0  # 3 expected; white-noise covariance alone gives over 15


def test_common_mode_widens_the_covariance() -> None:
    depth = render(inverse_plane(0.5), 0.05, np.random.default_rng(0))
    one, two = search(depth, PlaneConfig(common_mode_m=0.0)), search(depth, PlaneConfig(common_mode_m=0.005))
    assert isinstance(one, PlaneEstimate) and isinstance(two, PlaneEstimate)
    gradient = -one.inverse_depth / np.linalg.norm(one.inverse_depth) ** 3  # of the distance
    sigma = math.sqrt(gradient @ two.covariance @ gradient)
    assert 0.005 <= sigma < 0.007


def test_tracking_agrees_with_search_and_follows_motion() -> None:
    places = grid()
    rng = np.random.default_rng(1)
    plane = search(render(inverse_plane(0.6), 0.05, rng))
    assert isinstance(plane, PlaneEstimate)
    for k in range(20):
        truth = inverse_plane(0.6 - 0.005 * k, 0.2 * k)
        inverse = places.inverse_depth(render(truth, 0.05, rng))
        found = refit_plane(places, inverse, None, plane.inverse_depth, DOWN, CONFIG)
        assert isinstance(found, PlaneEstimate), found
        assert abs(found.distance_m - (0.6 - 0.005 * k)) < 0.004
        plane = found


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda depth: np.zeros_like(depth), "no valid depth"),
        (lambda depth: np.full_like(depth, np.nan), "no valid depth"),
        (lambda depth: depth * 1000.0, "no valid depth"),
        (lambda depth: depth * 0.001, "no valid depth"),
        (
            lambda depth: np.where(
                np.add.outer(np.abs(np.arange(480) - 140), np.abs(np.arange(640) - 228)) < 40, depth, 0
            ),
            "few",
        ),
    ],
)
def test_thin_evidence_is_refused_with_a_reason(change, reason: str) -> None:
    found = search(change(render(inverse_plane(0.5), 0.05, np.random.default_rng(0))).astype(np.float32))
    assert isinstance(found, str)
    assert reason in found or "no plane" in found


@pytest.mark.parametrize("yaw", [10.0, 45.0])
@pytest.mark.parametrize("noise", [0.0, 0.004, 0.0085, 0.025])
def test_noise_of_single_samples_is_measured_whatever_the_slope(noise: float, yaw: float) -> None:
    depth = render(inverse_plane(0.5, yaw), 0.05, np.random.default_rng(0), noise=noise)
    assert depth_noise(grid().inverse_depth(depth)) == pytest.approx(noise, rel=0.15, abs=1e-4)


def test_noise_that_tears_the_surface_apart_is_named() -> None:
    truth, rng = inverse_plane(0.5), np.random.default_rng(0)
    places, reasons = grid(), []
    for _ in range(20):
        inverse = places.inverse_depth(render(truth, 0.05, rng, noise=0.03))
        found = refit_plane(places, inverse, None, 1.02 * truth, DOWN, CONFIG)
        reasons.append(found if isinstance(found, str) else "")
    assert any(reason.startswith("depth scatters by 3.") for reason in reasons), reasons


def test_floor_is_no_working_surface() -> None:
    _, v = np.meshgrid(np.arange(SHAPE[1]), np.arange(SHAPE[0]))
    floor = np.where(v > 120, 0.6 / np.maximum((v - 100.0) / FOCAL, 1e-3), 0.0).astype(np.float32)
    places = grid()
    found = PlaneSearch(CONFIG).search_plane(places, places.inverse_depth(floor), [(40, 40)], DOWN, plain)
    assert isinstance(found, str)


def test_reset_repeats_the_same_bits() -> None:
    places, finder = grid(), PlaneSearch(CONFIG)
    inverse = places.inverse_depth(render(inverse_plane(0.5), 0.05, np.random.default_rng(2)))
    first = finder.search_plane(places, inverse, [SEED], DOWN, plain)
    finder.reset()
    second = finder.search_plane(places, inverse, [SEED], DOWN, plain)
    assert isinstance(first, PlaneEstimate) and isinstance(second, PlaneEstimate)
    assert np.array_equal(first.inverse_depth, second.inverse_depth)


def test_a_board_flush_with_its_wall_is_the_surface_left_of_the_brush() -> None:
    """Depth tells nothing there, so the noise would choose; the colour around the left seed decides."""
    places, depth = grid(), 1.0 / inverse_plane(0.5)[2]
    left, right = SEED, (17, 52)
    board_is_left = np.zeros(places.shape, np.uint8)
    board_is_left[:, :44] = BOARD
    likeness = [board_is_left, np.where(board_is_left == BOARD, OTHER, BOARD).astype(np.uint8)]
    for seed in range(10):
        noise = 1.0 + 0.005 * np.random.default_rng(seed).standard_normal(SHAPE)
        inverse = places.inverse_depth((depth * noise).astype(np.float32))
        found = PlaneSearch(CONFIG).search_plane(places, inverse, [left, right], DOWN, likeness.__getitem__)
        assert isinstance(found, PlaneEstimate), found
        assert found.component[:, :40].mean() > 0.9 and not found.component[:, 48:].any()


def test_a_wall_behind_the_board_is_not_the_surface_because_it_is_left_of_the_brush() -> None:
    places = grid()
    columns = np.arange(SHAPE[1])[None, :].repeat(SHAPE[0], axis=0)
    depth = np.where(columns < 340, 0.55, 0.5).astype(np.float32)
    labels = np.zeros(places.shape, np.uint8)
    labels[:, :43] = BOARD
    likeness = [labels, np.where(labels == BOARD, OTHER, BOARD).astype(np.uint8)]
    inverse = places.inverse_depth(depth)
    found = PlaneSearch(CONFIG).search_plane(places, inverse, [SEED, (17, 52)], DOWN, likeness.__getitem__)
    assert isinstance(found, PlaneEstimate), found
    assert found.distance_m == pytest.approx(0.5, abs=0.004)
