"""Velocity from followed points, its parts against their definitions."""

from __future__ import annotations

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.config import FlowConfig, MaskConfig, VisionConfig
from ibvs_qp.vision.flow.motion import CameraMotion
from ibvs_qp.vision.flow.sparse_flow import (
    FlowVelocity,
    SparseFlow,
    expected_points,
    information_root,
    inverse_depths,
    solve_velocity,
)
from ibvs_qp.vision.picture.layout import PictureLayout, vehicle_mask

FOCAL, INTERVAL, CONFIG = 150.0, 0.033, FlowConfig()
INTRINSICS = (FOCAL, FOCAL, 79.5, 59.5)
STILL = CameraMotion(np.eye(3), np.zeros(3), np.zeros(3))


def test_roots_are_those_of_the_structure_tensor_less_noise() -> None:
    rng, reach = np.random.default_rng(1), CONFIG.window_px // 2
    grey = cv2.GaussianBlur(rng.integers(0, 256, (120, 160)).astype(np.uint8), (0, 0), 2.0)
    grey[40:80, :60] = np.where(np.arange(60) < 30, 40, 90)  # a lone edge: one direction alone tells
    points = rng.uniform((reach, reach), (159 - reach, 119 - reach), (50, 2)).astype(np.float32)
    points[0] = 30.0, 60.0
    gx, gy = (cv2.Sobel(grey, cv2.CV_64F, 1 - k, k, ksize=3, scale=0.125) for k in (0, 1))
    noise = CONFIG.grey_sigma**2
    floor = 2.0 * CONFIG.window_px**2 * 12.0 / 64.0 * noise
    for root, (u, v) in zip(information_root(grey, points, CONFIG), np.rint(points).astype(int), strict=True):
        part = np.s_[v - reach : v + reach + 1, u - reach : u + reach + 1]
        gradient = np.stack((gx[part].ravel(), gy[part].ravel()))
        values, vectors = np.linalg.eigh(gradient @ gradient.T)
        values = np.maximum(values - floor, 0.0) / noise
        values = np.sqrt(values / (1.0 + values * CONFIG.pixel_sigma**2))
        np.testing.assert_allclose(root, vectors * values @ vectors.T, rtol=1e-9, atol=1e-9)
    lone = information_root(grey, points, CONFIG)[0]
    assert lone[0, 0] > 10.0 and lone[1, 1] < 1e-9


def test_depth_of_a_point_is_the_surfaces_or_the_median_around_it() -> None:
    depth = np.full((120, 160), 2.0, np.float32)
    depth[:60:2], depth[80:, :80], depth[80:, 80:] = 0.0, np.nan, 1.0
    at = np.array([[40.0, 71.0], [40.0, 20.0], [20.0, 100.0], [120.0, 100.0], [np.nan, 1e30]])
    bearings = (at - INTRINSICS[2:]) / FOCAL
    surface = SimpleNamespace(inverse_depth=np.array([0.0, 0.0, 0.51]), residual_sigma=0.01)
    assert inverse_depths(bearings[:4], depth, INTRINSICS, None).tolist() == [0.5, 0.0, 0.0, 1.0]
    assert inverse_depths(bearings, depth, INTRINSICS, surface)[:4].tolist() == [0.51, 0.0, 0.0, 1.0]


