"""What most points of a line agree with, before any is fitted."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels.compile import inner
from ibvs_qp.vision.kernels.median import upper_median

#: Shortest distance of the points of a pair [px].
_APART = np.float32(4.0)
#: Share of the points that must agree with a prediction moved across its line, else lines are tried.
_AGREEING = 0.8
#: Places from which pairs are tried.
_STARTS = 20


@inner
def shifted(
    row: np.ndarray, predicted: np.ndarray, good: np.ndarray, gate: float, scratch: np.ndarray, distance: np.ndarray
) -> bool:
    """Distances of points from the prediction moved to the middle of them, and whether most agree with it.

    Args:
        row: Rows of the points [px], (K,).
        predicted: Predicted rows [px], (K,).
        good: Points that count, uint8 (K,).
        gate: Distance within which a point agrees [px].
        scratch: (K,).
        distance: Filled with the distances [px], (K,); not finite without any point.
    """
    count, near = 0, 0
    for k in range(len(row)):
        distance[k] = row[k] - predicted[k]
        if good[k]:
            scratch[count] = distance[k]
            count += 1
    middle = upper_median(scratch, count)
    for k in range(len(row)):
        distance[k] -= middle
        near += good[k] and abs(distance[k]) < gate
    return near >= max(_AGREEING * count, 1.0)


@inner
def consensus(u: np.ndarray, row: np.ndarray, good: np.ndarray, gate: float, distance: np.ndarray) -> bool:
    """Distances from the line that most points agree with, and whether any pair of them spans a line.

    The lines tried run through fixed pairs, a half and a third of the points apart.

    Args:
        u: Columns of the points [px], growing, (K,).
        row: Rows of the points [px], (K,).
        good: Points that count, uint8 (K,).
        gate: Distance within which a point agrees [px].
        distance: Filled with the distances [px], (K,); left alone without any point.
    """
    x, y, count = np.empty(len(u), np.float32), np.empty(len(u), np.float32), 0
    for k in range(len(u)):
        if good[k]:
            x[count], y[count] = u[k], row[k]
            count += 1
    if count == 0:
        return False
    zero, one = np.float32(0.0), np.float32(1.0)
    spans, most, best_slope, best_level = False, -one, zero, zero
    narrow = np.float32(gate)
    scale = -one / (narrow * narrow)
    for pair in range(2 * _STARTS):
        i = int((pair % _STARTS) * (1.0 / (_STARTS - 1)) * (count - 1))
        j = (i + count // (2 if pair < _STARTS else 3)) % count
        run, score = x[j] - x[i], zero
        if not abs(run) > _APART:
            continue
        slope = (y[j] - y[i]) / run
        level = y[i] - slope * x[i]
        for k in range(count):
            d = level + slope * x[k] - y[k]
            score += max(d * d * scale + one, zero)
        if not spans or score > most:
            spans, most, best_slope, best_level = True, score, slope, level
    for k in range(len(u)):
        distance[k] = best_level + best_slope * np.float32(u[k]) - np.float32(row[k])
    return spans
