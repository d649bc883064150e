"""Canny and the probabilistic Hough transform within the box, then the slope threshold."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.vision.paper.config import PaperConfig

#: Pixels of the full picture to one of the down-sampled one.
_DOWN = 2


@dataclass(frozen=True, kw_only=True)
class Segments:
    """Straight segments in the full picture.

    Attributes:
        level: Segments within the slope threshold of level, (n, 2, 2) [px], the Hough transform's order.
        upright: Likewise of upright.
    """

    level: np.ndarray
    upright: np.ndarray


class SegmentFinder:
    """Finds level and upright segments in a part of the picture.

    Args:
        shape: (height, width) of the pictures [px].
        hidden: Vehicle's mask, uint8 (height, width), or None.
        config: Settings.
    """

    def __init__(self, shape: tuple[int, int], hidden: np.ndarray | None, config: PaperConfig) -> None:
        self._config, self._scale = config, shape[1] / 640.0
        half = (shape[0] // _DOWN, shape[1] // _DOWN)
        self._grey, self._small, self._edges = (np.zeros(size, np.uint8) for size in (shape, half, half))
        self._hidden = None
        if hidden is not None and hidden.any():
            # the vehicle's outline is an edge too: two pixels more than the hidden part
            size = (half[1], half[0])
            small = cv2.resize(hidden, size, interpolation=cv2.INTER_AREA)
            self._hidden = cv2.dilate(np.where(small > 0, np.uint8(255), np.uint8(0)), np.ones((5, 5), np.uint8))

    def find(self, rgb: np.ndarray, box: tuple[float, float, float, float]) -> Segments:
        """Segments within (left, top, right, bottom) [px], which may reach out of the picture."""
        height, width = self._small.shape
        c0, c1 = max(0, int(box[0]) // _DOWN), min(width, math.ceil(box[2] / _DOWN) + 1)
        r0, r1 = max(0, int(box[1]) // _DOWN), min(height, math.ceil(box[3] / _DOWN) + 1)
        empty = np.zeros((0, 2, 2))
        if c1 - c0 < 8 or r1 - r0 < 8:
            return Segments(level=empty, upright=empty)
        part = np.s_[r0 * _DOWN : r1 * _DOWN, c0 * _DOWN : c1 * _DOWN]
        grey, small, edges = self._grey[part], self._small[r0:r1, c0:c1], self._edges[r0:r1, c0:c1]
        cv2.cvtColor(rgb[part], cv2.COLOR_RGB2GRAY, grey)
        cv2.resize(grey, (c1 - c0, r1 - r0), small, interpolation=cv2.INTER_AREA)
        config = self._config
        cv2.Canny(small, config.canny_low, config.canny_high, edges)
        if self._hidden is not None:
            cv2.bitwise_and(edges, cv2.bitwise_not(self._hidden[r0:r1, c0:c1]), edges)
        step = math.radians(config.hough_angle_deg)
        scale = self._scale / _DOWN
        votes, gap = max(5, round(config.hough_votes * self._scale)), max(1.0, config.max_gap_px * scale)
        lines = cv2.HoughLinesP(edges, 1.0, step, votes, None, config.min_length_px * scale, gap)
        if lines is None:
            return Segments(level=empty, upright=empty)
        # an averaged pixel's centre lies between those of its four
        ends = (lines.reshape(-1, 2, 2) + np.array([c0, r0])) * float(_DOWN) + 0.5 * (_DOWN - 1)
        return _by_slope(ends, config.slope_deg)


def _by_slope(ends: np.ndarray, slope_deg: float) -> Segments:
    run = np.abs(ends[:, 1] - ends[:, 0])
    limit = math.tan(math.radians(slope_deg))
    return Segments(level=ends[run[:, 1] <= limit * run[:, 0]], upright=ends[run[:, 0] <= limit * run[:, 1]])
