"""Points that are followed: what their surroundings tell, and how far they are."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels.compile import inner, kernel
from ibvs_qp.vision.kernels.median import upper_median

#: Squared scale of a 3x3 Sobel kernel, whose weights are eight times those of a derivative.
_SOBEL = 64.0


@inner
def _mirrored(i: int, n: int) -> int:
    """Index within a row of n, mirrored at its ends without repeating them."""
    if i < 0:
        return -i
    return i if i < n else 2 * n - 2 - i


@inner
def _told(value: float, floor: float, noise: float, error: float) -> float:
    """Square root of what following a point tells along one principal direction: its own error bounds it."""
    information = max(0.0, value - floor) / noise
    return math.sqrt(information / (1.0 + information * error))


@kernel("f8[:, :, ::1](u1[:, ::1], f4[:, ::1], i8, f8, f8, f8)")
def information_roots(
    grey: np.ndarray, points: np.ndarray, reach: int, floor: float, noise: float, error: float
) -> np.ndarray:
    """Square roots of the information that following each point carries.

    Args:
        grey: The picture, (H, W).
        points: Places [px], (n, 2).
        reach: Half width of the window [px].
        floor: What noise alone makes of the structure tensor [grey levels squared].
        noise: Variance of the picture [grey levels squared].
        error: Variance of a followed point that structure cannot lower [px2].

    Returns:
        Symmetric [1/px], (n, 2, 2).
    """
    height, width = grey.shape
    roots = np.empty((len(points), 2, 2))
    for i in range(len(points)):
        u, v = np.int64(np.rint(points[i, 0])), np.int64(np.rint(points[i, 1]))
        sum_xx, sum_xy, sum_yy = 0, 0, 0
        for dv in range(-reach, reach + 1):
            row = min(max(v + dv, 0), height - 1)
            above, at, below = grey[_mirrored(row - 1, height)], grey[row], grey[_mirrored(row + 1, height)]
            for du in range(-reach, reach + 1):
                c = min(max(u + du, 0), width - 1)
                l, r = _mirrored(c - 1, width), _mirrored(c + 1, width)  # noqa: E741
                right = np.int64(above[r]) + 2 * np.int64(at[r]) + np.int64(below[r])
                left = np.int64(above[l]) + 2 * np.int64(at[l]) + np.int64(below[l])
                lower = np.int64(below[l]) + 2 * np.int64(below[c]) + np.int64(below[r])
                upper = np.int64(above[l]) + 2 * np.int64(above[c]) + np.int64(above[r])
                gx, gy = right - left, lower - upper
                sum_xx, sum_xy, sum_yy = sum_xx + gx * gx, sum_xy + gx * gy, sum_yy + gy * gy
        xx, xy, yy = sum_xx / _SOBEL, sum_xy / _SOBEL, sum_yy / _SOBEL
        middle, half = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
        high, low = _told(middle + half, floor, noise, error), _told(middle - half, floor, noise, error)
        slope, level = (high - low) / (2.0 * half) if half > 0.0 else 0.0, 0.5 * (high + low)
        roots[i, 0, 0], roots[i, 1, 1] = level + slope * (xx - middle), level + slope * (yy - middle)
        roots[i, 0, 1] = roots[i, 1, 0] = slope * xy
    return roots


@kernel("f8[::1](f8[:, ::1], f4[:, ::1], f8[::1], f8[::1], f8, i8, i8)")
def point_depths(
    bearings: np.ndarray,
    depth: np.ndarray,
    intrinsics: np.ndarray,
    plane: np.ndarray,
    gate: float,
    cross: int,
    least: int,
) -> np.ndarray:
    """1/Z of points: the surface's where they lie on it, else the median of five readings.

    Args:
        bearings: The points, normalised, (n, 2).
        depth: Depth [m], (H, W).
        intrinsics: (fx, fy, cx, cy) [px], (4,).
        plane: (a, b, c) of the surface [1/m], or empty.
        gate: A point this near to it lies on it, share of 1/Z.
        cross: Distance of the four further places at which the depth of a point is read [px].
        least: How many readings must be valid.

    Returns:
        1/Z [1/m], 0 if unknown, (n,).
    """
    height, width = depth.shape
    fx, fy, cx, cy = intrinsics
    steps = ((0, 0), (0, -cross), (0, cross), (-cross, 0), (cross, 0))
    inverse, readings = np.empty(len(bearings)), np.empty(5)
    for i in range(len(bearings)):
        x, y = bearings[i]
        # held to the picture as floats: a point may be anywhere, or not a number
        column = np.int64(min(max(float(cross), np.rint(x * fx + cx)), float(width - 1 - cross)))
        row = np.int64(min(max(float(cross), np.rint(y * fy + cy)), float(height - 1 - cross)))
        count = 0
        for down, right in steps:
            z = depth[row + down, column + right]
            if z > 0.0 and z < np.inf:
                readings[count] = z
                count += 1
        inverse[i] = np.float32(1.0) / np.float32(upper_median(readings, count)) if count >= least else 0.0
        if plane.size and inverse[i] > 0.0:
            surface = x * plane[0] + y * plane[1] + plane[2]
            if abs(inverse[i] - surface) < gate * abs(surface):
                inverse[i] = surface
    return inverse
