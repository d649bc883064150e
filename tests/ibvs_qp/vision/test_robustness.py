"""Nothing raises, nothing jumps: broken pictures, the roll seam, loss and return, blank and edge-only views."""

from __future__ import annotations

import functools
import itertools
import math
import time
from dataclasses import replace

import cv2
import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import align_line
from ibvs_qp.interfaces.overlay import draw_overlay
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision import Perception, VisionConfig
from ibvs_qp.vision.paper.config import PaperConfig
from ibvs_qp.vision.paper.perception import PaperPerception

INTRINSICS = (625.2, 625.2, 319.5, 239.5)
SHAPE = (480, 640)
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
STEP_NS = 33_333_333
BOARD, PAINT = np.array([225.0, 228.0, 220.0]), (40, 90, 200)


@functools.cache
def wall_texture(seed: int) -> np.ndarray:
    """Brick-like wall, float (H, W, 3)."""
    rng = np.random.default_rng(seed)
    blotches = cv2.GaussianBlur(rng.standard_normal(SHAPE), (0, 0), 4.0)
    wall = np.array([150.0, 115.0, 95.0]) + 14.0 * (blotches / blotches.std())[..., None]
    wall[::37] += 40.0
    wall[:, ::71] += 40.0
    return wall


_NOISE = np.random.default_rng(7).standard_normal((SHAPE[0] + 64, SHAPE[1] + 64, 4)).astype(np.float32)


def noise_of(rng: np.random.Generator) -> np.ndarray:
    """Unit noise (H, W, 4) from a random place of one bank."""
    row, column = rng.integers(0, 64, 2)
    return _NOISE[row : row + SHAPE[0], column : column + SHAPE[1]]


def frame(
    k: int,
    *,
    roll: float = 0.0,
    edge_v: float = 210.0,
    shift: float = 0.0,
    seed: int = 0,
    wall: np.ndarray | None = None,
    distance: float = 0.5,
) -> RgbdFrame:
    """Board above a straight edge turned by `roll` about the principal point, wall 5 cm behind below it."""
    rng = np.random.default_rng([seed, k])
    u, v = np.meshgrid(np.arange(SHAPE[1]) - INTRINSICS[2], np.arange(SHAPE[0]) - INTRINSICS[3])
    across = -u * math.sin(roll) + v * math.cos(roll) - (edge_v - INTRINSICS[3])
    share = np.clip(0.5 - across / 1.6, 0.0, 1.0)[..., None]
    behind = wall_texture(seed) if wall is None else wall
    behind = np.roll(behind, round(shift), axis=1)
    noise = noise_of(rng)
    rgb = share * BOARD + (1.0 - share) * behind + 2.0 * noise[..., :3]
    depth = np.where(across < 0, distance, distance + 0.05) * (1.0 + 0.005 * noise[..., 3])
    depth[np.abs(across) < 2.0] = 0.0
    return RgbdFrame(
        rgb=np.clip(np.round(rgb), 0, 255).astype(np.uint8),
        depth=depth.astype(np.float32),
        intrinsics=INTRINSICS,
        stamp_ns=(k + 1) * STEP_NS,
    )


def perception() -> Perception:
    return Perception(VisionConfig(paint_color=PAINT), VehicleParams())


