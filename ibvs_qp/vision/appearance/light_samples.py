"""What samples of colours tell of light: which are on the surface, and whether it is one material."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.picture.grid import CoarseGrid

#: Samples that are judged; more cost time and change nothing.
JUDGED = 600
#: Light is uneven only where one level leaves out this share of what has the surface's tint.
LEFT_OUT = 0.02
#: Fewer samples tell nothing of the light.
LEAST = 40
#: The highest that a channel can be [grey levels].
_WHITE = np.float32(255.0)


def on_surface(
    grid: CoarseGrid, depth: np.ndarray, plane: np.ndarray, gate: float, places: np.ndarray | None = None
) -> np.ndarray:
    """Flat places of samples of the grid that lie on a surface by depth alone, whatever their colour, (n,).

    Args:
        grid: Coarse grid of the picture.
        depth: Depth [m], (H, W).
        plane: (a, b, c) of 1/Z = a x + b y + c [1/m], (3,).
        gate: Distance from the surface within which a sample is on it, share of depth.
        places: Flat places of the samples, (m,); None for some all over the picture.
    """
    if places is None:
        places, pixels, design = grid.some(JUDGED)
        z = depth.reshape(-1).take(pixels)
    else:
        u, v = (axis.take(places) for axis in grid.pixels)
        z, design = depth[v, u], grid.design.take(places, axis=0)
    return places[np.abs(z * (design @ plane) - 1.0) < gate]  # false for NaN and for no reading


def is_even(held: int, count: int) -> bool:
    """Whether light is even, by the samples with the surface's colour in the reference's light, and with its tint."""
    return count < LEAST or held >= (1.0 - LEFT_OUT) * count


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
