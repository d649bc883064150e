"""Colour and light of the bare surface: which colour it has, and where a wall of nearly the same colour begins."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.vision.appearance.colors import alike_colors
from ibvs_qp.vision.picture.layout import Samples
from ibvs_qp.vision.surface.plane import connected

#: Fraction of the surface that must have the colour around the seed for it to be the surface's.
_GROUND_SHARE = 0.25
#: Samples next to the seed's colour among which the most common colour is sought, and colours tried.
_NEAR, _TRIED = 300, 40
#: Even samples from which on a piece may be the surface though it has a smaller part (a square of 98 px at 640).
_PIECE = 150

#: Largest change from one sample to the next within an evenly lit surface, per channel [grey levels].
_STEP = 9
#: A part smaller than this many samples, or than this fraction of the samples with the surface's colour, does not
#: count.
_PART, _PART_SHARE = 150, 0.10
#: Nor does one that is nearly all of it.
_ALL = 0.985
#: Fraction of the samples just beyond the part that must have the surface's colour in some light: beyond prints they do
#: not, beyond an edge towards a wall of nearly the same colour they do.
_ALIKE_BEYOND = 0.4
#: A part that fills this fraction of its convex hull, and this fraction of the samples with the colour, is a surface of
#: its own: joints of a wall and the like have its colour, but are thin.
_SOLID, _SOLID_SHARE = 0.85, 0.3


def ground_color(samples: Samples, cells: np.ndarray, seed: tuple[int, int]) -> np.ndarray:
    """Colour of the bare surface, RGB (3,): that around the seed where it covers much, else the most common near by.

    A seed may lie on something printed or painted, and a wall close behind the surface may outnumber it. Paint
    lies on a ground that is a larger even piece than itself; a small board before a wall of bricks does not.
    The surface's samples by depth are bool (rows, columns).
    """
    grid, coarse = samples.grid, samples.colors
    rows, columns = grid.window(seed, 1)
    around = np.median(coarse[rows, columns].reshape(-1, 3).astype(float), axis=0)
    alike = cells & alike_colors(coarse, around)
    region = connected(alike, grid, seed)
    if int(region.sum()) >= _GROUND_SHARE * int(cells.sum()):
        return np.median(coarse[region].astype(float), axis=0)
    others = np.argwhere(cells & ~region)
    near = others[np.argsort(((others - seed) ** 2).sum(axis=1), kind="stable")[:_NEAR]]
    colors = coarse[tuple(near.T)].astype(float) if len(near) else coarse[cells].astype(float)
    tried = colors[:: max(1, len(colors) // _TRIED)]
    counts = [int(alike_colors(colors, color).sum()) for color in tried]
    ground = np.median(colors[alike_colors(colors, tried[int(np.argmax(counts))])], axis=0)
    even = _even_places(samples)
    piece = int((region & even).sum())
    if piece >= _PIECE and piece > _largest(cells & ~region & even & alike_colors(coarse, ground)):
        return np.median(coarse[region].astype(float), axis=0)
    return ground


def _largest(region: np.ndarray) -> int:
    """Number of samples of the largest piece of a region."""
    _, pieces = cv2.connectedComponents(region.astype(np.uint8), connectivity=4)
    return int(np.bincount(pieces[region]).max()) if region.any() else 0


def evenly_lit(samples: Samples, own: np.ndarray, seed: tuple[int, int]) -> np.ndarray | None:
    """The part of the apparent surface that its light joins to the seed, where that ends at a real edge.

    Given and returned are samples, bool (rows, columns): those with the depth and, in some light, the colour of the
    surface, and the part; None where all of them are joined, or nothing is certain.
    """
    rows, columns = own.shape
    if not own.any():
        return None
    smooth = _averaged(samples)
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
    if count < max(_PART, _PART_SHARE * total) or count > _ALL * total:
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


def _even_places(samples: Samples) -> np.ndarray:
    """Samples around which light and colour change slowly, bool (rows, columns)."""
    smooth, kernel = _averaged(samples), np.ones((3, 3), np.uint8)
    return (cv2.dilate(smooth, kernel) - cv2.erode(smooth, kernel)).max(axis=2) <= 2 * _STEP


def _averaged(samples: Samples) -> np.ndarray:
    """Mean colours of the squares around samples, uint8 (rows, columns, 3)."""
    rgb, grid = samples.rgb, samples.grid
    rows, columns = grid.shape
    size = (columns * grid.stride, rows * grid.stride)
    padded = cv2.copyMakeBorder(
        rgb, 0, max(size[1] - rgb.shape[0], 0), 0, max(size[0] - rgb.shape[1], 0), cv2.BORDER_REPLICATE
    )
    return np.ascontiguousarray(cv2.resize(padded[: size[1], : size[0]], (columns, rows), interpolation=cv2.INTER_AREA))
