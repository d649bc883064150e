"""Pictures of curved walls: unrolled ones have straight edges, and depth gives the curvature."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.layout import CoarseGrid
from ibvs_qp.vision.picture.unrolled import principal, unrolled, wall_axes
from ibvs_qp.vision.surface.curvature import WallCurvature
from ibvs_qp.vision.surface.plane import PlaneEstimate

HEIGHT, WIDTH = 480, 848
INTRINSICS = (620.0, 620.0, 424.0, 240.0)
#: Radius of a pier [m], distance of camera and wall [m], tip in C [m].
RADIUS_M, DISTANCE_M, TIP = 1.5, 0.75, np.array([0.0, 0.1, 0.6])
#: Wall before the camera, turned by a few degrees: (a, b, c) of 1/Z, (3,).
NORMAL = np.array([0.06, -0.04, 1.0]) / np.linalg.norm([0.06, -0.04, 1.0])
PLANE = NORMAL / DISTANCE_M
#: Place of an edge across the chart [m]: its bow in the picture of a round wall is several pixels.
EDGE_M = 0.12


def tensor(kappa: float, angle: float) -> np.ndarray:
    """Entries of the curvature of a cylinder that bends by kappa [1/m] along a direction [rad], (3,)."""
    c, s = math.cos(angle), math.sin(angle)
    return kappa * np.array((c * c, c * s, s * s))


def chart(kappa: float, angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places along and across the bend, and depth Z, of every pixel's ray at a round wall [m], (height, width) each."""
    fx, fy, cx, cy = INTRINSICS
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    rays = np.stack(((u - cx) / fx, (v - cy) / fy, np.ones_like(u)), axis=-1)
    right, down = wall_axes(NORMAL)
    first = math.cos(angle) * right + math.sin(angle) * down
    second = math.cos(angle) * down - math.sin(angle) * right
    touched = TIP + NORMAL * (DISTANCE_M - NORMAL @ TIP)
    axis = touched + NORMAL / kappa  # behind a bulge
    across, along = (rays @ each for each in (NORMAL, first))
    middle = np.array((axis @ NORMAL, axis @ first))
    a = across**2 + along**2
    b = across * middle[0] + along * middle[1]
    c = middle @ middle - 1.0 / kappa**2
    ways = (b - np.sign(kappa) * np.sqrt(b * b - a * c)) / a
    places = ways[..., None] * rays
    offset = places - axis
    turn = np.arctan2(np.sign(kappa) * (offset @ first), -np.sign(kappa) * (offset @ NORMAL))
    return turn / kappa, (places - touched) @ second, ways


def picture(along: np.ndarray, across: np.ndarray, depth: np.ndarray, edge: str) -> RgbdFrame:
    """A picture with a soft edge at a place across or along the bend."""
    place = across if edge == "across" else along
    grey = 60.0 + 140.0 / (1.0 + np.exp((place - EDGE_M) / 0.002))
    rgb = np.repeat(grey[..., None], 3, axis=2).astype(np.uint8)
    return RgbdFrame(stamp_ns=0, rgb=rgb, depth=depth.astype(np.float32), intrinsics=INTRINSICS)


def bow(frame: RgbdFrame, upright: bool) -> float:
    """Largest deviation of the edge from a straight line [px]."""
    grey = np.where(frame.depth > 0.0, frame.rgb[..., 0].astype(float), np.nan)  # beyond the picture are holes
    grey = grey if upright else grey.T
    found = []
    for row in range(20, grey.shape[0] - 20):
        signs = np.flatnonzero((grey[row, :-1] - 130.0) * (grey[row, 1:] - 130.0) < 0.0)
        if len(signs) == 1 and 20 < signs[0] < grey.shape[1] - 20:
            left, right = grey[row, signs[0]], grey[row, signs[0] + 1]
            found.append((row, signs[0] + (left - 130.0) / (left - right)))
    rows, places = np.array(found).T
    assert len(rows) > 200
    return float(np.abs(places - np.polyval(np.polyfit(rows, places, 1), rows)).max())


