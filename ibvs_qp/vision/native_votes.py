"""Votes for lines by machine code: fills in the tables of native/thin.c and native/votes.c and reads them."""

from __future__ import annotations

import ctypes
from typing import NamedTuple

import numpy as np

from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.native import place
from ibvs_qp.vision.picture import Picture


class Ballot(NamedTuple):
    """How lines of one orientation are voted for, all at half resolution.

    Attributes:
        low: Least angle of the normal [rad].
        high: Largest angle [rad].
        step: Step of the angles [rad].
        rho_low: Least distance from the corner [px].
        rho_high: Largest distance [px].
        least: Votes that a line must exceed.
        most: Lines looked at.
        width: Of the view [px].
        height: Of the view [px].
        moved: How far down falling edges are moved [px].
        near: Distance within which a point counts [px].
        same: Distance within which a point is taken [px].
        faint: Least weight of a line.
        poor: The same, as a share of the best one's.
        room: Most lines of either polarity.
        scale: Samples of the coarse grid per pixel.
        beside: Distance from the line at which coarse labels are compared [samples].
    """

    low: float
    high: float
    step: float
    rho_low: float
    rho_high: float
    least: int
    most: int
    width: float
    height: float
    moved: float
    near: float
    same: float
    faint: float
    poor: float
    room: int
    scale: float
    beside: float


def points_natively(
    library: ctypes.CDLL,
    picture: Picture,
    upright: bool,
    size: tuple[int, int],
    threshold: int,
    full: int,
    most: int,
    region: np.ndarray | None,
    grid: CoarseGrid,
) -> tuple[np.ndarray, int]:
    """Points where colours step, see `ibvs_qp.vision.edge_points.edge_points`, rising ones first, and how many rise.

    Args:
        library: The machine code.
        picture: The full picture.
        upright: Whether the view is the transposed one.
        size: (columns, rows) of the thinned-out picture.
        threshold: Weakest step [grey levels].
        full: Step with a full vote [grey levels].
        most: Most points of either polarity.
        region: Non-zero on the samples around which lines are wanted, uint8, or None for all.
        grid: Where these samples lie.

    Raises:
        MemoryError: When memory ran out.
    """
    region = None if region is None else np.ascontiguousarray(region)
    cells = grid.shape if region is None else region.shape
    table = np.array((*size[::-1], upright, *picture.mask.shape, threshold, full, most, *cells, grid.stride), float)
    points, counts = np.empty((2 * most, 3), np.float32), np.empty(2, np.int32)
    parts = (table, picture.rgb, picture.mask, region, points, counts)
    if not library.edge_points(*(place(part) for part in parts)):
        raise MemoryError("no memory for votes")
    rising, falling = counts.tolist()
    return points[: rising + falling], rising


def voted_natively(
    library: ctypes.CDLL, points: np.ndarray, rising: int, ballot: Ballot, labels: np.ndarray
) -> list[list[float]]:
    """Most voted lines, those with the same points left out, best first.

    Args:
        library: The machine code.
        points: (u, v) and weight, float32 (n, 3).
        rising: How many of them, the first ones, rise.
        ballot: How to vote.
        labels: Labels of the coarse grid in the view, uint8 (rows, columns), any strides.

    Returns:
        Of every line its rows at the left and the right border [half-resolution px], whether it falls, its weight and
        the share of places along it whose two sides have different coarse labels.

    Raises:
        MemoryError: When memory ran out.
    """
    (rows, columns), (down, right) = labels.shape, labels.strides
    table, found = np.array(ballot, float), np.empty((2 * ballot.room, 5))
    steps = ctypes.c_long(down), ctypes.c_long(right), rows, columns
    at = place(table), place(points), rising, len(points), place(labels)
    count = library.vote_lines(*at, *steps, place(found))
    if count < 0:
        raise MemoryError("no memory for votes")
    return found[:count].tolist()
