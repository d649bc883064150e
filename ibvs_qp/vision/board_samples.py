"""The board's colour by samples of it: the median of those that are not paint."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.native import native
from ibvs_qp.vision.native_colors import board_natively

#: Samples whose median is taken; more cost time and change nothing.
_JUDGED = 500
#: Fewer samples tell nothing of the board.
_LEAST = 8
_SUM = np.ones(3, np.float32)


def board_median(
    colors: np.ndarray, component: np.ndarray, paint: np.ndarray | None, board: np.ndarray | None, gate: float
) -> np.ndarray | None:
    """Median colour of the surface's samples that show the board, float32 (3,), None of few.

    Args:
        colors: Colours of the grid's samples, uint8 (rows, columns, 3).
        component: Samples of the surface, bool (rows, columns).
        paint: Colour of the paint, which is left out, float32 (3,), or None.
        board: Colour of the board so far, float32 (3,): what is unlike it is left out; None if unknown.
        gate: Distance within which a colour matches [grey levels].
    """
    library = native()
    if library is None:
        return _median_with_numpy(colors[component].astype(np.float32), paint, board, gate)
    count, median = board_natively(library, colors, component, paint, board, gate**2, _JUDGED)
    return median if count >= _LEAST else None


def _median_with_numpy(
    samples: np.ndarray, paint: np.ndarray | None, board: np.ndarray | None, gate: float
) -> np.ndarray | None:
    """The same where there is no machine code, of samples (n, 3)."""
    if paint is not None and len(samples):
        samples = samples[squared_distances(samples, paint) > gate**2]
    if board is not None and len(samples):
        near = samples[squared_distances(samples, board) < gate**2]
        samples = near if len(near) > len(samples) // 4 else samples[:0]
    if len(samples) < _LEAST:
        return None
    ordered = np.sort(samples[:: max(1, len(samples) // _JUDGED)], axis=0)
    return ordered[len(ordered) // 2]


def squared_distances(colors: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Squared RGB distance of colours (..., 3) from one, (...)."""
    # differences of rows of three cost many times as much as the two products
    return np.square(colors) @ _SUM + (colors @ (-2.0 * reference) + float(reference @ reference))
