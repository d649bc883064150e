"""Depth of a camera beside the colour camera: at the right place, occluded by what is nearer, without cracks."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest

from ibvs_qp.frames import rotation_from_vector
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.checks import PictureGate
from ibvs_qp.vision.picture.camera import RgbdCamera
from ibvs_qp.vision.picture.settings import RgbdCameraSettings

SHAPE, INTRINSICS = (240, 320), (305.0, 305.0, 160.0, 121.0)
DEPTH_SHAPE, DEPTH_INTRINSICS = (200, 340), (180.0, 182.0, 171.0, 98.0)
TURN, SHIFT, LENS = (0.01, -0.02, 0.03), (0.05, -0.004, 0.006), (0.1, -0.15, 0.001, -0.001, 0.0)
BESIDE = RgbdCameraSettings(depth_intrinsics=DEPTH_INTRINSICS, depth_rotation=TURN, depth_translation_m=SHIFT)
#: 1/Z = a x + b y + c of the wall in the colour camera [1/m], and of the board before it.
WALL, BOARD = np.array((0.06, -0.1, 0.9)), np.array((0.02, 0.05, 1.4))


def rays(shape: tuple[int, int], intrinsics: tuple[float, ...], lens: tuple[float, ...] = ()) -> np.ndarray:
    """(x, y, 1) of every pixel, (H W, 3)."""
    fx, fy, cx, cy = intrinsics
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    pixels = np.stack((columns, rows), axis=-1).reshape(-1, 1, 2).astype(float)
    matrix, bent = np.array(((fx, 0, cx), (0, fy, cy), (0, 0, 1.0))), np.array(lens) if lens else None
    return np.column_stack((cv2.undistortPoints(pixels, matrix, bent)[:, 0], np.ones(rows.size)))


def seen_by_depth_camera(plane: np.ndarray, lens: tuple[float, ...] = ()) -> np.ndarray:
    """Depth [m] of a plane of the colour camera in the picture of the depth camera."""
    rotation = rotation_from_vector(TURN)
    own = plane @ rotation / (1.0 - plane @ SHIFT)  # plane . (R Y + t) = 1
    return (1.0 / (rays(DEPTH_SHAPE, DEPTH_INTRINSICS, lens) @ own)).reshape(DEPTH_SHAPE)


def seen_by_color_camera(plane: np.ndarray, intrinsics: tuple[float, ...] = INTRINSICS) -> np.ndarray:
    return (1.0 / (rays(SHAPE, intrinsics) @ plane)).reshape(SHAPE)


def raw(depth: np.ndarray) -> RgbdFrame:
    return RgbdFrame(rgb=np.zeros((*SHAPE, 3), np.uint8), depth=depth, intrinsics=INTRINSICS, stamp_ns=3)


@pytest.mark.parametrize("lens", [(), LENS], ids=["no lens", "lens"])
def test_a_plane_lies_where_the_colour_camera_sees_it(lens: tuple[float, ...]) -> None:
    settings = dataclasses.replace(BESIDE, depth_distortion=lens)
    found = RgbdCamera(settings).picture(raw(seen_by_depth_camera(WALL, lens).astype(np.float32)))
    inside = found.depth[20:-20, 30:-30]
    assert (inside > 0.0).all(), "no cracks"
    error = np.abs(inside - seen_by_color_camera(WALL)[20:-20, 30:-30])
    assert error.max() < 2e-3 and error.mean() < 4e-4, "half a reading's width on the slope"
    assert found.depth.dtype == np.float32 and found.depth.shape == SHAPE and found.stamp_ns == 3


def test_a_turned_colour_camera_gets_depth_in_its_straightened_picture() -> None:
    mount = rotation_from_vector((0.05, -0.08, 0.04))
    depth = seen_by_depth_camera(WALL).astype(np.float32)
    found = RgbdCamera(dataclasses.replace(BESIDE, distortion=LENS), mount).picture(raw(depth))
    expected = seen_by_color_camera(mount @ WALL, found.intrinsics)
    known = found.depth > 0.0
    assert known.mean() > 0.85
    assert np.abs(found.depth - expected)[known].max() < 3e-3


def scene() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Depth picture of a board before a wall, the board's left and right column in the colour picture, as depth."""
    near, far = seen_by_depth_camera(BOARD), seen_by_depth_camera(WALL)
    points = rays(DEPTH_SHAPE, DEPTH_INTRINSICS) * near.reshape(-1, 1)
    in_color = points @ rotation_from_vector(TURN).T + SHIFT
    x = (in_color[:, 0] / in_color[:, 2]).reshape(DEPTH_SHAPE)
    on_board = np.abs(x) < 0.2
    ends = 160.0 + 305.0 * np.array((-0.2, 0.2))
    return np.where(on_board, near, far).astype(np.float32), ends, on_board


