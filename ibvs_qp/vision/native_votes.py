"""Votes for lines by machine code: fills in the tables of native/votes.c and reads them."""

from __future__ import annotations

import ctypes

import numpy as np

from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.native import place
from ibvs_qp.vision.picture import Picture


def points_natively(
    library: ctypes.CDLL,
    steps: np.ndarray,
    picture: Picture,
    upright: bool,
    threshold: int,
    full: int,
    most: int,
    region: np.ndarray | None,
    grid: CoarseGrid,
) -> np.ndarray:
    """Points where colours step, see `ibvs_qp.vision.edge_points.edge_points`.

    Args:
        library: The machine code.
        steps: Steps of one polarity along +v of the thinned-out view, uint8 (rows, columns).
        picture: The full picture.
        upright: Whether the view is the transposed one.
        threshold: Weakest step [grey levels].
        full: Step with a full vote [grey levels].
        most: Most points.
        region: Non-zero on the samples around which lines are wanted, uint8, or None for all.
        grid: Where these samples lie.
    """
    region = None if region is None else np.ascontiguousarray(region)
    cells = grid.shape if region is None else region.shape
    table = np.array((*steps.shape, upright, *picture.mask.shape, threshold, full, most, *cells, grid.stride), float)
    points = np.empty((steps.size, 3), np.float32)
    parts = (table, steps, picture.mask, region, points)
    count = library.edge_points(*(place(part) for part in parts))
    return points[:count]


def distinct_natively(
    library: ctypes.CDLL,
    lines: np.ndarray,
    falls: np.ndarray,
    points: np.ndarray,
    *,
    near: float,
    same: float,
    faint: float,
    poor: float,
    room: int,
) -> tuple[list[int], list[float]]:
    """Lines that are left when better ones have taken their points, and their votes, best first.

    Args:
        library: The machine code.
        lines: (p, q, r) of p u + q v + r = 0 with unit normal, float32 (L, 3).
        falls: Polarity of the lines, bool (L,).
        points: (u, v) and weight, float32 (n, 3).
        near: Distance within which a point votes [half-resolution px].
        same: Distance within which a point is taken [half-resolution px].
        faint: Least weight of a line.
        poor: The same, as a share of the best one's.
        room: Most lines of either polarity.

    Raises:
        MemoryError: When memory ran out.
    """
    falls, lines = falls.view(np.uint8), np.ascontiguousarray(lines)
    kept, votes = np.empty(2 * room, np.int32), np.empty(2 * room)
    count = library.distinct_lines(
        place(lines),
        place(falls),
        len(lines),
        place(points),
        len(points),
        ctypes.c_float(near),
        ctypes.c_float(same),
        ctypes.c_double(faint),
        ctypes.c_double(poor),
        room,
        place(kept),
        place(votes),
    )
    if count < 0:
        raise MemoryError("no memory for votes")
    return kept[:count].tolist(), votes[:count].tolist()


def differing_natively(
    library: ctypes.CDLL, lines: list[tuple[float, float]], labels: np.ndarray, scale: float, beside: float
) -> list[float]:
    """Share of places along each line whose two sides have different coarse labels.

    Args:
        library: The machine code.
        lines: Levels at the left and the right border [half-resolution px].
        labels: Labels of the view, uint8 (rows, columns), any strides.
        scale: Samples per half-resolution pixel.
        beside: Distance from the line at which labels are compared [samples].
    """
    (rows, columns), (down, right_step) = labels.shape, labels.strides
    steps = (ctypes.c_long(down), ctypes.c_long(right_step), rows, columns)
    at = place(labels)
    counts = [
        library.differing_labels(at, *steps, *(ctypes.c_double(number) for number in (left, right, scale, beside)))
        for left, right in lines
    ]
    return [count / columns for count in counts]
