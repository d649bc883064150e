"""What lies on the two sides of fitted lines, by machine code: fills in the tables of native/sides.c and reads them."""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.native import place
from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.refined import RefinedLine
from ibvs_qp.vision.surface import PlaneEstimate


@dataclass(frozen=True)
class Evidence:
    """What the two sides of a line show, before and behind it along its normal.

    Attributes:
        board: Share of the profiles that show the board's colour, (2).
        paint: The same of the paint's, (2).
        steps: How much farther than the surface either side is, share of depth, and the standard deviation; None where
            too few readings tell.
        samples: Samples of the surface abreast of the segment, clear of the line, (2).
    """

    board: list[float]
    paint: list[float]
    steps: list[tuple[float | None, float]]
    samples: list[int]


def look_natively(
    library: ctypes.CDLL,
    lines: list[RefinedLine],
    picture: Picture,
    depth: np.ndarray,
    plane: PlaneEstimate | None,
    grid: CoarseGrid,
    colors: SurfaceColors,
    *,
    distances_px: tuple[float, ...],
    valid: float,
    correlated: float,
    margin: float,
) -> list[Evidence]:
    """Look at both sides of every line.

    Args:
        library: The machine code.
        lines: The lines, with their contents.
        picture: Colour and mask.
        depth: Depth [m], (H, W).
        plane: The surface on this grid, or None.
        grid: Coarse grid.
        colors: What board and paint look like.
        distances_px: Distances from the line at which depth is read, nearest first [px].
        valid: Least share of valid depth readings on a side.
        correlated: Profiles over which depth noise is correlated.
        margin: How far from the line samples of the surface count, normalised.

    Raises:
        MemoryError: When memory ran out.
    """
    known = plane is not None
    depth = np.ascontiguousarray(depth, np.float32)
    table = (*depth.shape, *picture.intrinsics, *(plane.inverse_depth if known else (0.0, 0.0, 0.0)), known)
    look = np.array((*table, *distances_px, valid, len(grid.design), margin), float)
    component = np.ascontiguousarray(plane.component) if known else None
    edges = np.array([_edge(line) for line in lines])
    pixels = np.concatenate([line.pixels for line in lines])
    sides = np.ascontiguousarray(np.concatenate([line.sides for line in lines], axis=1))
    labels, found = None if colors.board is None else colors.table(), np.empty((len(lines), 10))
    done = library.identify(
        *(place(part) for part in (look, edges)),
        len(lines),
        *(place(part) for part in (pixels, sides)),
        ctypes.c_long(len(pixels)),
        *(place(part) for part in (labels, colors.levels, depth, picture.mask, grid.design, component, found)),
    )
    if not done:
        raise MemoryError("no memory for the sides of lines")
    sigma = 0.0 if plane is None else plane.residual_sigma * math.sqrt(correlated)
    return [
        Evidence(
            row[0:2],
            row[2:4],
            [(row[4 + k], sigma / math.sqrt(row[6 + k])) if row[6 + k] else (None, 1.0) for k in (0, 1)],
            [int(row[8]), int(row[9])],
        )
        for row in found.tolist()
    ]


def _edge(line: RefinedLine) -> tuple[float, ...]:
    """One `Edge` of sides.c."""
    cos, sin = math.cos(line.theta), math.sin(line.theta)
    low, high = sorted(y * cos - x * sin for x, y in line.segment.tolist())
    return len(line.pixels), cos, sin, line.rho, low, high