def test_what_the_depth_camera_cannot_see_has_no_depth_and_what_is_nearer_hides() -> None:
    depth, (left, right), _ = scene()
    found = RgbdCamera(BESIDE).picture(raw(depth)).depth[60:180]
    board, wall = seen_by_color_camera(BOARD)[60:180], seen_by_color_camera(WALL)[60:180]
    columns = np.arange(SHAPE[1])
    inside = found[:, (columns > left + 2) & (columns < right - 2)]
    assert np.abs(inside - board[:, (columns > left + 2) & (columns < right - 2)]).max() < 2e-3, "no wall in it"
    # The depth camera stands 5 cm to the right: 305 px * 5 cm * (1.4 - 0.9) / m = 7.6 px left of the board are hidden.
    shadow = found[:, (columns > left - 5) & (columns < left - 2)]
    assert (shadow == 0.0).mean() > 0.95
    beyond = (columns > right + 3) & (columns < right + 30)
    assert np.abs(found[:, beyond] - wall[:, beyond]).max() < 4e-3


def test_gaps_of_one_pixel_are_closed_and_wider_ones_are_not() -> None:
    same = RgbdCameraSettings(depth_intrinsics=INTRINSICS, depth_translation_m=(0.0, 0.0, 0.0))
    depth = np.full(SHAPE, 0.8, np.float32)
    depth[:, 100], depth[:, 150:152], depth[50, 200:220], depth[80, 40] = 0.0, 0.0, 1.5, 0.3
    found = RgbdCamera(same).picture(raw(depth)).depth
    assert np.allclose(found[:, 100], 0.8) and (found[2:-2, 150:152] == 0.0).all()
    assert np.allclose(found[50, 200:220], 0.8), "a surface behind a crack of another"
    assert found[80, 40] == np.float32(0.3), "what is nearer is no crack"


def test_readings_that_cannot_be_used_are_left_out() -> None:
    depth, _, _ = scene()
    depth[::3, ::3] = np.nan
    depth[1::3, 1::3], depth[2::3, 2::3] = np.inf, -1.0
    depth[::7], depth[:, ::11] = 1e38, 1e-38
    found = RgbdCamera(BESIDE).picture(raw(depth)).depth
    assert np.isfinite(found).all() and (found >= 0.0).all()


def test_what_perception_refuses_is_named_by_it_and_counted_once() -> None:
    depth = seen_by_depth_camera(WALL).astype(np.float32)
    gate, perception = PictureGate(), PictureGate()
    camera = RgbdCamera(BESIDE, problem=gate.problem)
    other = tuple(0.5 * entry for entry in INTRINSICS)
    reasons = []
    for intrinsics in (INTRINSICS, *[other] * 6):
        frame = dataclasses.replace(raw(depth), intrinsics=intrinsics)
        reasons.append(perception.problem(camera.picture(frame)))
    assert reasons[0] is None and reasons[5:] == [None, None]
    assert reasons[1] == "another intrinsics than the pictures before, 1 of 5 until it is followed"
    assert "depth picture of shape" in str(perception.problem(camera.picture(raw(depth[None]))))
    wrong = dataclasses.replace(raw(depth), rgb="none")  # type: ignore[arg-type]
    assert "colour picture is a" in str(perception.problem(camera.picture(wrong)))
