"""Pictures of turned and distorting cameras, rectified."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest

from ibvs_qp.estimation.turned_camera import TurnedCamera
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.picture.camera import RgbdCamera
from ibvs_qp.vision.picture.settings import RgbdCameraSettings

SIZE, INTRINSICS = (240, 320), (300.0, 310.0, 155.0, 118.0)
#: Of a wide lens: 12 px in the corners.
DISTORTION = (-0.25, 0.08, 0.001, -0.0015, 0.0)
CASES = {
    "turned": ((4.0, -6.0, 5.0), ()),
    "lens": ((0.0, 0.0, 0.0), DISTORTION),
    "turned lens": ((4.0, -6.0, 5.0), DISTORTION),
    "rolled by a right angle": ((90.0, 0.0, 0.0), ()),
}


def pixels() -> np.ndarray:
    rows, columns = np.mgrid[: SIZE[0], : SIZE[1]]
    return np.stack((columns, rows), axis=-1).reshape(-1, 2).astype(float)


def matrix(intrinsics: tuple[float, ...]) -> np.ndarray:
    fx, fy, cx, cy = intrinsics
    return np.array(((fx, 0.0, cx), (0.0, fy, cy), (0.0, 0.0, 1.0)))


def picture(
    rotation: np.ndarray, distortion: tuple[float, ...], intrinsics: tuple[float, float, float, float] = INTRINSICS
) -> RgbdFrame:
    """A sloped wall with smooth colours, by a camera with X_C = rotation X."""
    bent = np.array(distortion, float) if distortion else None
    rays = cv2.undistortPoints(pixels()[:, None], matrix(intrinsics), bent)[:, 0]
    real = np.column_stack((rays, np.ones(len(rays))))
    straight = real @ rotation.T
    depth = 1.0 / (straight @ (0.3, -0.2, 1.8))  # along the ray in C: 0.3 x - 0.2 y + 1.8 z = 1
    x, y = straight[:, 0] / straight[:, 2], straight[:, 1] / straight[:, 2]
    rgb = np.column_stack((127 + 120 * np.sin(9 * x), 127 + 120 * np.cos(8 * y), 127 + 100 * np.sin(6 * (x + y))))
    return RgbdFrame(
        rgb=np.rint(rgb).astype(np.uint8).reshape(*SIZE, 3),
        depth=depth.astype(np.float32).reshape(SIZE),  # the ray has depth 1 in the real camera
        intrinsics=intrinsics,
        stamp_ns=7,
    )


@pytest.mark.parametrize("case", CASES)
def test_a_rectified_picture_is_that_of_a_straight_camera_without_a_lens(case: str) -> None:
    turn, distortion = CASES[case]
    camera = TurnedCamera(turn)
    seen = picture(camera.rotation, distortion)
    found = RgbdCamera(RgbdCameraSettings(distortion=distortion), camera.rotation).picture(seen)
    expected = picture(np.eye(3), (), found.intrinsics)
    inside = found.depth > 0.0
    assert inside.mean() > (0.5 if turn[0] == 90.0 else 0.75)
    core = cv2.erode(inside.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    assert np.abs(found.rgb.astype(float) - expected.rgb)[core].mean() < 1.0
    assert np.abs(seen.rgb.astype(float) - expected.rgb)[core].mean() > 4.0
    assert np.abs(found.depth - expected.depth)[core].max() < 2e-3
    assert (found.intrinsics[:2], found.stamp_ns) == (INTRINSICS[:2], 7) and found.depth.dtype == np.float32


@pytest.mark.parametrize("turn_deg", [0.0, 8.0, -20.0])
def test_a_turned_camera_keeps_its_picture(turn_deg: float) -> None:
    """Without a new principal point a camera 20 degrees down would lose 100 of 240 rows."""
    camera = TurnedCamera((0.0, turn_deg, 0.0))
    found = RgbdCamera(mount=camera.rotation).picture(picture(camera.rotation, ()))
    assert (found.depth > 0.0).mean() > 0.85


def test_nothing_to_rectify_changes_nothing() -> None:
    seen = picture(np.eye(3), ())
    assert RgbdCamera().picture(seen) is seen


def test_a_picture_that_perception_refuses_is_passed_on() -> None:
    camera = RgbdCamera(mount=TurnedCamera((0.0, 5.0, 0.0)).rotation)
    seen = dataclasses.replace(picture(np.eye(3), ()), rgb="no picture")  # type: ignore[arg-type]
    assert camera.picture(seen) is seen
