"""What samples of colours tell of light: which are on the surface, have its tint, or are another material."""

from __future__ import annotations

import ctypes

import numpy as np

from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.native import native, place
from ibvs_qp.vision.native_colors import Gates

#: Samples that are judged; more cost time and change nothing.
JUDGED = 600
#: Light that differs by less than this over the surface is even [ln]: the gate holds +-0.1 on a white board.
UNEVEN = 0.10
#: Light is uneven only where one level leaves out this share of what has the surface's tint.
LEFT_OUT = 0.02
#: Fewer samples tell nothing of the light.
LEAST = 40
#: Share of the surface's colour by which the tint may be off, in units of the gate.
_TINT = 0.7
#: Light of samples in which the surface could be at all, times the reference's.
_DIMMEST, _BRIGHTEST = 0.4, 2.5
#: A channel this high is cut off: it tells neither light nor tint.
_CUT, _WHITE = 250.0, np.float32(255.0)
#: Share of the gate within which a colour is the surface's however coarse its label: labels are in steps of 8.
SURE = 0.75


def on_surface(grid: CoarseGrid, depth: np.ndarray, plane: np.ndarray, gate: float) -> np.ndarray:
    """Flat places of some samples of the grid that lie on a surface by depth alone, whatever their colour, (n,).

    Args:
        grid: Coarse grid of the picture.
        depth: Depth [m], (H, W).
        plane: (a, b, c) of 1/Z = a x + b y + c [1/m], (3,).
        gate: Distance from the surface within which a sample is on it, share of depth.
    """
    places, pixels, design = grid.some(JUDGED)
    library = native()
    if library is not None and depth.dtype == np.float32 and depth.flags.c_contiguous:
        near, plane, sizes = np.empty_like(places), np.ascontiguousarray(plane, float), ctypes.c_long(len(places))
        parts = (depth, pixels, design, places)
        count = library.on_surface(
            *(place(part) for part in parts), sizes, place(plane), ctypes.c_double(gate), place(near)
        )
        return near[:count]
    z = depth.reshape(-1).take(pixels)
    return places[np.abs(z * (design @ plane) - 1.0) < gate]  # false for NaN and for no reading


def is_even(held: int, count: int) -> bool:
    """Whether light is even, by the samples with the surface's colour in the reference's light, and with its tint."""
    return count < LEAST or held >= (1.0 - LEFT_OUT) * count


def gates_of(gate: float) -> Gates:
    """When a colour is the surface's, by the distance within which it is in the light of the reference."""
    return Gates(gate**2, (SURE * gate) ** 2, _TINT * gate, _DIMMEST, _BRIGHTEST, _CUT, UNEVEN)


def tinted_and_even(
    colors: np.ndarray, board: np.ndarray, gate: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Light of samples, which are cut off, have the surface's tint, and have its colour in even light, (n,) each.

    Args:
        colors: Samples, float32 RGB (n, 3).
        board: Colour of the surface in the light of the reference, RGB (3,).
        gate: Distance within which a colour is the surface's in that light [grey levels].
    """
    size = max(float(board @ board), 1.0)
    light = colors @ (board / size).astype(np.float32)
    tint = np.maximum(np.vecdot(colors, colors) - light**2 * size, 0.0)  # squared distance from the surface's tint
    cut = colors.max(axis=1) >= _CUT
    tinted = ((light > _DIMMEST) & (light < _BRIGHTEST) & (tint < (_TINT * gate * light) ** 2)) | cut
    even = tinted & (distances(colors, board, np.ones(len(light), np.float32)) < (SURE * gate) ** 2)
    even &= np.abs(light - 1.0) < UNEVEN  # a dark board's colour holds in much light, the paint's on it does not
    return light, cut, tinted, even


def left_by_two_materials(logarithm: np.ndarray, band: float) -> float:
    """Sum of distances of samples (n,) from the level of their material, the surface's or another one beyond the gate.

    The other is darker or brighter by more than the band, whichever leaves less. Smooth light has every level in
    between, so that this leaves its slope; materials have one level each, and leave noise alone.
    """
    left = []
    for split in (-band, band):
        above = logarithm > split
        count = int(np.count_nonzero(above))
        total, bright = float(logarithm.sum()), float(logarithm @ above)
        levels = np.array(((total - bright) / max(len(logarithm) - count, 1), bright / max(count, 1)))
        left.append(float(np.abs(logarithm - levels[above.view(np.int8)]).sum()))
    return min(left)


def distances(colors: np.ndarray, board: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Squared distances of colours (n, 3) from the surface's in light (n,), as far as the picture can show it."""
    difference = colors - np.minimum(light[:, None] * board, _WHITE)
    return np.vecdot(difference, difference)