GOOD = frame(0)
BROKEN = {
    "grey": RgbdFrame(rgb=GOOD.rgb[..., 0], depth=GOOD.depth, intrinsics=INTRINSICS, stamp_ns=1),
    "float colour": RgbdFrame(rgb=GOOD.rgb / 255.0, depth=GOOD.depth, intrinsics=INTRINSICS, stamp_ns=1),
    "other size": RgbdFrame(rgb=GOOD.rgb, depth=GOOD.depth[:240], intrinsics=INTRINSICS, stamp_ns=1),
    "tiny": RgbdFrame(rgb=GOOD.rgb[:20, :20], depth=GOOD.depth[:20, :20], intrinsics=INTRINSICS, stamp_ns=1),
    "millimetres": RgbdFrame(
        rgb=GOOD.rgb, depth=(1000 * GOOD.depth).astype(np.uint16), intrinsics=INTRINSICS, stamp_ns=1
    ),
    "millimetres as float": replace(GOOD, depth=1000 * GOOD.depth),
    "masked depth": replace(GOOD, depth=np.ma.array(GOOD.depth)),
    "large": replace(GOOD, rgb=np.broadcast_to(GOOD.rgb[:1], (5000, 640, 3)), depth=np.ones((5000, 640), np.float32)),
    "far intrinsics": replace(GOOD, intrinsics=(600.0, 600.0, 1e300, 0.0)),
    "intrinsics of text": replace(GOOD, intrinsics=("600", "600", "320", "240")),
    "zero depth": RgbdFrame(rgb=GOOD.rgb, depth=0 * GOOD.depth, intrinsics=INTRINSICS, stamp_ns=1),
    "NaN depth": RgbdFrame(rgb=GOOD.rgb, depth=np.nan * GOOD.depth, intrinsics=INTRINSICS, stamp_ns=1),
    "infinite depth": RgbdFrame(rgb=GOOD.rgb, depth=GOOD.depth + np.float32(np.inf), intrinsics=INTRINSICS, stamp_ns=1),
    "negative depth": RgbdFrame(rgb=GOOD.rgb, depth=-GOOD.depth, intrinsics=INTRINSICS, stamp_ns=1),
    "intrinsics": RgbdFrame(rgb=GOOD.rgb, depth=GOOD.depth, intrinsics=(0.0, 0.0, 0.0, math.nan), stamp_ns=1),
    "no intrinsics": RgbdFrame(rgb=GOOD.rgb, depth=GOOD.depth, intrinsics=None, stamp_ns=1),  # type: ignore[arg-type]
    "no picture": RgbdFrame(rgb=None, depth=None, intrinsics=INTRINSICS, stamp_ns=1),  # type: ignore[arg-type]
}


def test_a_wrong_unit_of_depth_is_named() -> None:
    for name, reason in {
        "millimetres": "depth picture of type uint16, metres in floating point are needed",
        "millimetres as float": "metres are needed, these look like millimetres",
    }.items():
        refused = perception().process(BROKEN[name], attitude=LEVEL).refused
        assert refused is not None and reason in refused


@pytest.mark.parametrize("name", BROKEN)
def test_broken_pictures_are_refused_and_forgotten(name: str) -> None:
    eye = perception()
    first = eye.process(BROKEN[name], attitude=LEVEL)
    assert first.refused and first.features.plane is None and not first.features.lines
    for k in range(6):
        perceived = eye.process(frame(k), attitude=LEVEL, rotation=np.zeros(3))
    again = eye.process(BROKEN[name], attitude=LEVEL)
    assert again.refused and again.features.plane is None
    perceived = eye.process(frame(8), attitude=LEVEL, rotation=np.zeros(3))
    assert perceived.refused is None and perceived.features.lines


@pytest.mark.parametrize("bad", [np.full(3, np.nan), np.zeros(2), "text"])
def test_bad_gyro_and_attitude_do_not_raise(bad) -> None:
    eye = perception()
    for k in range(3):
        perceived = eye.process(frame(k), attitude=np.full(4, np.nan), rotation=bad, velocity=bad)
    assert perceived is not None


def test_random_noise_pictures_never_raise_and_give_no_lines() -> None:
    eye, rng = perception(), np.random.default_rng(0)
    for k in range(10):
        noise = RgbdFrame(
            rgb=rng.integers(0, 256, (*SHAPE, 3), dtype=np.uint8),
            depth=rng.uniform(0, 8, SHAPE).astype(np.float32),
            intrinsics=INTRINSICS,
            stamp_ns=(k + 1) * STEP_NS,
        )
        assert not eye.process(noise, attitude=LEVEL).features.lines


