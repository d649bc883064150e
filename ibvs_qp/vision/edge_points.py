"""Where the colours of a picture step up or down, on every other row and about every eighth column."""

from __future__ import annotations

import functools

import cv2
import numpy as np

from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.native import native
from ibvs_qp.vision.native_votes import points_natively
from ibvs_qp.vision.picture import Picture

#: Points along the longer side of a picture: a line is told by far fewer points than it has pixels (it is refined with
#: as many), its place across is not; and pixels per point across.
POINTS, _ACROSS_PX = 80, 2
#: Steps this many times the weakest one have a full vote, fainter ones less: noise must not outvote an edge.
_FULL = 4
#: Most points of one polarity that vote; a line right across the picture has POINTS.
_MOST = 500
#: A central difference over this many sums of pixels answers as Sobel's kernel does.
_SOBEL = 4.0


def edge_points(
    picture: Picture, upright: bool, gradient_min: float, region: np.ndarray | None, grid: CoarseGrid
) -> tuple[np.ndarray, int]:
    """Places where colours rise, and then those where they fall, along +v of the view in which lines are level.

    Args:
        picture: Colour and mask.
        upright: Whether the view is the transposed one.
        gradient_min: Weakest step as Sobel's kernel answers it at half resolution [grey levels].
        region: Non-zero on the samples around which lines are wanted, uint8 (rows, columns), or None for all.
        grid: Where these samples lie.

    Returns:
        (u, v) in half-resolution pixels of the view, 0 at the picture's border, and the weight of its vote, whole
        numbers up to `full_vote`, so that sums of them are exact: float32 (n, 3); and how many of them rise.
    """
    height, width = picture.mask.shape
    apart = max(height, width) / POINTS
    columns, rows = width // _ACROSS_PX, height // _ACROSS_PX
    size = (columns, round(height / apart)) if upright else (round(width / apart), rows)
    library = native()
    points = points_with_numpy if library is None else functools.partial(points_natively, library)
    return points(picture, upright, size, _threshold(gradient_min), full_vote(gradient_min), _MOST, region, grid)


def full_vote(gradient_min: float) -> int:
    """Weight of a full vote, the step that has it [grey levels]."""
    return min(_FULL * _threshold(gradient_min), 255)


def _threshold(gradient_min: float) -> int:
    return max(1, round(gradient_min / _SOBEL))


def _strongest(channels: list[np.ndarray]) -> np.ndarray:
    return cv2.max(cv2.max(channels[0], channels[1]), channels[2])


def _thin(strength: np.ndarray, threshold: int) -> np.ndarray:
    """Flat places where the step is strong and the strongest across the line."""
    edges = strength > threshold
    edges[1:] &= strength[1:] >= strength[:-1]
    edges[:-1] &= strength[:-1] > strength[1:]
    return np.flatnonzero(edges)


def points_with_numpy(
    picture: Picture,
    upright: bool,
    size: tuple[int, int],
    threshold: int,
    full: int,
    most: int,
    region: np.ndarray | None,
    grid: CoarseGrid,
) -> tuple[np.ndarray, int]:
    """What `ibvs_qp.vision.native_votes.points_natively` computes, where there is no machine code."""
    planes = cv2.split(cv2.resize(picture.rgb, size, interpolation=cv2.INTER_LINEAR))
    if upright:
        planes = tuple(cv2.transpose(plane) for plane in planes)
    pairs = [(plane[2:], plane[:-2]) for plane in planes]
    rising = _strongest([cv2.subtract(below, above) for below, above in pairs])
    falling = _strongest([cv2.subtract(above, below) for below, above in pairs])
    found = [_points(steps, picture, upright, threshold, full, most, region, grid) for steps in (rising, falling)]
    return np.concatenate(found), len(found[0])


def _points(
    steps: np.ndarray,
    picture: Picture,
    upright: bool,
    threshold: int,
    full: int,
    most: int,
    region: np.ndarray | None,
    grid: CoarseGrid,
) -> np.ndarray:
    """Places of strong steps that the vehicle does not hide and around which lines are wanted, with their weights."""
    places = _thin(steps, threshold)
    rows, columns = steps.shape
    row = places // columns
    column = places - row * columns
    view = picture.transposed if upright else picture
    across, along = view.height / (rows + 2), view.width / columns
    v, u = (row + np.float32(1.5)) * np.float32(across), (column + np.float32(0.5)) * np.float32(along)
    x, y = (v, u) if upright else (u, v)  # from the corner of the picture, pixel centres at halves
    x_px, y_px = x.astype(np.intp), y.astype(np.intp)
    free = picture.mask.reshape(-1).take(y_px * picture.mask.shape[1] + x_px) == 0
    if region is not None:
        last_row, last_column = region.shape[0] - 1, region.shape[1] - 1
        cell = np.minimum(y_px // grid.stride, last_row) * region.shape[1]
        cell += np.minimum(x_px // grid.stride, last_column)
        free &= region.reshape(-1).take(cell) > 0
    kept = np.flatnonzero(free)
    strength = np.minimum(steps.reshape(-1).take(places.take(kept)), full)
    if len(kept) > most:  # grain and prints: the strongest tell the lines, and the votes of all would take long
        strongest = _strongest_points(strength, most)
        kept, strength = kept.take(strongest), strength.take(strongest)
    points = np.empty((len(kept), 3), np.float32)
    points[:, 0], points[:, 1] = 0.5 * u.take(kept), 0.5 * v.take(kept)
    points[:, 2] = strength
    return points


def _strongest_points(strength: np.ndarray, most: int) -> np.ndarray:
    """Places of the strongest ones, and of the weakest of these as many as there is room for, evenly spread."""
    cut = np.partition(strength, len(strength) - most)[len(strength) - most]
    tied, sure = np.flatnonzero(strength == cut), np.flatnonzero(strength > cut)
    share = np.arange(len(tied) + 1) * (most - len(sure)) // len(tied)
    return np.sort(np.concatenate((sure, tied[share[1:] > share[:-1]])))
