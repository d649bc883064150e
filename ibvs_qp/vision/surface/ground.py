"""The colour of the bare surface, which need not be the colour at the seed."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.vision.picture.grid import CoarseGrid
from ibvs_qp.vision.surface.estimate import connected_samples
from ibvs_qp.vision.surface.evenly_lit import even_places
from ibvs_qp.vision.surface.region import alike_colors

#: Share of the surface that must have the colour around the seed for it to be the surface's.
_GROUND_SHARE = 0.25
#: Samples next to the seed's colour among which the most common colour is sought, and colours tried.
_NEAR, _TRIED = 300, 40
#: Even samples from which on a piece may be the surface though it has a smaller share (a square of 98 px at 640).
_PIECE = 150


def ground_color(
    rgb: np.ndarray, grid: CoarseGrid, coarse: np.ndarray, cells: np.ndarray, seed: tuple[int, int]
) -> np.ndarray:
    """Colour of the bare surface: that around the seed where it covers much, else the most common one near by.

    A seed may lie on something printed or painted, and a wall close behind the surface may outnumber it. What is
    painted lies on a ground that is a larger even piece than itself; a small board before a wall of bricks does not.

    Args:
        rgb: Picture, uint8 (H, W, 3).
        grid: Coarse grid of the picture.
        coarse: Colours of its samples, uint8 (rows, columns, 3).
        cells: Samples on the surface by depth, bool (rows, columns).
        seed: Cell on the surface.

    Returns:
        RGB, (3,).
    """
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
    even = even_places(rgb, grid)
    piece = int((region & even).sum())
    if piece >= _PIECE and piece > _largest(cells & ~region & even & alike_colors(coarse, ground)):
        return np.median(coarse[region].astype(float), axis=0)
    return ground


def _largest(region: np.ndarray) -> int:
    """Number of samples of the largest piece of a region."""
    _, pieces = cv2.connectedComponents(region.astype(np.uint8), connectivity=4)
    return int(np.bincount(pieces[region]).max()) if region.any() else 0


def connected(region: np.ndarray, grid: CoarseGrid, seed: tuple[int, int]) -> np.ndarray:
    """The part of a region of samples that hangs together with a seed, gaps of one sample bridged."""
    closed = cv2.morphologyEx(region.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)) > 0
    return connected_samples(closed, grid, seed) & region