def test_flat_pictures_without_any_edge() -> None:
    eye = perception()
    for k in range(8):
        rng = np.random.default_rng(k)
        rgb = np.clip(BOARD + rng.normal(0, 2.0, (*SHAPE, 3)), 0, 255).astype(np.uint8)
        depth = (0.5 * (1 + 0.005 * rng.standard_normal(SHAPE))).astype(np.float32)
        perceived = eye.process(
            RgbdFrame(rgb=rgb, depth=depth, intrinsics=INTRINSICS, stamp_ns=(k + 1) * STEP_NS), attitude=LEVEL
        )
        assert perceived.plane is not None and not perceived.features.lines
        velocity = perceived.features.velocity
        if velocity is None:
            assert perceived.velocity_refused
        else:  # noise corners may be followed: then the covariance says that it is worth nothing
            sigma = np.sqrt(np.diag(perceived.features.velocity_covariance))
            assert (np.abs(velocity) < 5.0 * sigma).all()


def test_lone_edge_shows_only_the_motion_across_it() -> None:
    eye = perception()
    plain = np.broadcast_to(np.array([120.0, 100.0, 90.0]), (*SHAPE, 3))
    for k in range(12):
        perceived = eye.process(frame(k, edge_v=210.0 + 2.0 * k, wall=plain), attitude=LEVEL, rotation=np.zeros(3))
    if perceived.features.velocity is None:
        assert perceived.velocity_refused
        return
    covariance = perceived.features.velocity_covariance
    assert covariance is not None
    assert math.sqrt(covariance[1, 1]) > 10.0 * math.sqrt(covariance[2, 2]) or math.sqrt(covariance[1, 1]) > 0.1


def test_roll_sweep_through_every_seam_without_a_jump() -> None:
    eye, step = perception(), math.radians(3.0)
    camera = np.array(VehicleParams().camera_position_m)
    identity, before, errors = 0, 0.0, []
    for k in range(121):
        roll = k * step
        attitude = np.array([math.cos(-0.5 * roll), math.sin(-0.5 * roll), 0.0, 0.0])
        turn = np.array([-step if k else 0.0, 0.0, 0.0])
        # the pictures turn about the camera: the body's own centre then moves so that the lever arm cancels
        velocity = -np.cross(turn, camera) / (STEP_NS * 1e-9)
        perceived = eye.process(frame(k, roll=roll, edge_v=220.0), attitude=attitude, rotation=turn, velocity=velocity)
        if k < 4:
            continue
        lines = [line for line in perceived.features.lines if line.kind == "board"]
        assert len(lines) == 1
        identity = identity or lines[0].track_id
        assert lines[0].track_id == identity and lines[0].weight > 0.0
        true_rho, true_theta = align_line((220.0 - INTRINSICS[3]) / INTRINSICS[0], 0.5 * math.pi + roll, lines[0].theta)
        errors.append((abs(lines[0].rho - true_rho), abs(lines[0].theta - true_theta)))
        if k > 4:
            assert abs(lines[0].theta - before - step) < 0.005, "theta must go on smoothly past every seam"
        before = lines[0].theta
    assert before > 1.5 * math.pi
    assert np.median(errors, axis=0)[0] * INTRINSICS[0] < 0.1
    assert np.max(errors) < 0.005


def test_loss_fades_and_is_held_no_longer_than_allowed() -> None:
    eye = perception()
    for k in range(8):
        perceived = eye.process(frame(k), attitude=LEVEL, rotation=np.zeros(3))
    track = perceived.features.lines[0].track_id
    blank = np.broadcast_to(np.array([128.0, 128.0, 128.0]), (*SHAPE, 3))
    weights = []
    for k in range(8, 24):
        good = frame(k)
        hidden = RgbdFrame(
            rgb=np.ascontiguousarray(blank, np.uint8), depth=good.depth, intrinsics=INTRINSICS, stamp_ns=good.stamp_ns
        )
        perceived = eye.process(hidden, attitude=LEVEL, rotation=np.zeros(3))
        weights.append(next((line.weight for line in perceived.features.lines if line.track_id == track), 0.0))
    assert weights[0] > 0.8
    assert all(0.0 <= a - b <= 0.15 for a, b in itertools.pairwise(weights) if a > 0.0)
    assert weights[10] == 0.0
    for k in range(24, 32):
        perceived = eye.process(frame(k), attitude=LEVEL, rotation=np.zeros(3))
    assert any(line.kind == "board" and line.weight == 1.0 for line in perceived.features.lines)


