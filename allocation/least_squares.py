"""Rotor thrusts within their limits that come nearest to a desired wrench."""

from __future__ import annotations

import numpy as np

#: Row weights of [Fx Fy Fz Mx My Mz]. Moments are divided by a lever near 0.2 m to compare with forces. Roll and pitch
#: come first (a vehicle that tips is lost), then yaw, then height; the lateral forces yield first.
DEFAULT_ROW_WEIGHTS = (1.0, 1.0, 4.0, 30.0, 30.0, 8.0)


def allocate_least_squares(
    wrench: np.ndarray,
    effectiveness: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    row_weights: np.ndarray | tuple[float, ...] = DEFAULT_ROW_WEIGHTS,
) -> np.ndarray:
    r"""Box-constrained weighted least squares, :math:`\min_u \|W (B u - w)\|` with lower <= u <= upper.

    Args:
        wrench: Desired body wrench w, (6,) [N, N m].
        effectiveness: Matrix B of `control_effectiveness`, (6, n).
        lower: Smallest thrusts, (n,) [N].
        upper: Largest thrusts, (n,) [N], above lower.
        row_weights: Diagonal of W, (6,): cost of one newton or newton metre of error.

    Returns:
        Thrusts, (n,) [N].

    Raises:
        ValueError: When a lower limit is not below its upper limit.
    """
    from scipy.optimize import lsq_linear  # slow to import, and most users of this package allocate otherwise

    weights = np.asarray(row_weights, float)
    matrix = weights[:, None] * np.asarray(effectiveness, float)
    result = lsq_linear(matrix, weights * np.asarray(wrench, float), bounds=(lower, upper), method="bvls")
    return np.clip(result.x, lower, upper)
