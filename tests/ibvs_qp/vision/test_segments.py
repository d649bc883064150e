"""What lies on both sides of segments, and on which of them the brighter side is."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.lines.borders import places_beside, ways_aside
from ibvs_qp.vision.lines.segments import edge_segments
from ibvs_qp.vision.picture.layout import PictureLayout
from ibvs_qp.vision.picture.picture import Picture
from sim.detection import own as every_segment


def two_tone(angle: float) -> np.ndarray:
    """A picture that is bright on one side of a line through its middle, towards an angle [rad]."""
    v, u = np.indices((240, 320))
    bright = (u - 160) * math.cos(angle) + (v - 120) * math.sin(angle) > 0.0
    grey = cv2.GaussianBlur(np.where(bright, 200, 60).astype(np.uint8), (0, 0), 0.7)
    return np.repeat(grey[..., None], 3, axis=2)


def ours(rgb: np.ndarray) -> np.ndarray:
    shape = rgb.shape[:2]
    frame = RgbdFrame(rgb=rgb, depth=np.zeros(shape, np.float32), intrinsics=(300.0, 300.0, 160.0, 120.0), stamp_ns=0)
    picture = Picture(frame, PictureLayout(frame, VisionConfig(), None))
    return edge_segments(picture, np.ones(picture.grid.shape, bool), 0.0)


def general(rgb: np.ndarray) -> np.ndarray:
    return every_segment.find_segments(rgb[..., 0], 0.5)


@pytest.mark.parametrize("finder", [ours, general])
@pytest.mark.parametrize("angle", np.radians([0.0, 40.0, 90.0, 180.0, 200.0, 270.0]).tolist())
def test_the_brighter_side_lies_to_the_left_of_a_segment(finder, angle: float) -> None:
    segments = finder(two_tone(angle))
    assert len(segments)
    run = (segments[:, 2:] - segments[:, :2]) / np.hypot(*(segments[:, 2:] - segments[:, :2]).T)[:, None]
    left = np.column_stack((run[:, 1], -run[:, 0]))  # v points down
    np.testing.assert_allclose(left @ (math.cos(angle), math.sin(angle)), 1.0, atol=0.01)


def test_side_0_of_a_segment_is_its_left() -> None:
    segments = np.array([[10.0, 19.5, 50.0, 19.5], [50.0, 19.5, 10.0, 19.5]])
    u, v = places_beside(segments, ways_aside(segments, 4.0), 9, margin=0.05)
    np.testing.assert_allclose(u[0], np.tile(np.linspace(12.0, 48.0, 9), (2, 1)))
    np.testing.assert_allclose(u[1], u[0, :, ::-1])
    assert v[:, :, 0].tolist() == [[15.5, 23.5], [23.5, 15.5]] and (v == v[:, :, :1]).all()  # v points down
