"""A plane grown outwards from a seed, so that it cannot tilt through the surface and a wall close behind it."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.config import PlaneConfig
from ibvs_qp.vision.picture.grid import CoarseGrid
from ibvs_qp.vision.robust import MAD_TO_SIGMA, median

#: Distances from the seed up to which samples count, one after the other, normalised.
_RADII = (0.10, 0.14, 0.20, 0.28, 0.40, 0.60)
#: Fewer samples near the seed give no plane.
_LEAST = 40


def grown_plane(
    grid: CoarseGrid, inverse: np.ndarray, seed: tuple[int, int], start: np.ndarray, config: PlaneConfig
) -> np.ndarray:
    """Least-squares plane of the samples around a seed, the gate known from those nearer to it.

    Args:
        grid: Where the samples lie.
        inverse: 1/Z of the samples [1/m], 0 where absent, (rows, columns).
        seed: Cell on the surface.
        start: (a, b, c) of a plane through the seed, good near it.
        config: Gates.

    Returns:
        (a, b, c); the start where too few samples agree.
    """
    flat, design = inverse.ravel(), grid.design
    origin = design[seed[0] * grid.shape[1] + seed[1], :2]
    distance = np.hypot(*(design[:, :2] - origin).T)
    plane, gate = start, config.coarse_gate
    for radius in _RADII:
        near = np.flatnonzero((flat > 0.0) & (distance < radius))
        if len(near) < _LEAST:
            continue
        relative = flat[near] / np.maximum(design[near] @ plane, 1e-3) - 1.0
        inlier = np.abs(relative) < gate
        if int(inlier.sum()) < _LEAST:
            return plane
        chosen = near[inlier]
        samples = design[chosen]
        normal_matrix = samples.T @ samples
        if np.linalg.cond(normal_matrix) > 1e10:
            return plane
        plane = np.linalg.solve(normal_matrix, samples.T @ flat[chosen])
        residual = flat[chosen] / np.maximum(samples @ plane, 1e-3) - 1.0
        sigma = MAD_TO_SIGMA * median(np.abs(residual))
        gate = min(max(config.fine_gate_sigmas * sigma, config.fine_gate_low), config.fine_gate_high)
    return plane
