"""Votes for lines: steps of colour on a thinned-out picture, a Hough transform around level and upright only."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.edge_points import POINTS, edge_points, full_vote
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.native import native
from ibvs_qp.vision.native_votes import Ballot, voted_natively
from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.plane import PlaneEstimate

#: Voted lines looked at per orientation, and kept of each polarity.
_VOTED, _KEPT = 40, 5
#: Points this near to a line vote for it, and this near to it are explained by it [half-resolution px].
_NEAR, SAME_PX = 1.0, 2.0
#: Lines of less than this share of the best one's weight are not looked at.
_POOR = 0.03
#: Weight of the points of a faint line that must still be found.
_FAINT = 0.4
#: Distance from a line at which the coarse labels of its two sides are compared [cells].
_LABEL_CELLS = 1.5
#: Share of a line along which its sides must differ to be looked at: neither border nor paint edge otherwise.
_DIFFERENT = 0.04


@dataclass(frozen=True)
class VotedLine:
    """A line from the vote: its rows at the first and last column of the (transposed) view [px]."""

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
    region = None if plane is None else cv2.dilate(plane.component.view(np.uint8), np.ones((5, 5), np.uint8))
    found: list[VotedLine] = []
    for upright in directions:
        points, rising = edge_points(picture, upright, config.detect.gradient_min, region, grid)
        center = 0.5 * math.pi + (-tilt if upright else tilt)
        view = picture.transposed if upright else picture
        found += _voted(points, rising, view, upright, center, labels, grid, config)
    return found


def _voted(
    points: np.ndarray,
    rising: int,
    view: Picture,
    upright: bool,
    center: float,
    labels: np.ndarray,
    grid: CoarseGrid,
    config: VisionConfig,
) -> list[VotedLine]:
    """Most voted lines of one orientation, those with the same points removed, ranked with their coarse labels."""
    spread = math.radians(config.detect.half_range_deg)
    low, high = max(center - spread, 0.0), min(center + spread, math.pi)
    if len(points) == 0 or not low < high:
        return []
    ballot, library = _ballot(view, low, high, grid, config), native()
    voted = voted_with_numpy if library is None else functools.partial(voted_natively, library)
    result = []
    for left, right, falls, own, difference in voted(points, rising, ballot, labels.T if upright else labels):
        if difference < _DIFFERENT:
            continue
        slope = (right - left) / ballot.width
        # half-resolution row v covers the full-resolution rows 2 v and 2 v + 1 around 2 v - 0.5
        at_zero = 2.0 * left - 0.5 + 0.5 * slope
        at_last = at_zero + slope * (view.width - 1.0)
        polarity, rank = -1 if falls else 1, own * (0.1 + difference)
        result.append(VotedLine(upright=upright, polarity=polarity, left=at_zero, right=at_last, rank=rank))
    return result


def _ballot(view: Picture, low: float, high: float, grid: CoarseGrid, config: VisionConfig) -> Ballot:
    """How to vote for lines with normals between two angles.

    Both polarities are voted for at once, the falling edges moved down so far that no line runs through both.
    """
    width, height = 0.5 * view.width, 0.5 * view.height
    reach = width * max(abs(math.cos(low)) / max(math.sin(low), 0.1), abs(math.cos(high)) / max(math.sin(high), 0.1))
    moved = height + reach + SAME_PX
    normals = (math.cos(low), math.sin(low)), (math.cos(high), math.sin(high))
    rhos = [u * cos + v * sin for u in (0.0, width) for v in (0.0, moved + height) for cos, sin in normals]
    least = max(3, round(0.5 * config.detect.min_length * POINTS))
    faint = _FAINT * least * full_vote(config.detect.gradient_min)
    step, scale = math.radians(config.detect.angle_step_deg), 2.0 / grid.stride
    bounds = min(rhos) - 1.0, max(rhos) + 1.0
    size = width, height, moved
    return Ballot(
        low, high, step, *bounds, least, _VOTED, *size, _NEAR, SAME_PX, faint, _POOR, _KEPT, scale, _LABEL_CELLS
    )


def voted_with_numpy(points: np.ndarray, rising: int, ballot: Ballot, labels: np.ndarray) -> list[list[float]]:
    """What `ibvs_qp.vision.native_votes.voted_natively` computes, where there is no machine code."""
    points = points.copy()
    points[rising:, 1] += ballot.moved
    peaks = cv2.HoughLinesPointSet(
        np.ascontiguousarray(points[:, None, :2]),
        ballot.most,
        ballot.least,
        ballot.rho_low,
        ballot.rho_high,
        1.0,
        ballot.low,
        ballot.high,
        ballot.step,
    )
    if peaks is None:
        return []
    _, rho, theta = np.asarray(peaks, float).reshape(-1, 3).T
    sine, cosine = np.sin(theta), np.cos(theta)
    left, right = rho / sine, (rho - ballot.width * cosine) / sine
    lines = np.stack((cosine, sine, -rho), axis=1).astype(np.float32)
    falls = 0.5 * (left + right) > 0.5 * (ballot.moved + ballot.height)
    left, right = left - ballot.moved * falls, right - ballot.moved * falls
    kept, weights = _distinct(lines, falls, points, ballot)
    ends = [(float(left[k]), float(right[k])) for k in kept]
    differing = _differing(ends, labels, ballot.scale, ballot.beside)
    return [
        [*borders, float(falls[k]), own, difference]
        for k, borders, own, difference in zip(kept, ends, weights, differing, strict=True)
    ]


def _distinct(
    lines: np.ndarray, falling: np.ndarray, points: np.ndarray, ballot: Ballot
) -> tuple[list[int], list[float]]:
    """Lines (p, q, r) in the order of the weights that are left when better ones have taken theirs, and these."""
    distance, free = np.abs(lines[:, :2] @ points[:, :2].T + lines[:, 2:]), points[:, 2].copy()
    falls = falling.tolist()
    votes_for = (distance < ballot.near).astype(np.float32)
    wanted = np.ones(len(votes_for), np.float32)
    rooms = {True: ballot.room, False: ballot.room}
    kept: list[int] = []
    votes: list[float] = []
    while True:
        left = (votes_for @ free) * wanted
        best = int(left.argmax())
        own = float(left[best])
        if own < max(ballot.faint, ballot.poor * (votes[0] if votes else 0.0)):
            return kept, votes
        kept.append(best)
        votes.append(own)
        free[distance[best] < ballot.same] = 0.0
        wanted[best] = 0.0
        rooms[falls[best]] -= 1
        if not rooms[falls[best]]:
            wanted[np.array(falls) == falls[best]] = 0.0


def _differing(lines: list[tuple[float, float]], labels: np.ndarray, scale: float, beside: float) -> list[float]:
    """Share of places along each line whose two sides have different coarse labels."""
    rows, columns = labels.shape
    share = (np.arange(columns) + 0.5) / columns
    left, right = np.array(lines).reshape(-1, 2).T
    level = (left[:, None] + (right - left)[:, None] * share) * scale - 0.5
    above, below = (np.rint(level + offset).astype(np.intp) for offset in (-beside, beside))
    inside = (above >= 0) & (below < rows)
    k = np.arange(columns)
    different = labels[np.clip(above, 0, rows - 1), k] != labels[np.clip(below, 0, rows - 1), k]
    return (np.count_nonzero(different & inside, axis=1) / columns).tolist()
