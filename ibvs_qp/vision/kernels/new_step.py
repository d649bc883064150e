"""The colour step of a new line: what its strip shows."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels.compile import inner
from ibvs_qp.vision.kernels.median import upper_median
from ibvs_qp.vision.kernels.strips import gradient

#: Turns a gradient's peak into the size of the step: a blur of 0.7 px leaves 0.4 of it.
_PEAK_TO_STEP = np.float32(2.5)
#: Profiles that tell the step: gradients above this share of the median one.
_TELLING = np.float32(0.5)


@inner
def new_step(colors: np.ndarray, allowed: np.ndarray, side: int, polarity: int, direction: np.ndarray) -> None:
    """Typical strongest colour step along +v of a strip.

    Args:
        colors: RGB of the strip's pixels, uint8 (K, 3 M).
        allowed: Places at which an edge may lie, uint8 (K, n).
        side: Distance of the two sides from an edge [px].
        polarity: +1 or -1 if the colours rise or fall along +v, 0 if unknown.
        direction: Filled with the step [grey levels], (3,); zero if nothing tells it.
    """
    profiles = len(colors)
    weights, values, steps = np.empty(profiles, np.float32), np.empty(profiles), np.empty((profiles, 3), np.float32)
    for k in range(profiles):
        best, most = _strongest_step(colors, allowed, k, side, polarity)
        weights[k] = np.float32(0.5) * np.float32(most)  # differences are twice the gradients
        values[k] = weights[k]
        for c in range(3):
            steps[k, c] = gradient(colors, k, 3 * (best + side) + c)
    least = _TELLING * np.float32(upper_median(values, profiles))
    for c in range(3):
        count = 0
        for k in range(profiles):
            if weights[k] > least:
                values[count] = steps[k, c]
                count += 1
        direction[c] = _PEAK_TO_STEP * np.float32(upper_median(values, count)) if count else 0.0


@inner
def _strongest_step(colors: np.ndarray, allowed: np.ndarray, k: int, side: int, polarity: int) -> tuple[int, np.int64]:
    """Place and size of the largest difference of any channel of profile k."""
    best, most = 0, np.int64(0)
    for i in range(allowed.shape[1]):
        at = 3 * (i + side)  # differences of grey levels have a sign: int() of them would not
        red = np.int64(colors[k, at + 3]) - np.int64(colors[k, at - 3])
        green = np.int64(colors[k, at + 4]) - np.int64(colors[k, at - 2])
        blue = np.int64(colors[k, at + 5]) - np.int64(colors[k, at - 1])
        if polarity == 0:
            size = max(max(abs(red), abs(green)), abs(blue))
        else:
            size = max(max(polarity * red, polarity * green), polarity * blue)
        if size > most and allowed[k, i]:
            best, most = i, size
    return best, most
