"""Robust straight lines through one point per profile, many lines at once: Tukey fit, runs of support."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.consensus import middle_values
from ibvs_qp.vision.robust import MAD_TO_SIGMA

#: Tukey's constant: 95 % efficiency on normal residuals.
_TUKEY = 4.685
#: Smallest residual scale [px]: below this, all residuals are rounding.
_SCALE_MIN = 0.02
#: Rounds of fitting, the first with equal weights.
_ROUNDS = 2
#: Largest correlation of neighbouring residuals accounted for.
_CORRELATION_MAX = 0.8


@dataclass(frozen=True, slots=True)
class LineFit:
    """A line v = level + slope (u - center), in plain numbers: arrays of a few elements cost ten times as much.

    Attributes:
        level: Row at the centre [px].
        slope: Rows per column.
        center: Weighted mean of u [px].
        level_variance: Of the level [px^2]: sigma^2/N, inflated where neighbouring residuals agree.
        slope_variance: Of the slope: sigma^2/N 12/L^2, inflated the same.
        rms: Of the residuals [px].
    """

    level: float
    slope: float
    center: float
    level_variance: float
    slope_variance: float
    rms: float


def fitted_rows(lines: list[LineFit], u: np.ndarray) -> np.ndarray:
    """Rows at the columns (L, K) of every line, (L, K)."""
    at_zero, slope = np.array([(line.level - line.slope * line.center, line.slope) for line in lines]).T[:, :, None]
    return at_zero + slope * u


def robust_lines(u: np.ndarray, v: np.ndarray, used: np.ndarray, count: np.ndarray) -> list[LineFit]:
    """Tukey-weighted least-squares lines through the used points; gross errors are out already.

    Args:
        u: Positions along the lines [px], growing, (L, K).
        v: Positions across them [px], (L, K).
        used: Points that count, bool (L, K).
        count: How many these are, (L,).
    """
    middle = 0.5 * (u[:, :1] + u[:, -1:])
    half = np.maximum(0.5 * (u[:, -1:] - u[:, :1]), 1.0)
    along = (u - middle) / half
    basis = np.empty((*u.shape, 5))
    basis[:, :, 0], basis[:, :, 1], basis[:, :, 3] = 1.0, along, v
    np.multiply(along[:, :, None], basis[:, :, 1:4:2], out=basis[:, :, 2:5:2])
    weight = mask = used.astype(float)
    unit, residual, solved = None, v, []
    for _ in range(_ROUNDS):
        solved = [_solve(*sums) for sums in (weight[:, None] @ basis)[:, 0].tolist()]
        at_middle, slope = np.array([entry[:2] for entry in solved]).T[:, :, None]
        residual = v - at_middle
        residual -= slope * along
        unit = _unit(residual, used, count) if unit is None else unit
        weight = _tukey(residual, unit)
        weight *= mask
    residual = residual * mask
    weighted = weight * residual
    sums = (
        weight.sum(axis=1),
        np.vecdot(weighted, residual),
        np.vecdot(weighted[:, :-1], weighted[:, 1:]),
        np.vecdot(residual, residual),
        count,
        half[:, 0],
        middle[:, 0],
    )
    return [_line(line, *numbers) for line, *numbers in zip(solved, *(part.tolist() for part in sums), strict=True)]


def _solve(
    total: float, along: float, square: float, rows: float, product: float
) -> tuple[float, float, float, float, float]:
    """Row in the middle, slope, row at the centre, centre and spread from weighted sums."""
    total = max(total, 1e-9)
    center = along / total
    spread = max(square - along * center, 1e-9)
    slope, level = (product - rows * center) / spread, rows / total
    return level - slope * center, slope, level, center, spread


def _line(
    solved: tuple[float, float, float, float, float],
    total: float,
    square: float,
    neighbours: float,
    residuals: float,
    count: float,
    half: float,
    middle: float,
) -> LineFit:
    """A fit with the variances that its residuals tell."""
    _, slope, level, center, spread = solved
    total = max(total, 1.0)
    variance = square / max(total - 2.0, 1.0) + _SCALE_MIN**2 / 12.0
    correlation = min(max(neighbours / max(square, 1e-12), 0.0), _CORRELATION_MAX)
    variance *= (1.0 + correlation) / (1.0 - correlation)
    return LineFit(
        level,
        slope / half,
        middle + half * center,
        variance / total,
        variance / (spread * half * half),
        math.sqrt(residuals / max(count, 1)),
    )


def _unit(residual: np.ndarray, used: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Inverse of the residual at which a point has no weight, from the median one of each line, (L, 1)."""
    middle = middle_values(np.abs(residual), used, count)
    middle = [0.0 if value == math.inf else value for value in middle.tolist()]
    return np.array([1.0 / (_TUKEY * max(MAD_TO_SIGMA * value, _SCALE_MIN)) for value in middle])[:, None]


def _tukey(residual: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Weights by residuals."""
    weight = residual * unit
    weight *= weight
    np.subtract(1.0, weight, out=weight)
    np.maximum(weight, 0.0, out=weight)
    weight *= weight
    return weight


def longest_runs(support: np.ndarray, visible: np.ndarray, bridge: int) -> list[tuple[int, int]]:
    """First and last index of each line's run with most support; up to `bridge` visible misses in a row are bridged.

    Hidden places never break a run; a line without support has the run (0, 0).
    """
    lines, size = support.shape
    runs, most = [(0, 0)] * lines, [0] * lines
    held = np.flatnonzero(support)
    if len(held) == 0:
        return runs
    line = held // size
    missed = (visible > support).cumsum().take(held)
    gaps = (missed[1:] - missed[:-1] > bridge) | (line[1:] != line[:-1])
    breaks = (np.flatnonzero(gaps) + 1).tolist()
    for start, end in zip([0, *breaks], [*breaks, len(held)], strict=True):
        k = int(line[start])
        if end - start > most[k]:
            most[k] = end - start
            runs[k] = (int(held[start]) - k * size, int(held[end - 1]) - k * size)
    return runs