@pytest.mark.parametrize("kappa", [1.0 / RADIUS_M, -1.0 / RADIUS_M])
@pytest.mark.parametrize("angle", [0.0, 0.5 * math.pi], ids=["pier", "barrel"])
@pytest.mark.parametrize("edge", ["along", "across"])
def test_edges_of_an_unrolled_wall_are_straight_within_half_a_pixel(kappa: float, angle: float, edge: str) -> None:
    along, across, depth = chart(kappa, angle)
    seen = picture(along, across, depth, edge)
    upright = (edge == "along") == (angle == 0.0)
    if edge == "across":
        assert bow(seen, upright) > 2.5
    flat = unrolled(seen, PLANE, tensor(kappa, angle), TIP)
    assert bow(flat, upright) < 0.5
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    fx, fy, cx, cy = INTRINSICS
    tangent = 1.0 / (PLANE[0] * (u - cx) / fx + PLANE[1] * (v - cy) / fy + PLANE[2])
    known = flat.depth > 0.0
    assert known.mean() > 0.85 and np.abs(flat.depth - tangent)[known].max() < 0.003  # of the nearest pixel


def test_the_larger_curvature_and_its_direction() -> None:
    rng = np.random.default_rng(0)
    for kappa, angle in zip(rng.uniform(-1.0, 1.0, 50), rng.uniform(-1.5, 1.5, 50), strict=True):
        found, direction = principal(tensor(kappa, angle))
        assert found == pytest.approx(kappa) and math.sin(direction - angle) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("kappa", "angle"), [(1.0 / RADIUS_M, 0.0), (-1.0 / RADIUS_M, 1.2), (0.2, 0.3)])
def test_depth_gives_the_curvature(kappa: float, angle: float) -> None:
    """Each picture is unrolled by the estimate before it; depth has 0.75 % of correlated noise."""
    _, _, depth = chart(kappa, angle)
    grid = CoarseGrid(INTRINSICS, np.zeros((HEIGHT, WIDTH), np.uint8), PlaneConfig(), 1)
    estimate, rng = WallCurvature(), np.random.default_rng(1)
    for _ in range(40):
        curvature = estimate.seen()
        noisy = depth * (1.0 + 0.0075 * np.kron(rng.standard_normal((24, 43)), np.ones((20, 20)))[:HEIGHT, :WIDTH])
        frame = RgbdFrame(
            stamp_ns=0,
            rgb=np.zeros((HEIGHT, WIDTH, 3), np.uint8),
            depth=noisy.astype(np.float32),
            intrinsics=INTRINSICS,
        )
        if curvature is not None:
            frame = unrolled(frame, PLANE, curvature, TIP)
        estimate.update(grid, grid.mean_inverse_depth(frame.depth), plane(grid), 1.0 / 30.0)
    assert np.abs(estimate.value - tensor(kappa, angle)).max() < 0.03
    assert np.abs(estimate.value - tensor(kappa, angle)).max() < 5.0 * math.sqrt(estimate.covariance.max())


def test_a_flat_wall_is_never_unrolled() -> None:
    fx, fy, cx, cy = INTRINSICS
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    depth = 1.0 / (PLANE[0] * (u - cx) / fx + PLANE[1] * (v - cy) / fy + PLANE[2])
    grid = CoarseGrid(INTRINSICS, np.zeros((HEIGHT, WIDTH), np.uint8), PlaneConfig(), 1)
    estimate, rng = WallCurvature(), np.random.default_rng(2)
    for _ in range(100):
        assert estimate.seen() is None
        noisy = depth * (1.0 + 0.0075 * np.kron(rng.standard_normal((24, 43)), np.ones((20, 20)))[:HEIGHT, :WIDTH])
        inverse = grid.mean_inverse_depth(noisy.astype(np.float32))
        estimate.update(grid, inverse, plane(grid), 1.0 / 30.0)
    assert np.abs(estimate.value).max() < 0.02


def plane(grid: CoarseGrid) -> PlaneEstimate:
    """The tangent plane, on all samples of the grid."""
    return PlaneEstimate(
        inverse_depth=PLANE,
        covariance=1e-6 * np.eye(3),
        normal=-NORMAL,
        distance_m=DISTANCE_M,
        inlier_share=1.0,
        residual_sigma=0.0075,
        component=np.ones(grid.shape, bool),
    )
