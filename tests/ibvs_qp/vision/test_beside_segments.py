"""What lies on both sides of segments, and on which of them the brighter side is."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from ibvs_qp.vision.kernels.beside import cells_beside, labels_beside
from ibvs_qp.vision.kernels.segments import SEGMENT, find_segments
from sim.detection import segments as every_segment


def two_tone(angle: float) -> np.ndarray:
    """A picture that is bright on one side of a line through its middle, towards an angle [rad]."""
    v, u = np.indices((240, 320))
    bright = (u - 160) * math.cos(angle) + (v - 120) * math.sin(angle) > 0.0
    grey = cv2.GaussianBlur(np.where(bright, 200, 60).astype(np.uint8), (0, 0), 0.7)
    return np.repeat(grey[..., None], 3, axis=2)


def ours(rgb: np.ndarray) -> np.ndarray:
    found = np.empty((20, SEGMENT))
    mask, cells = np.zeros(rgb.shape[:2], np.uint8), np.ones((30, 40), np.uint8)
    return found[: find_segments(rgb, mask, 1, cells, 8, 6.0, 20.0, math.nan, 15.0, found), :4]


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


def test_labels_and_cells_beside_segments() -> None:
    """Side 0 is the left; beyond the picture the border's label holds, beyond the grid there is no cell."""
    rgb = np.zeros((40, 60, 3), np.uint8)
    rgb[:20] = 255  # above the segments
    table = np.zeros(1 << 15, np.uint8)
    table[-1] = 2
    segments = np.array([[10.0, 19.5, 50.0, 19.5], [50.0, 19.5, 10.0, 19.5], [-30.0, -50.0, 90.0, -50.0]])
    labels = np.empty((3, 2, 9), np.uint8)
    labels_beside(rgb, segments, 0.05, 4.0, np.empty(0, np.uint8), table, labels)
    assert labels[:, :, 0].tolist() == [[2, 0], [0, 2], [2, 2]]
    assert (labels == labels[:, :, :1]).all()
    cells = np.zeros((5, 8), np.uint8)
    cells[:2, 2:] = 1  # samples from u = 20 on, v up to 12
    found = np.empty((3, 2, 10), np.uint8)
    cells_beside(cells, segments, 8.0, 8.0, 4.0, found)
    assert found[0].tolist() == [[0] + [1] * 9, [0] * 10]
    assert found[1].tolist() == [[0] * 10, [1] * 9 + [0]]
    assert not found[2].any()
