"""Colours before and behind a fitted line, in its strip."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels import line_tables as t
from ibvs_qp.vision.kernels.compile import inner
from ibvs_qp.vision.kernels.strips import clamped


@inner
def _index_of(row: float, base: float, reach: int, side: int) -> int:
    """Pixel of a profile in a row, at most the searched ones."""
    return reach + side + clamped(np.rint(row - base), -reach, reach)


@inner
def step_across(
    colors: np.ndarray,
    row: np.ndarray,
    base: np.ndarray,
    support: np.ndarray,
    reach: int,
    side: int,
    fit: np.ndarray,
) -> float:
    """Mean colour step of the supporting profiles, and its squared size.

    Args:
        colors: RGB of the strip's pixels, uint8 (K, 3 M).
        row: Rows of the edges [px], (K,).
        base: Predicted rows in whole pixels, (K,).
        support: Profiles that agree, uint8 (K,).
        reach: Rows searched on either side of the prediction.
        side: Distance of the two sides from the edge [px].
        fit: Its step is filled in; a row of `line_tables`.
    """
    red, green, blue = 0.0, 0.0, 0.0
    for k in range(len(row)):
        if not support[k]:
            continue
        index = _index_of(row[k], base[k], reach, side)
        before, behind = 3 * (index - side), 3 * (index + side)
        red += float(colors[k, behind]) - float(colors[k, before])
        green += float(colors[k, behind + 1]) - float(colors[k, before + 1])
        blue += float(colors[k, behind + 2]) - float(colors[k, before + 2])
    total = max(fit[t.FIT_COUNT], 1.0)
    red, green, blue = red / total, green / total, blue / total
    fit[t.FIT_RED], fit[t.FIT_GREEN], fit[t.FIT_BLUE] = red, green, blue
    return red * red + green * green + blue * blue


@inner
def copy_contents(
    view: np.ndarray,
    fit: np.ndarray,
    colors: np.ndarray,
    u: np.ndarray,
    base: np.ndarray,
    support: np.ndarray,
    reach: int,
    side: int,
    sides: np.ndarray,
    pixels: np.ndarray,
) -> None:
    """Colours on both sides of a fitted line at its supporting profiles, and the places of these.

    Args:
        view: The line's view, a row of `line_tables`.
        fit: The fit, a row of `line_tables`.
        colors: RGB of the strip's pixels, uint8 (K, 3 M).
        u: Columns of the profiles [px], (K,).
        base: Predicted rows in whole pixels, (K,).
        support: Profiles that agree, uint8 (K,).
        reach: Rows searched on either side of the prediction.
        side: Distance of the two sides from the edge [px].
        sides: Its first places are filled with the colours before and behind along the normal, uint8 (2, N, 3).
        pixels: Its first places are filled with the places on the line [px], (N, 2).
    """
    count, upright, behind = 0, int(view[t.VIEW_UPRIGHT]), 1 if view[t.VIEW_SIGN] > 0.0 else 0
    for k in range(len(u)):
        if not support[k]:
            continue
        v = fit[t.FIT_LEVEL] + fit[t.FIT_SLOPE] * (u[k] - fit[t.FIT_CENTER])
        pixels[count, upright], pixels[count, 1 - upright] = u[k], v
        index = _index_of(v, base[k], reach, side)
        for c in range(3):
            sides[1 - behind, count, c] = colors[k, 3 * (index - side) + c]
            sides[behind, count, c] = colors[k, 3 * (index + side) + c]
        count += 1