def test_new_line_needs_two_pictures() -> None:
    eye = perception()
    assert not eye.process(frame(0), attitude=LEVEL).features.lines
    assert eye.process(frame(1), attitude=LEVEL).features.lines


def test_covariance_of_the_line_is_honest() -> None:
    truth = np.array([(210.0 - INTRINSICS[3]) / INTRINSICS[0], 0.5 * math.pi])
    distances = []
    for seed in range(12):
        eye = perception()
        for k in range(3):
            perceived = eye.process(frame(k, seed=seed), attitude=LEVEL, rotation=np.zeros(3))
        line = perceived.features.lines[0]
        error = np.array([line.rho, line.theta]) - truth
        distances.append(float(error @ np.linalg.solve(line.covariance, error)))
    assert np.mean(distances) < 6.0  # 2 expected


def test_overlay_keeps_the_picture_and_marks_the_line() -> None:
    eye = perception()
    for k in range(4):
        picture = frame(k)
        perceived = eye.process(picture, attitude=LEVEL, rotation=np.zeros(3))
    before = picture.rgb.copy()
    drawn = draw_overlay(picture.rgb, perceived)
    assert drawn.shape == before.shape and drawn.dtype == np.uint8
    assert np.array_equal(picture.rgb, before)
    assert (drawn[209:212, 500] != before[209:212, 500]).any()
    refused = eye.process(BROKEN["zero depth"], attitude=LEVEL)
    assert draw_overlay(picture.rgb, refused).shape == before.shape


def resized(k: int, width: int, height: int) -> RgbdFrame:
    """The board's picture in another size, by its rows and columns repeated."""
    small = frame(k)
    rows, columns = np.arange(height) * SHAPE[0] // height, np.arange(width) * SHAPE[1] // width
    scale = width / SHAPE[1]
    fx, fy, cx, cy = INTRINSICS
    return replace(
        small,
        rgb=np.ascontiguousarray(small.rgb[rows][:, columns]),
        depth=np.ascontiguousarray(small.depth[rows][:, columns]),
        intrinsics=(fx * scale, fy * scale, cx * scale, cy * scale),
    )


@pytest.mark.parametrize("size", [(1920, 1080), (1201, 1601), (64, 4096)])
def test_no_accepted_size_stalls(size: tuple[int, int]) -> None:
    begin = time.thread_time()
    assert "too large" not in (perception().process(resized(0, *size), attitude=LEVEL).refused or "")
    assert time.thread_time() - begin < 0.25, "the masks alone took 0.3 s and more"


@pytest.mark.parametrize(
    "pipeline", [perception, lambda: PaperPerception(PaperConfig(), VisionConfig(), VehicleParams())]
)
def test_a_picture_beyond_full_hd_is_refused_in_flight(pipeline) -> None:
    refused = pipeline().process(resized(0, 2048, 1536)).refused
    assert refused is not None and "2048 x 1536 px is too large" in refused


@pytest.mark.parametrize("what", ["size", "intrinsics"])
def test_another_camera_is_followed_once_it_lasts(what: str) -> None:
    def other(k: int) -> RgbdFrame:
        return resized(k, 424, 240) if what == "size" else replace(frame(k), intrinsics=(620.0, 620.0, 319.5, 239.5))

    eye = perception()
    seen = [eye.process(other(k) if k % 2 else frame(k), attitude=LEVEL).refused for k in range(11)]
    assert seen[::2] == [None] * 6
    assert all(reason is not None and f"another {what}" in reason for reason in seen[1::2])
    lasting = [eye.process(other(k), attitude=LEVEL).refused for k in range(11, 17)]
    assert all(lasting[:4]) and lasting[4:] == [None, None]
    eye.reset()
    assert eye.process(frame(18), attitude=LEVEL).refused is None, "a new flight begins with any camera"
