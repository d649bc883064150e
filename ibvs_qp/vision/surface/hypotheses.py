"""Planes through a seed and two random samples near it, and how much agrees with each: the first guess of a surface."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.appearance.colors import BOARD
from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.kernels.hypotheses import judge_planes
from ibvs_qp.vision.picture.grid import CoarseGrid

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
    place = seed[0] * grid.shape[1] + seed[1]
    near = _near(config, grid, inverse, place, prefer)
    if len(near) < config.min_samples:
        return None
    pairs = random.choice(near, (2, config.hypotheses))
    judged = np.ascontiguousarray(near[:: max(1, len(near) // _JUDGED)])
    flat, gate = np.ascontiguousarray(inverse, float).reshape(-1), _VOTE * config.coarse_gate
    return judge_planes(grid.design, flat, place, value, pairs, judged, gate, _NEAR, _SPAN)


def _near(
    config: PlaneConfig, grid: CoarseGrid, inverse: np.ndarray, seed: int, prefer: np.ndarray | None
) -> np.ndarray:
    """Flat places of the samples near the seed, of the board's colour if enough of them are, (n,)."""
    x, y = (axis - axis.reshape(-1)[seed] for axis in grid.axes)
    usable = (inverse > 0.0) & grid.free & (x * x + y * y < config.seed_reach**2)
    if prefer is not None:
        board = usable & (prefer == BOARD)
        usable = board if int(np.count_nonzero(board)) >= config.min_samples else usable
    return np.flatnonzero(usable)
