"""Where a wall of nearly the surface's colour begins: light changes slowly over a surface, at its edge at once."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.vision.picture.grid import CoarseGrid

#: Largest change from one sample to the next within an evenly lit surface, per channel [grey levels].
_STEP = 9
#: A part smaller than this many samples, or than this share of what has the surface's colour, tells nothing.
_LEAST, _LEAST_SHARE = 150, 0.10
#: Nor does one that is nearly all of it.
_ALL = 0.985
#: Share of the samples just beyond the part that must have the surface's colour in some light: beyond prints they do
#: not, beyond an edge towards a wall of nearly the same colour they do.
_ALIKE_BEYOND = 0.4
#: A part that fills this share of its convex hull, and that is this share of what has the colour, is a surface of its
#: own: joints of a wall and the like have its colour, but are thin.
_SOLID, _SOLID_SHARE = 0.85, 0.3


def evenly_lit(rgb: np.ndarray, grid: CoarseGrid, own: np.ndarray, seed: tuple[int, int]) -> np.ndarray | None:
    """The part of what seems to be the surface that its light joins to the seed, where that ends at a real edge.

    Args:
        rgb: Picture, uint8 (H, W, 3).
        grid: Coarse grid of the picture.
        own: Samples with the depth and, in some light, the colour of the surface, bool (rows, columns).
        seed: Cell on the surface.

    Returns:
        bool (rows, columns), or None where all of it is joined, or nothing can be told.
    """
    rows, columns = grid.shape
    if not own.any():
        return None
    smooth = averaged(rgb, grid)
    # beside other things, such as paint under the seed, a sample's square has part of their colour
    inner = cv2.erode(own.astype(np.uint8), np.ones((3, 3), np.uint8))
    places = np.argwhere(inner if inner.any() else own)
    start = places[int(np.argmin(((places - seed) ** 2).sum(axis=1)))]
    blocked = np.ones((rows + 2, columns + 2), np.uint8)
    blocked[1:-1, 1:-1] = ~own
    step = (_STEP, _STEP, _STEP)
    point = (int(start[1]), int(start[0]))
    cv2.floodFill(smooth, blocked, point, (0, 0, 0), step, step, 4 | cv2.FLOODFILL_MASK_ONLY | (2 << 8))
    part = blocked[1:-1, 1:-1] == 2
    count, total = int(part.sum()), int(own.sum())
    if count < max(_LEAST, _LEAST_SHARE * total) or count > _ALL * total:
        return None
    closed = cv2.morphologyEx(part.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    outlines, _ = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    outline = max(outlines, key=cv2.contourArea)
    cv2.drawContours(closed, [outline], -1, 1, -1)
    hull = np.zeros_like(closed)
    cv2.fillConvexPoly(hull, cv2.convexHull(outline), 1)
    solid = int(closed.sum()) >= max(_SOLID * int(hull.sum()), _SOLID_SHARE * total)
    ring = (cv2.dilate(closed, np.ones((5, 5), np.uint8)) > 0) & (cv2.dilate(closed, np.ones((3, 3), np.uint8)) == 0)
    if solid or (ring.any() and float(own[ring].mean()) >= _ALIKE_BEYOND):
        return (closed > 0) & own
    return None


def even_places(rgb: np.ndarray, grid: CoarseGrid) -> np.ndarray:
    """Samples around which light and colour change slowly, bool (rows, columns)."""
    smooth, kernel = averaged(rgb, grid), np.ones((3, 3), np.uint8)
    return (cv2.dilate(smooth, kernel) - cv2.erode(smooth, kernel)).max(axis=2) <= 2 * _STEP


def averaged(rgb: np.ndarray, grid: CoarseGrid) -> np.ndarray:
    """Mean colours of the squares around samples, uint8 (rows, columns, 3)."""
    rows, columns = grid.shape
    size = (columns * grid.stride, rows * grid.stride)
    padded = cv2.copyMakeBorder(
        rgb, 0, max(size[1] - rgb.shape[0], 0), 0, max(size[0] - rgb.shape[1], 0), cv2.BORDER_REPLICATE
    )
    return np.ascontiguousarray(cv2.resize(padded[: size[1], : size[0]], (columns, rows), interpolation=cv2.INTER_AREA))
