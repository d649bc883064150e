"""Votes for lines: gradients at half resolution, a Hough transform restricted to around level and upright."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.plane import PlaneEstimate

#: Voted lines looked at per orientation and polarity, before suppression, and kept after it.
_VOTED, _KEPT = 40, 5
#: Lines nearer than this at both ends are one [half-resolution px].
SAME_PX = 4.0
#: Distance from a line at which the coarse labels of its two sides are compared [cells].
_LABEL_CELLS = 1.5
#: Share of a line along which its sides must differ to be looked at: neither border nor paint edge otherwise.
_DIFFERENT = 0.04


@dataclass(frozen=True)
class VotedLine:
    """A line from the vote: v = level + slope (u - center) in half-resolution pixels of the (transposed) view."""

    upright: bool
    polarity: int
    left: float
    right: float
    rank: float


def vote_lines(
    picture: Picture,
    plane: PlaneEstimate | None,
    grid: CoarseGrid,
    labels: np.ndarray,
    config: VisionConfig,
    tilt: float,
    directions: tuple[bool, ...],
) -> list[VotedLine]:
    """Most voted level (False) and upright (True) lines of both polarities, on and around the surface, unsorted."""
    height, width = picture.mask.shape
    half = cv2.resize(picture.rgb, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    allowed = cv2.resize(picture.mask, (width // 2, height // 2), interpolation=cv2.INTER_NEAREST) == 0
    if plane is not None:
        region = cv2.dilate(plane.component.astype(np.uint8), np.ones((5, 5), np.uint8))
        allowed &= cv2.resize(region, (width // 2, height // 2), interpolation=cv2.INTER_NEAREST) > 0
    found: list[VotedLine] = []
    for upright in directions:
        gradient = cv2.Sobel(half, cv2.CV_16S, int(upright), int(not upright), ksize=3)
        channels = cv2.split(gradient)
        rising = cv2.max(cv2.max(channels[0], channels[1]), channels[2])
        falling = cv2.subtract(np.zeros_like(rising), cv2.min(cv2.min(channels[0], channels[1]), channels[2]))
        center = 0.5 * math.pi + (-tilt if upright else tilt)
        for polarity, strength in ((1, rising), (-1, falling)):
            edges = _thin(strength, upright, config.detect.gradient_min)
            edges &= allowed
            edges = edges.T if upright else edges
            found += _hough(np.ascontiguousarray(edges, np.uint8), upright, polarity, center, labels, grid, config)
    return found


def _thin(strength: np.ndarray, upright: bool, threshold: float) -> np.ndarray:
    """Places where the gradient is strong and the strongest across the line."""
    edges = strength > threshold
    if upright:
        edges[:, 1:] &= strength[:, 1:] >= strength[:, :-1]
        edges[:, :-1] &= strength[:, :-1] > strength[:, 1:]
    else:
        edges[1:] &= strength[1:] >= strength[:-1]
        edges[:-1] &= strength[:-1] > strength[1:]
    return edges


def _hough(
    edges: np.ndarray,
    upright: bool,
    polarity: int,
    center: float,
    labels: np.ndarray,
    grid: CoarseGrid,
    config: VisionConfig,
) -> list[VotedLine]:
    """Most voted lines of one orientation and polarity, near-duplicates removed, ranked with their coarse labels."""
    spread = math.radians(config.detect.half_range_deg)
    low, high = max(center - spread, 0.0), min(center + spread, math.pi)
    width = edges.shape[1]
    least = max(8, round(0.5 * config.detect.min_length * 0.5 * max(edges.shape)))
    lines = cv2.HoughLinesWithAccumulator(
        edges, 1.0, math.radians(config.detect.angle_step_deg), least, min_theta=low, max_theta=high
    )
    if lines is None:
        return []
    rho, theta, votes = np.asarray(lines, float).reshape(-1, 3)[:_VOTED].T
    # pixel centres: half-resolution v covers the full-resolution rows 2v and 2v + 1
    left, right = rho / np.sin(theta), (rho - (width - 1) * np.cos(theta)) / np.sin(theta)
    kept, ends = [], []
    for index, (one, other) in enumerate(zip(left.tolist(), right.tolist(), strict=True)):
        if all(abs(one - a) > SAME_PX or abs(other - b) > SAME_PX for a, b in ends):
            kept.append(index)
            ends.append((one, other))
            if len(kept) == _KEPT:
                break
    differing = _label_difference(left[kept], right[kept], labels.T if upright else labels, grid)
    result = []
    for index, difference in zip(kept, differing, strict=True):
        if difference < _DIFFERENT:
            continue
        slope = (right[index] - left[index]) / (width - 1.0)
        at_zero = 2.0 * left[index] + 0.5 - slope * 0.5
        full_width = 2.0 * width - 1.0
        result.append(
            VotedLine(upright, polarity, at_zero, at_zero + slope * full_width, votes[index] * (0.1 + difference))
        )
    return result


def _label_difference(left: np.ndarray, right: np.ndarray, labels: np.ndarray, grid: CoarseGrid) -> np.ndarray:
    """Share of places along each line whose two sides have different coarse labels, (n,)."""
    rows, columns = labels.shape
    share = (np.arange(columns) + 0.5) / columns
    level = (left[:, None] * (1.0 - share) + right[:, None] * share) * 2.0 / grid.stride - 0.5
    above, below = (np.round(level + offset).astype(np.intp) for offset in (-_LABEL_CELLS, _LABEL_CELLS))
    inside = (above >= 0) & (below < rows)
    k = np.arange(columns)
    different = labels[np.clip(above, 0, rows - 1), k] != labels[np.clip(below, 0, rows - 1), k]
    return (different & inside).mean(axis=1)
