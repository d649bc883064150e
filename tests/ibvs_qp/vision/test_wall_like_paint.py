"""A wall of the paint's colour close behind a board: it is neither board nor paint."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from ibvs_qp.config import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.perception import Perception

SHAPE, INTRINSICS = (480, 640), (625.2, 625.2, 319.5, 239.5)
BOARD, WALL, PAINT = (52, 58, 64), (197, 188, 162), (232, 222, 190)
#: Depth of the board, and how much farther the wall lies [m].
DISTANCE_M, GAP_M = 0.855, 0.03
BOTTOM = 252
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def picture(right: int, index: int) -> RgbdFrame:
    """The bottom right corner of a board, noisy as at this distance; its right edge may run through a seed [px]."""
    random = np.random.default_rng([right, index])
    rgb = np.full((*SHAPE, 3), WALL, float)
    rgb[:BOTTOM, :right] = BOARD
    depth = np.full(SHAPE, DISTANCE_M + GAP_M)
    depth[:BOTTOM, :right] = DISTANCE_M
    smooth = cv2.GaussianBlur(random.standard_normal(SHAPE), (0, 0), 6.0)
    depth *= 1.0 + 0.005 * smooth / smooth.std() + 0.003 * random.standard_normal(SHAPE)
    noisy = np.clip(cv2.GaussianBlur(rgb, (0, 0), 0.8) + 4.0 * random.standard_normal(rgb.shape), 0, 255)
    return RgbdFrame(
        rgb=noisy.astype(np.uint8), depth=depth.astype(np.float32), intrinsics=INTRINSICS, stamp_ns=index * 33_000_000
    )


@pytest.mark.parametrize("right", range(362, 380, 3))
def test_the_board_and_its_edges_are_found_before_anything_is_painted(right: int) -> None:
    perception = Perception(VisionConfig(paint_color=PAINT), VehicleParams())
    results = [perception.process(picture(right, index), attitude=LEVEL, rotation=np.zeros(3)) for index in range(6)]
    result = results[-1]
    assert result.plane is not None and abs(result.plane.distance_m - DISTANCE_M) < 0.01
    [bottom] = [line for line in result.features.lines if line.role == "horizontal"]
    assert abs(abs(bottom.rho) - (BOTTOM - INTRINSICS[3]) / INTRINSICS[1]) * INTRINSICS[1] < 2.0
    assert perception._colors.paint is not None and np.array_equal(perception._colors.paint, PAINT)
