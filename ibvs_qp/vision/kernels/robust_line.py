"""Robust straight line through one point per profile: Tukey's weights, and the variances that the residuals tell."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels.compile import inner
from ibvs_qp.vision.kernels.median import upper_median
from ibvs_qp.vision.robust import MAD_TO_SIGMA

#: Tukey's constant: 95 % efficiency on normal residuals.
_TUKEY = 4.685
#: Smallest residual scale [px]: below this, all residuals are rounding.
_SCALE_MIN = 0.02
#: Largest correlation of neighbouring residuals accounted for.
_CORRELATION_MAX = 0.8


@inner
def robust_line(
    u: np.ndarray, v: np.ndarray, used: np.ndarray, count: int, residual: np.ndarray, weight: np.ndarray
) -> tuple[float, float, float, float, float, float]:
    """Tukey-weighted least-squares line through the used points, in two rounds; gross errors are out already.

    Args:
        u: Columns of the points [px], growing, (K,).
        v: Rows of the points [px], (K,).
        used: Points that count, uint8 (K,).
        count: How many these are.
        residual: Scratch, (K,).
        weight: Scratch, (K,).

    Returns:
        Level [px], slope and centre [px] of v = level + slope (u - centre), variances of level and slope, rms [px].
    """
    size = len(u)
    middle, half = 0.5 * (u[0] + u[size - 1]), max(0.5 * (u[size - 1] - u[0]), 1.0)
    slope, level, center, spread, unit = 0.0, 0.0, 0.0, 1.0, 0.0
    for k in range(size):
        weight[k] = used[k]
    for turn in range(2):
        total, along, square, rows, product = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(size):
            a, w = (u[k] - middle) / half, weight[k]
            total += w
            along += w * a
            square += w * (a * a)
            rows += w * v[k]
            product += w * (a * v[k])
        total = max(total, 1e-9)
        center = along / total
        spread = max(square - along * center, 1e-9)
        slope = (product - rows * center) / spread
        level = rows / total
        for k in range(size):
            residual[k] = v[k] - (level - slope * center) - slope * ((u[k] - middle) / half)
        if turn == 0:
            unit = 1.0 / (_TUKEY * max(MAD_TO_SIGMA * _middle_size(residual, used, weight), _SCALE_MIN))
        for k in range(size):
            share = residual[k] * unit
            left = max(1.0 - share * share, 0.0)
            weight[k] = left * left * used[k]
    variance, total, rms = _variance(residual, weight, used, count)
    slope_variance = variance / (spread * half * half)
    return level, slope / half, middle + half * center, variance / total, slope_variance, rms


@inner
def _middle_size(residual: np.ndarray, used: np.ndarray, scratch: np.ndarray) -> float:
    """Median size of the residuals of the used points; 0 without any."""
    count = 0
    for k in range(len(residual)):
        if used[k]:
            scratch[count] = abs(residual[k])
            count += 1
    return upper_median(scratch, count) if count else 0.0


@inner
def _variance(residual: np.ndarray, weight: np.ndarray, used: np.ndarray, count: int) -> tuple[float, float, float]:
    """Variance of one point, inflated where neighbouring residuals agree, the sum of weights and the rms [px]."""
    total, square, neighbours, residuals, before = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(residual)):
        r = residual[k] * used[k]
        weighted = weight[k] * r
        total += weight[k]
        square += weighted * r
        residuals += r * r
        neighbours += before * weighted
        before = weighted
    total = max(total, 1.0)
    variance = square / max(total - 2.0, 1.0) + _SCALE_MIN * _SCALE_MIN / 12.0
    correlation = min(max(neighbours / max(square, 1e-12), 0.0), _CORRELATION_MAX)
    variance *= (1.0 + correlation) / (1.0 - correlation)
    return variance, total, math.sqrt(residuals / max(count, 1.0))
