"""Depth at the samples of a coarse grid."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels.compile import kernel


@kernel("void(f4[:, ::1], i2[:, ::1], f8, f8, f8[::1])")
def sample_depths(depth: np.ndarray, places: np.ndarray, nearest: float, farthest: float, inverse: np.ndarray) -> None:
    """1/Z at places of a picture.

    Args:
        depth: Depth [m], (H, W).
        places: (u, v) [px], (n, 2).
        nearest: Least depth in range [m].
        farthest: Greatest depth in range [m].
        inverse: Is filled with 1/Z [1/m], 0 where absent or out of range, (n,).
    """
    for i in range(len(places)):
        z = np.float64(depth[places[i, 1], places[i, 0]])
        inverse[i] = 1.0 / z if nearest < z < farthest else 0.0


@kernel("void(f4[:, ::1], i2[:, ::1], b1[::1], f8, f8, f8[::1])")
def sample_means(
    depth: np.ndarray, places: np.ndarray, free: np.ndarray, nearest: float, farthest: float, inverse: np.ndarray
) -> None:
    """1/Z of the mean depth of the four pixels around the upper left corner of each place.

    A pixel without a reading pulls the mean far off the surface.

    Args:
        depth: Depth [m], (H, W).
        places: (u, v) [px], (n, 2).
        free: Places that the vehicle does not hide, (n,).
        nearest: Least depth in range [m].
        farthest: Greatest depth in range [m].
        inverse: Is filled with 1/Z [1/m], 0 where hidden, absent or out of range, (n,).
    """
    quarter = np.float32(0.25)
    for i in range(len(places)):
        right, below = np.int64(places[i, 0]), np.int64(places[i, 1])
        left, above = max(right - 1, 0), max(below - 1, 0)
        mean = quarter * depth[above, left] + quarter * depth[above, right]
        mean = mean + quarter * depth[below, left] + quarter * depth[below, right]
        z = np.float64(mean)
        inverse[i] = 1.0 / z if free[i] and nearest < z < farthest else 0.0
