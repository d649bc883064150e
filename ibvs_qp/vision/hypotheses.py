"""Planes through a seed and two random samples near it, and how much agrees with each: the first guess of a surface."""

from __future__ import annotations

import ctypes

import numpy as np

from ibvs_qp.vision.colors import BOARD
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.native import native, place

#: Samples used to judge hypotheses; more cost time and change nothing.
_JUDGED = 400
#: Radius that counts around the seed when hypotheses are judged, normalised.
_NEAR = 0.25
#: Share of the coarse gate within which a sample votes for a hypothesis.
_VOTE = 0.6
#: Smallest area that two arms of a plane span, normalised.
_SPAN = 1e-4


def judged_planes(
    config: PlaneConfig,
    grid: CoarseGrid,
    inverse: np.ndarray,
    seed: tuple[int, int],
    value: float,
    prefer: np.ndarray | None,
    random: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray] | None:
    """Random planes through the seed.

    Args:
        config: Settings.
        grid: Where the samples lie.
        inverse: 1/Z of the samples [1/m], 0 where absent, (rows, columns).
        seed: The cell of the seed.
        value: 1/Z there [1/m].
        prefer: Colour labels of the samples, uint8 (rows, columns), or None.
        random: Source of the samples.

    Returns:
        (a, b, c) of the planes (n, 3) and what agrees with each (n,), or None for too few samples.
    """
    library, place = native(), seed[0] * grid.shape[1] + seed[1]
    if library is None:
        near = near_with_numpy(config, grid, inverse, place, prefer)
    else:
        near = _near_natively(library, config, grid, inverse, place, prefer)
    if len(near) < config.min_samples:
        return None
    pairs, judged = random.choice(near, (2, config.hypotheses)), near[:: max(1, len(near) // _JUDGED)]
    if library is None:
        return judge_with_numpy(config, grid, inverse, place, value, pairs, judged)
    return _judge_natively(library, config, grid, inverse, place, value, pairs, judged)


def near_with_numpy(
    config: PlaneConfig, grid: CoarseGrid, inverse: np.ndarray, seed: int, prefer: np.ndarray | None
) -> np.ndarray:
    """Flat places of the samples near the seed, of the board's colour if enough of them are, (n,)."""
    x, y = (grid.design[:, :2] - grid.design[seed, :2]).T
    usable = (inverse.ravel() > 0) & grid.free.ravel() & (x * x + y * y < config.seed_reach**2)
    if prefer is not None and int((usable & (prefer.ravel() == BOARD)).sum()) >= config.min_samples:
        usable &= prefer.ravel() == BOARD
    return np.flatnonzero(usable)


def judge_with_numpy(
    config: PlaneConfig,
    grid: CoarseGrid,
    inverse: np.ndarray,
    seed: int,
    value: float,
    pairs: np.ndarray,
    judged: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """The planes of the pairs (2, n), and the weight of the judged samples that agree with each."""
    design, flat, origin = grid.design, inverse.ravel(), grid.design[seed]
    arms, rises = design[pairs, :2] - origin[:2], flat[pairs] - value
    (x1, y1), (x2, y2) = (arm.T for arm in arms)
    cross = x1 * y2 - y1 * x2
    safe = np.where(np.abs(cross) > _SPAN, cross, np.inf)
    a, b = (rises[0] * y2 - rises[1] * y1) / safe, (rises[1] * x1 - rises[0] * x2) / safe
    planes = np.column_stack((a, b, value - a * origin[0] - b * origin[1]))
    residual = np.abs(planes @ design[judged].T - flat[judged])
    square = ((design[judged, :2] - origin[:2]) ** 2).sum(axis=1)
    agrees = residual < _VOTE * config.coarse_gate * flat[judged]
    return planes, (agrees * np.exp(-square / _NEAR**2)).sum(axis=1)


def _near_natively(
    library: ctypes.CDLL,
    config: PlaneConfig,
    grid: CoarseGrid,
    inverse: np.ndarray,
    seed: int,
    prefer: np.ndarray | None,
) -> np.ndarray:
    near = np.empty(inverse.size, np.int32)
    parts = (grid.design, inverse, None if prefer is None else np.ascontiguousarray(prefer), grid.free)
    count = library.near_seed(
        *(place(part) for part in parts),
        inverse.size,
        seed,
        ctypes.c_double(config.seed_reach),
        config.min_samples,
        place(near),
    )
    return near[:count]


def _judge_natively(
    library: ctypes.CDLL,
    config: PlaneConfig,
    grid: CoarseGrid,
    inverse: np.ndarray,
    seed: int,
    value: float,
    pairs: np.ndarray,
    judged: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    count, pairs, judged = pairs.shape[1], pairs.astype(np.int64), np.ascontiguousarray(judged, np.int32)
    planes, scores = np.empty((3, count)), np.empty(count)
    library.judge_planes(
        *(place(part) for part in (grid.design, inverse)),
        seed,
        ctypes.c_double(value),
        place(pairs),
        count,
        place(judged),
        len(judged),
        *(ctypes.c_double(number) for number in (_VOTE * config.coarse_gate, _NEAR, _SPAN)),
        *(place(part) for part in (planes, scores)),
    )
    return planes.T, scores
