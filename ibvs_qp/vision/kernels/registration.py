"""Depth of one camera seen by another: forward projection with a z-buffer, and cracks of one pixel closed."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels.compile import inner, kernel

#: A reading hides another that is farther by this share; closer ones are of the same surface.
HIDES = np.float32(0.01)
#: Both sides of a crack agree to this share, and the surface that shows through is farther by more.
AGREES = np.float32(0.02)
_ONE, _HALF = np.float32(1.0), np.float32(0.5)
#: Beyond every picture [px].
_FAR = np.float32(1e6)


@kernel("void(f4[:, ::1], f4[:, :, ::1], f4[::1], f4[::1], f4[:, ::1])")
def project_depth(
    depth: np.ndarray, rays: np.ndarray, shift: np.ndarray, half: np.ndarray, nearest: np.ndarray
) -> None:
    """Depth in the target picture of every reading, on all pixels that it covers.

    Args:
        depth: Readings [m], (h, w); not above 0 for none.
        rays: Of every reading per depth: target column, row and 1, each times the target's depth, (h, 3, w).
        shift: The same of the source camera's centre [m], (3,).
        half: Half the width and height of a reading in the target [px], (2,).
        nearest: Depth of the target [m], (H, W), zero before.
    """
    height, width = depth.shape
    ahead, covered = np.empty(width, np.float32), np.empty((4, width), np.int32)
    for i in range(height):
        cover(depth[i], rays[i], shift, half, nearest.shape, ahead, covered)
        for j in range(width):
            z = ahead[j]
            hidden = z * (_ONE + HIDES)
            for row in range(covered[0, j], covered[1, j]):
                for column in range(covered[2, j], covered[3, j]):
                    other = nearest[row, column]
                    if other == 0 or other > hidden:
                        nearest[row, column] = z


@inner
def cover(
    depth: np.ndarray,
    rays: np.ndarray,
    shift: np.ndarray,
    half: np.ndarray,
    shape: tuple[int, int],
    ahead: np.ndarray,
    covered: np.ndarray,
) -> None:
    """Depth in the target of a row of readings, (w,), and the rows and columns that they cover, (4, w).

    Rows are from ``covered[0]`` to before ``covered[1]``, columns from ``covered[2]`` to before ``covered[3]``; none
    for what is out of view. One loop without jumps: the processor takes several readings at once.
    """
    rows, columns = np.float32(shape[0]), np.float32(shape[1])
    (wide, high), (a, b, c) = (half[0], half[1]), (shift[0], shift[1], shift[2])
    for j in range(len(depth)):
        z = depth[j]
        far = z * rays[2, j] + c
        scale = _ONE / far
        u, v = (z * rays[0, j] + a) * scale, (z * rays[1, j] + b) * scale
        seen = (z > 0) & (far > 0) & (u > -_ONE) & (v > -_ONE) & (u < columns) & (v < rows)  # false for NaN, too
        u, v = (u if seen else -_FAR), (v if seen else -_FAR)
        left, right = np.floor(u - wide) + _ONE, np.floor(u + wide) + _ONE
        top, bottom = np.floor(v - high) + _ONE, np.floor(v + high) + _ONE
        middle, level = np.floor(u + _HALF), np.floor(v + _HALF)
        thin, flat = left >= right, top >= bottom  # between the middles of two pixels: the nearer one
        left, right = (middle if thin else left), (middle + _ONE if thin else right)
        top, bottom = (level if flat else top), (level + _ONE if flat else bottom)
        ahead[j] = far
        covered[0, j] = np.int32(top if top > 0 else np.float32(0))
        covered[1, j] = np.int32(bottom if bottom < rows else rows)
        covered[2, j] = np.int32(left if left > 0 else np.float32(0))
        covered[3, j] = np.int32(right if right < columns else columns)


@kernel("void(f4[:, ::1], f4[:, ::1])")
def close_cracks(nearest: np.ndarray, closed: np.ndarray) -> None:
    """Write the depth with cracks closed: pixels without a reading, or with one behind, between two that agree.

    Args:
        nearest: Depth [m], (H, W), 0 for none.
        closed: Result, (H, W).
    """
    rows, columns = nearest.shape
    for i in range(rows):
        for j in range(columns):
            z = nearest[i, j]
            if 0 < j < columns - 1:
                a, b = nearest[i, j - 1], nearest[i, j + 1]
                near, far = min(a, b), max(a, b)
                if near > 0 and far - near <= AGREES * near and (z == 0 or z > far * (_ONE + AGREES)):
                    closed[i, j] = _HALF * (a + b)
                    continue
            if 0 < i < rows - 1:
                a, b = nearest[i - 1, j], nearest[i + 1, j]
                near, far = min(a, b), max(a, b)
                if near > 0 and far - near <= AGREES * near and (z == 0 or z > far * (_ONE + AGREES)):
                    z = _HALF * (a + b)
            closed[i, j] = z
