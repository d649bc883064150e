"""Strips of colour across predicted lines: K profiles of M = 2 (reach + side) + 1 pixels around the predicted rows."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels import line_tables as t
from ibvs_qp.vision.kernels.compile import inner


@inner
def gather(
    rgb: np.ndarray,
    mask: np.ndarray,
    view: np.ndarray,
    far: int,
    u: np.ndarray,
    predicted: np.ndarray,
    base: np.ndarray,
    colors: np.ndarray,
    hidden: np.ndarray,
    visible: np.ndarray,
) -> None:
    """Read the pixels of a strip, replicated beyond the picture's border and counted as hidden there.

    Args:
        rgb: Picture, uint8 (H, W, 3).
        mask: Non-zero where the vehicle hides the view, uint8 (H, W).
        view: The line in its view, a row of `line_tables`.
        far: Pixels of a profile on either side of its middle, reach + side.
        u: Filled with the columns of the profiles [px], (K,).
        predicted: Filled with the predicted rows [px], (K,).
        base: Filled with the same in whole pixels, (K,).
        colors: Filled with RGB of the pixels, uint8 (K, 3 M).
        hidden: Filled with non-zero where a pixel is hidden or outside the picture, uint8 (K, M).
        visible: Filled with whether the middle of a profile is neither hidden nor outside, uint8 (K,).
    """
    height, upright = int(view[t.VIEW_HEIGHT]), view[t.VIEW_UPRIGHT] != 0.0
    begin, span, share = view[t.VIEW_FIRST] + 0.5, view[t.VIEW_LAST] - view[t.VIEW_FIRST], 1.0 / (len(u) - 1)
    for k in range(len(u)):
        column = math.floor(begin + span * (k * share))
        row = view[t.VIEW_SLOPE] * column + view[t.VIEW_LEVEL]
        middle = clamped(np.rint(row), -2 * far, height + 2 * far)
        u[k], predicted[k], base[k] = column, row, middle
        along, first = int(column), middle - far
        for i in range(hidden.shape[1]):
            across = min(max(first + i, 0), height - 1)
            x, y = (across, along) if upright else (along, across)
            colors[k, 3 * i] = rgb[y, x, 0]
            colors[k, 3 * i + 1] = rgb[y, x, 1]
            colors[k, 3 * i + 2] = rgb[y, x, 2]
            hidden[k, i] = mask[y, x] if across == first + i else 255
        visible[k] = (hidden[k, far - 2] | hidden[k, far] | hidden[k, far + 2]) == 0


@inner
def clamped(value: float, lowest: int, highest: int) -> int:
    """Whole number within limits, the lowest one if the value is none."""
    if value >= highest:
        return highest
    return int(value) if value > lowest else lowest


@inner
def gradient(colors: np.ndarray, k: int, at: int) -> np.floating:
    """Central difference of one channel at a place of profile k [grey levels per px]."""
    return np.float32(0.5) * (np.float32(colors[k, at + 3]) - np.float32(colors[k, at - 3]))