def moved(count: int, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places of points before and after a camera that does not turn moved at a velocity in C, and their 1/Z."""
    rng = np.random.default_rng(4)
    still, inverse = rng.uniform(-0.4, 0.4, (count, 2)), rng.uniform(0.5, 2.0, count)
    points = np.column_stack((still, np.ones(count))) / inverse[:, None] - velocity * INTERVAL
    return still, points[:, :2] / points[:, 2:], inverse


def solve(still: np.ndarray, end: np.ndarray, inverse: np.ndarray) -> FlowVelocity | str:
    """Velocity by points that all tell as much."""
    root = np.broadcast_to(5.0 * np.eye(2), (len(still), 2, 2)).copy()
    return solve_velocity(still, end, inverse, root, FOCAL, INTERVAL, np.zeros(3), np.zeros(3), CONFIG)


def test_velocity_is_found_whatever_a_few_points_do() -> None:
    velocity = np.array([0.3, -0.2, 0.1])
    still, end, inverse = moved(40, velocity)
    end[:6] += 0.1
    found = solve(still, end, inverse)
    assert isinstance(found, FlowVelocity) and 30 <= found.points <= 34
    np.testing.assert_allclose(R_BODY_CAMERA.T @ found.velocity, velocity, atol=0.01)
    assert (np.linalg.eigvalsh(found.covariance) > 0.0).all()


def test_points_that_tell_nothing_give_no_velocity() -> None:
    still, end, inverse = moved(40, np.array([0.3, -0.2, 0.1]))
    assert solve(still[:3], end[:3], inverse[:3]) == "too few points agree"
    assert solve(still[:0], end[:0], inverse[:0]) == "too few points agree"
    assert solve(*moved(40, np.array([90.0, 0.0, 0.0]))) == "faster than possible"


def test_expected_points_are_where_they_are_found() -> None:
    velocity = np.array([0.3, -0.2, 0.0])
    still, end, inverse = moved(40, velocity)
    np.testing.assert_allclose(
        expected_points(still, inverse, velocity, INTERVAL, INTRINSICS), end * FOCAL + INTRINSICS[2:], atol=1e-4
    )


@pytest.mark.parametrize(("texture", "screw"), [(3.0, 40.0), (0.0, 170.0)])
def test_weak_texture_is_followed_beside_a_strong_corner(texture: float, screw: float) -> None:
    """A dark screw is a corner 1000 times as strong as the texture; corners of noise give no sure velocity."""
    rng, focal, speed, depth_m = np.random.default_rng(7), 320.0, 0.1, 0.5
    board = cv2.GaussianBlur(rng.standard_normal((480, 900)), (0, 0), 6.0)
    board = 200.0 + texture * board / board.std()
    cv2.circle(board, (400, 240), 7, screw, -1)
    flow, found = SparseFlow(CONFIG, np.zeros(3)), []
    for number in range(20):
        shift = np.array([[1.0, 0.0, -number * INTERVAL * speed / depth_m * focal], [0.0, 1.0, 0.0]])
        grey = cv2.warpAffine(board, shift, (640, 480), flags=cv2.INTER_CUBIC) + rng.normal(0.0, 2.0, (480, 640))
        rgb = np.repeat(np.clip(np.rint(grey), 0, 255).astype(np.uint8)[:, :, None], 3, axis=2)
        depth, stamp_ns = np.full((480, 640), depth_m, np.float32), round((1 + number) * INTERVAL * 1e9)
        frame = RgbdFrame(rgb=rgb, depth=depth, intrinsics=(focal, focal, 319.5, 239.5), stamp_ns=stamp_ns)
        found.append(flow.measure_velocity(frame, np.zeros((240, 320), np.uint8), STILL, None, busy=False))
    velocities = [R_BODY_CAMERA.T @ each.velocity for each in found[1:] if isinstance(each, FlowVelocity)]
    if texture == 0.0:
        deviations = [np.sqrt(each.covariance[1, 1]) for each in found if isinstance(each, FlowVelocity)]
        assert deviations and min(deviations) > 0.02
        return
    assert len(velocities) == 19
    np.testing.assert_allclose(np.mean(velocities, axis=0)[:2], (speed, 0.0), atol=0.005)


def test_the_edge_of_the_arm_is_not_taken_for_a_wall_that_stands_still() -> None:
    """A faint board that moves by 8 px a picture behind a black arm, which stands still in every one."""
    shape, focal, distance, step = (480, 640), 600.0, 0.45, 8
    vehicle, config = VehicleParams(), VisionConfig()
    intrinsics = (focal, focal, 319.5, 239.5)
    rng = np.random.default_rng(2)
    wall = cv2.GaussianBlur(rng.normal(170.0, 18.0, (480, 1200)), (0, 0), 3.0)
    wall[60:] = cv2.GaussianBlur(rng.normal(90.0, 1.0, (420, 1200)), (0, 0), 3.0)  # paint, up to a level edge
    arm = vehicle_mask(vehicle, config.brush_width_m, MaskConfig(margin_px=0.0), intrinsics, shape) > 0
    depth = np.full(shape, distance, np.float32)
    flow, velocities = SparseFlow(config.flow, np.array(vehicle.camera_position_m)), []
    for picture in range(12):
        grey = wall[:, picture * step : picture * step + shape[1]] + rng.normal(0.0, 2.0, shape)
        grey[arm] = 20.0
        rgb = np.repeat(grey.clip(0, 255).astype(np.uint8)[:, :, None], 3, axis=2)
        frame = RgbdFrame(rgb=rgb, depth=depth, intrinsics=intrinsics, stamp_ns=picture * 33_000_000)
        excluded = PictureLayout(frame, config, vehicle).excluded
        found = flow.measure_velocity(frame, excluded, STILL, None, busy=False)
        if picture:
            assert isinstance(found, FlowVelocity)
            velocities.append((R_BODY_CAMERA.T @ found.velocity)[0])
    np.testing.assert_allclose(velocities, step * distance / focal / 0.033, atol=0.005)
