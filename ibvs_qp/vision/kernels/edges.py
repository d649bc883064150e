"""Where each profile across a predicted line has its edge."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels import line_tables as t
from ibvs_qp.vision.kernels.compile import inner
from ibvs_qp.vision.kernels.peaks import largest, peak_near, strongest
from ibvs_qp.vision.kernels.strips import gradient

#: Share of the visible profiles, where the line was seen last, below which first sight is not enough.
_ENOUGH = 0.5


@inner
def find_edges(
    view: np.ndarray,
    u: np.ndarray,
    base: np.ndarray,
    colors: np.ndarray,
    side: int,
    unit: np.ndarray,
    limit: float,
    preference: np.ndarray,
    allowed: np.ndarray,
    visible: np.ndarray,
    answers: np.ndarray,
    row: np.ndarray,
    good: np.ndarray,
) -> bool:
    """Sub-pixel row of every profile's strongest answer, and whether it may be an edge of the line.

    Args:
        view: The line in its view, a row of `line_tables`.
        u: Columns of the profiles [px], (K,).
        base: Predicted rows in whole pixels, (K,).
        colors: RGB of the strip's pixels, uint8 (K, 3 M).
        side: Distance of the two sides from the edge [px].
        unit: Half the direction of the colour step, float32 (3,).
        limit: Least answer of an edge [grey levels per px].
        preference: Weight of every place, float32 (n,).
        allowed: Places at which an edge may lie, uint8 (K, n).
        visible: Profiles that can be seen, uint8 (K,).
        answers: Filled with the gradients along the direction, float32 (K, n).
        row: Filled with the rows [px], (K,).
        good: Filled with whether a profile has an edge, uint8 (K,).

    Returns:
        Whether enough of the visible profiles, where the line was seen last, have one.
    """
    red, green, blue, size = unit[0], unit[1], unit[2], len(preference)
    expected, found, mixed = 0, 0, np.empty(size + 2, np.float32)
    for k in range(len(u)):
        for i in range(size + 2):
            at = 3 * (side - 1 + i)
            r, g, b = np.float32(colors[k, at]), np.float32(colors[k, at + 1]), np.float32(colors[k, at + 2])
            mixed[i] = r * red + g * green + b * blue
        for i in range(size):
            answers[k, i] = mixed[i + 2] - mixed[i]
        index = strongest(answers, k, preference)
        place, peak, inside = peak_near(answers, k, index)
        good[k] = inside and peak > limit and allowed[k, index] != 0
        row[k] = base[k] + place
        found += good[k]
        expected += visible[k] != 0 and view[t.VIEW_SEEN_FROM] <= u[k] <= view[t.VIEW_SEEN_TO]
    return found >= _ENOUGH * expected


@inner
def look_again(
    board: bool,
    base: np.ndarray,
    colors: np.ndarray,
    side: int,
    limit: float,
    faint: float,
    preference: np.ndarray,
    allowed: np.ndarray,
    answers: np.ndarray,
    row: np.ndarray,
    good: np.ndarray,
) -> None:
    """Second look at the profiles whose strongest answer is no edge of the line: only at places that may be one.

    The border of the surface is known by its two sides (`board`): beyond it the wall may change from brick to joint,
    and where the known step fails any step counts, even a `faint` one. The other arguments are those of `find_edges`.
    """
    size, lowered, masked = len(preference), limit, np.empty((1, len(preference)), np.float32)
    if board:
        for k in range(len(row)):
            if good[k]:
                continue
            _mask(answers, allowed, k, masked)
            if largest(masked, 0) < limit:
                lowered = faint
                for i in range(size):
                    answers[k, i] = _any_step(colors, k, 3 * (i + side))
    for k in range(len(row)):
        if good[k] or not (board or largest(answers, k) > limit):
            continue
        _mask(answers, allowed, k, masked)
        index = strongest(masked, 0, preference)
        place, peak, inside = peak_near(answers, k, index)
        good[k] = inside and allowed[k, index] != 0 and peak > lowered
        row[k] = base[k] + place


@inner
def _mask(answers: np.ndarray, allowed: np.ndarray, k: int, masked: np.ndarray) -> None:
    """Answers of profile k where an edge may lie, else zero, (1, n)."""
    for i in range(answers.shape[1]):
        masked[0, i] = answers[k, i] if allowed[k, i] else np.float32(0.0)


@inner
def _any_step(colors: np.ndarray, k: int, at: int) -> float:
    """Length of the colours' gradient at a place of profile k [grey levels per px]."""
    red, green, blue = gradient(colors, k, at), gradient(colors, k, at + 1), gradient(colors, k, at + 2)
    return math.sqrt(red * red + green * green + blue * blue)
