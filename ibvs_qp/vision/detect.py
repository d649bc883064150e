"""Search for lines without a prediction: gradients at half resolution, votes around level and upright, refinement."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.vision.classify import LineIdentity, identify
from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.lines import RefinedLine, refine_line
from ibvs_qp.vision.picture import Picture, denormalise, normalised_line
from ibvs_qp.vision.plane import PlaneEstimate

#: Half width of the strip in which a voted line is refined [px at 640]: two half-resolution bins.
_REFINE_PX = 6.0
#: Voted lines looked at per orientation and polarity, before suppression, and kept after it.
_VOTED, _KEPT = 40, 5
#: Lines nearer than this at both ends are one [half-resolution px].
_SAME_PX = 4.0
#: Distance from a line at which the coarse labels of its two sides are compared [cells].
_LABEL_CELLS = 1.5
#: Share of a line along which its sides must differ to be looked at: neither border nor paint edge otherwise.
_DIFFERENT = 0.04
#: Refined lines nearer than this at both ends of the picture are one [px at 640].
_DUPLICATE_PX = 3.0
#: Length that earns the full score, share of the picture's width.
_FULL_LENGTH = 0.4


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A detected line with its identity and score.

    Attributes:
        line: The fitted line.
        role: "horizontal" or "vertical", relative to gravity.
        identity: What it is.
        score: 0..1 by length, agreement along it, and identity.
    """

    line: RefinedLine
    role: str
    identity: LineIdentity
    score: float


@dataclass(frozen=True)
class _Voted:
    """A line from the vote: v = level + slope (u - center) in half-resolution pixels of the (transposed) view."""

    upright: bool
    polarity: int
    left: float
    right: float
    rank: float


def detect_lines(
    picture: Picture,
    depth: np.ndarray,
    plane: PlaneEstimate | None,
    grid: CoarseGrid,
    labels: np.ndarray,
    colors: SurfaceColors,
    config: VisionConfig,
    down: np.ndarray | None,
) -> list[Candidate]:
    """Find level and upright lines on or around the surface, best first.

    Args:
        picture: Colour and mask.
        depth: Depth [m], (H, W).
        plane: The surface, or None.
        grid: Coarse grid of the picture.
        labels: Colour labels on the grid, 0 where no surface, uint8 (rows, columns).
        colors: What board and paint look like.
        config: Settings.
        down: Gravity's direction in C, (3,), or None for upright cameras.

    Returns:
        Candidates of positive score, no two on the same edge.
    """
    tilt = 0.0 if down is None else math.atan2(-float(down[0]), float(down[1]))
    # level and upright swap places with every quarter turn; both are searched
    voted = _vote(picture, plane, grid, labels, config, math.remainder(tilt, 0.5 * math.pi))
    voted.sort(key=lambda entry: -entry.rank)
    found: list[Candidate] = []
    tried = 0
    for entry in voted:
        if tried == config.detect.candidates:
            break
        if any(_covered(entry, other.line, picture) for other in found):
            continue
        tried += 1
        candidate = _refined(entry, picture, depth, plane, grid, colors, config, tilt)
        if candidate is not None and not any(_same(candidate.line, other.line, picture) for other in found):
            found.append(candidate)
    return sorted(found, key=lambda candidate: -candidate.score)


def role_of(theta: float, tilt: float) -> str:
    """Role of a line by the angle of its normal from gravity's direction in the picture."""
    return HORIZONTAL if abs(math.sin(theta - tilt)) >= abs(math.cos(theta - tilt)) else VERTICAL


def _refined(
    entry: _Voted,
    picture: Picture,
    depth: np.ndarray,
    plane: PlaneEstimate | None,
    grid: CoarseGrid,
    colors: SurfaceColors,
    config: VisionConfig,
    tilt: float,
) -> Candidate | None:
    view = picture.transposed if entry.upright else picture
    width = view.width
    slope = (entry.right - entry.left) / (width - 1.0)
    rho, angle = normalised_line(-slope, 1.0, -entry.left, view.intrinsics)
    theta = 0.5 * math.pi - angle if entry.upright else angle
    line = refine_line(
        picture,
        rho,
        theta,
        half_width_px=_REFINE_PX * picture.scale,
        config=config.line,
        colors=colors,
        polarity=entry.polarity,
    )
    if line is None or line.length_px < config.detect.min_length * picture.mask.shape[1]:
        return None
    identity = identify(line, picture, depth, plane, grid, colors, config.line)
    length = min(line.length_px / (_FULL_LENGTH * picture.mask.shape[1]), 1.0)
    score = identity.quality * (0.4 + 0.6 * length) * line.inlier_share
    return Candidate(line=line, role=role_of(line.theta, tilt), identity=identity, score=float(score))


def _vote(
    picture: Picture,
    plane: PlaneEstimate | None,
    grid: CoarseGrid,
    labels: np.ndarray,
    config: VisionConfig,
    tilt: float,
) -> list[_Voted]:
    height, width = picture.mask.shape
    half = cv2.resize(picture.rgb, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    allowed = cv2.resize(picture.mask, (width // 2, height // 2), interpolation=cv2.INTER_NEAREST) == 0
    if plane is not None:
        region = cv2.dilate(plane.component.astype(np.uint8), np.ones((5, 5), np.uint8))
        allowed &= cv2.resize(region, (width // 2, height // 2), interpolation=cv2.INTER_NEAREST) > 0
    found: list[_Voted] = []
    for upright in (False, True):
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
) -> list[_Voted]:
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
    kept: list[int] = []
    for index in range(len(rho)):
        if len(kept) == _KEPT:
            break
        if all(abs(left[index] - left[k]) > _SAME_PX or abs(right[index] - right[k]) > _SAME_PX for k in kept):
            kept.append(index)
    differing = _label_difference(left[kept], right[kept], labels.T if upright else labels, grid)
    result = []
    for index, difference in zip(kept, differing, strict=True):
        if difference < _DIFFERENT:
            continue
        slope = (right[index] - left[index]) / (width - 1.0)
        at_zero = 2.0 * left[index] + 0.5 - slope * 0.5
        full_width = 2.0 * width - 1.0
        result.append(
            _Voted(upright, polarity, at_zero, at_zero + slope * full_width, votes[index] * (0.1 + difference))
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


def _covered(entry: _Voted, line: RefinedLine, picture: Picture) -> bool:
    """Whether a voted line is an edge already fitted: within the vote's resolution at both ends of its segment."""
    ends = denormalise(line.segment, picture.intrinsics)
    if entry.upright:
        ends = ends[:, ::-1]
    across = picture.height if entry.upright else picture.width
    voted = entry.left + (entry.right - entry.left) * ends[:, 0] / (across - 1.0)
    return bool(np.abs(voted - ends[:, 1]).max() < 2.0 * _SAME_PX)


def _same(one: RefinedLine, two: RefinedLine, picture: Picture) -> bool:
    """Whether two fitted lines run along the same edge where they overlap."""
    if math.cos(one.theta - two.theta) ** 2 < 0.9:
        return False
    limit = _DUPLICATE_PX * picture.scale / picture.intrinsics[0]
    cos, sin = math.cos(two.theta), math.sin(two.theta)
    apart = np.abs(one.segment @ np.array([cos, sin]) - two.rho)
    along_one = one.segment @ np.array([-sin, cos])
    along_two = two.segment @ np.array([-sin, cos])
    overlap = min(along_one.max(), along_two.max()) - max(along_one.min(), along_two.min())
    return bool(apart.max() < limit and overlap > 0.0)
