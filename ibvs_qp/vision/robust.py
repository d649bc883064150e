"""Robust straight lines through (u, v) points, many lines at once: consensus start, Tukey fit, longest runs.

The points of every line stand in one row of (L, K) arrays; `packed` moves those that count to the front.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: Tukey's constant: 95 % efficiency on normal residuals.
_TUKEY = 4.685
#: Smallest residual scale [px]: below this, all residuals are rounding.
_SCALE_MIN = 0.02
_MAD = 1.4826
#: Rounds of reweighting.
_ROUNDS = 3
#: Places from which pairs of points are tried for the start.
_STARTS = np.linspace(0.0, 1.0, 20)
#: Shortest distance of the points of a pair [px].
_APART = 4.0
#: Largest correlation of neighbouring residuals accounted for.
_CORRELATION_MAX = 0.8


@dataclass
class LineFits:
    """Lines v = level + slope (u - center), (L,) each.

    Attributes:
        level: Row at the centre [px].
        slope: Rows per column.
        center: Weighted mean of u [px].
        level_variance: Of the level [px^2]: sigma^2/N, inflated where neighbouring residuals agree.
        slope_variance: Of the slope: sigma^2/N 12/L^2, inflated the same.
        rms: Of the residuals [px].
    """

    level: np.ndarray
    slope: np.ndarray
    center: np.ndarray
    level_variance: np.ndarray
    slope_variance: np.ndarray
    rms: np.ndarray

    def rows(self, u: np.ndarray) -> np.ndarray:
        """Rows at the columns of every line, (L, K)."""
        return self.level[:, None] + self.slope[:, None] * (u - self.center[:, None])


def median(values: np.ndarray) -> float:
    """Upper median of a one-dimensional array; ten times faster than numpy's on the short arrays of this package."""
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])


def masked_median(values: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Upper median along the last axis of the used ones among values (L, K) or (L, C, K), used (L, K)."""
    lines, size = used.shape
    shown = used if values.ndim == 2 else used[:, None]
    ordered = np.sort(np.where(shown, values, np.float32(np.inf)), axis=-1)
    middle = np.minimum(np.count_nonzero(used, axis=1) // 2, size - 1)
    if values.ndim == 2:
        return ordered[np.arange(lines), middle]
    return ordered[np.arange(lines), :, middle]


def packed(used: np.ndarray, *arrays: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """Counts of the used points of every line, (L,), and the arrays (L, K) with these points in front, in order."""
    lines, size = used.shape
    order = np.argsort(~used, axis=1, kind="stable") + size * np.arange(lines)[:, None]
    return np.count_nonzero(used, axis=1), [array.take(order) for array in arrays]


def consensus_lines(
    u: np.ndarray, v: np.ndarray, count: np.ndarray, gate: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lines v = level + slope u that most points agree with, from fixed pairs a half and a third of the points apart.

    Args:
        u: Positions along the lines [px], growing, packed (L, K).
        v: Positions across them [px], packed (L, K).
        count: Points of every line, (L,).
        gate: Distance within which a point agrees [px].

    Returns:
        Levels at u = 0, slopes, and whether any pair spans anything, (L,) each.
    """
    lines, size = u.shape
    counts = np.maximum(count, 1)[:, None]
    one = (_STARTS * (counts - 1)).astype(np.intp)
    start = size * np.arange(lines)[:, None]
    two = np.concatenate(((one + counts // 2) % counts, (one + counts // 3) % counts), axis=1) + start
    one = np.concatenate((one, one), axis=1) + start
    u_one, v_one = u.take(one), v.take(one)
    run = u.take(two) - u_one
    apart = np.abs(run) > _APART
    slope = (v.take(two) - v_one) / np.where(apart, run, np.inf)
    level = v_one - slope * u_one
    residual = (v[:, None, :] - level[:, :, None] - slope[:, :, None] * u[:, None, :]) * (1.0 / gate)
    valid = (np.arange(size) < count[:, None]).astype(float)
    score = (np.maximum(0.0, 1.0 - residual * residual) @ valid[:, :, None])[:, :, 0]
    best = (np.argmax(np.where(apart, score, -1.0), axis=1), apart.any(axis=1))
    chosen = best[0] + slope.shape[1] * np.arange(lines)
    return level.take(chosen), slope.take(chosen), best[1]


def robust_lines(u: np.ndarray, v: np.ndarray, count: np.ndarray) -> LineFits:
    """Tukey-weighted least-squares lines through the first `count` points of every row of packed (L, K) arrays."""
    valid = np.arange(u.shape[1]) < count[:, None]
    weight = valid.astype(float)
    level = slope = center = along_square = np.zeros(len(u))
    residual = v
    for _ in range(_ROUNDS):
        total = np.maximum(weight.sum(axis=1), 1e-9)
        center = np.vecdot(weight, u) / total
        along = u - center[:, None]
        weighted = weight * along
        along_square = np.maximum(np.vecdot(weighted, along), 1e-9)
        level = np.vecdot(weight, v) / total
        offset = v - level[:, None]
        slope = np.vecdot(weighted, offset) / along_square
        residual = offset - slope[:, None] * along
        scale = np.maximum(_MAD * masked_median(np.abs(residual), valid), _SCALE_MIN)
        scale[count == 0] = 1.0
        weight = np.maximum(0.0, 1.0 - (residual / (_TUKEY * scale)[:, None]) ** 2) ** 2 * valid
    total = np.maximum(weight.sum(axis=1), 1.0)
    residual = np.where(valid, residual, 0.0)
    weighted = weight * residual
    square = np.vecdot(weighted, residual)
    variance = square / np.maximum(total - 2.0, 1.0) + _SCALE_MIN**2 / 12.0
    neighbours = np.vecdot(weighted[:, :-1], weighted[:, 1:]) / np.maximum(square, 1e-12)
    neighbours = np.minimum(np.maximum(neighbours, 0.0), _CORRELATION_MAX)
    variance = variance * (1.0 + neighbours) / (1.0 - neighbours)
    rms = np.sqrt(np.vecdot(residual, residual) / np.maximum(count, 1))
    return LineFits(level, slope, center, variance / total, variance / along_square, rms)


def longest_runs(support: np.ndarray, visible: np.ndarray, bridge: int) -> list[tuple[int, int]]:
    """First and last index of each line's run with most support; up to `bridge` visible misses in a row are bridged.

    Hidden places never break a run; a line without support has the run (0, 0).
    """
    lines, size = support.shape
    runs = [(0, 0)] * lines
    held = np.flatnonzero(support)
    if len(held) == 0:
        return runs
    missed = np.cumsum(visible & ~support).take(held)
    breaks = np.flatnonzero((np.diff(missed) > bridge) | (np.diff(held // size) > 0)) + 1
    starts, ends = [0, *breaks.tolist()], [*breaks.tolist(), len(held)]
    most = [0] * lines
    for start, end in zip(starts, ends, strict=True):
        line = int(held[start]) // size
        if end - start > most[line]:
            most[line] = end - start
            runs[line] = (int(held[start]) % size, int(held[end - 1]) % size)
    return runs
