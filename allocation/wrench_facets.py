r"""Attainable wrench set by its facets: no linear program per question, and limits may change at every one.

The set :math:`\{B u : l \le u \le h\}` is a zonotope, cut out by pairs of parallel planes

.. math:: \underline s \le y^T w \le \overline s, \quad
          \overline s = \sum_i \max(y^T b_i\, l_i,\; y^T b_i\, h_i), \quad
          \underline s = \sum_i \min(y^T b_i\, l_i,\; y^T b_i\, h_i),

one pair for every normal y that is orthogonal to five independent columns of B. The normals do not depend on the
limits: the support function is linear on every cone of the arrangement of the planes :math:`y^T b_i = 0`, so the rays
of that arrangement decide for all limits, also for rotors that are dead (l = h). With six rotors there are six normals,
the rows of B^-1, and the pairs of planes are the limits of the single rotors; with eight rotors there are at most 56.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from allocation.effectiveness import control_effectiveness
from allocation.geometry import RotorGeometry

#: Singular values and shares below this part of the largest count as zero.
RELATIVE_ZERO = 1e-9
#: A wrench beyond a plane by less than this is on it: rounding of sums of some hundred newtons [N].
ON_PLANE = 1e-9


class WrenchFacets:
    """Facet normals of the wrench set of some rotors, and intervals of wrenches on a line through it.

    Attributes:
        normals: Facet normals y, (k, 6), one of each opposite pair.
        shares: y^T b_i of every rotor, (k, n); the largest of each row is one, so that planes count in newtons.

    Args:
        rotors: The rotors, or their matrix B of `control_effectiveness`, (6, n).

    Raises:
        ValueError: When the rotors do not span all six wrench directions.
    """

    def __init__(self, rotors: RotorGeometry | np.ndarray) -> None:
        matrix = control_effectiveness(rotors) if isinstance(rotors, RotorGeometry) else np.asarray(rotors, float)
        self.matrix = matrix
        self.normals, self.shares = _normals(matrix)
        self._positive, self._negative = np.maximum(self.shares, 0.0), np.minimum(self.shares, 0.0)

    def planes(self, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest y^T w of every normal within the limits [N], (k,) each."""
        return self._positive @ lower + self._negative @ upper, self._positive @ upper + self._negative @ lower

    def interval(
        self, wrench: np.ndarray, direction: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> tuple[float, float]:
        r"""Least and greatest t with :math:`w + t\,d` attainable.

        Args:
            wrench: Starting wrench w, (6,) [N, N m].
            direction: Direction d, (6,); t counts in its length.
            lower: Smallest thrusts, (n,) [N].
            upper: Largest thrusts, (n,) [N], not below lower.

        Returns:
            (least, greatest), -inf or inf never occur; (inf, -inf) when no t is attainable.
        """
        return cut(*self.rooms(wrench, lower, upper), self.normals @ direction)

    def rooms(self, wrench: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distances of a wrench to the lower (<= 0 inside) and the upper plane (>= 0 inside) of every normal [N]."""
        low, high = self.planes(lower, upper)
        at = self.normals @ wrench
        return low - at, high - at

    def binding(self, plane: int, side: int) -> tuple[tuple[int, str], ...]:
        """Rotors, by index, that sit at a limit on a plane, and at which: side +1 for its upper one, -1 its lower."""
        shares = side * self.shares[plane]
        return tuple((int(i), "upper" if shares[i] > 0.0 else "lower") for i in np.flatnonzero(shares))


def cut(low: np.ndarray, high: np.ndarray, slope: np.ndarray) -> tuple[float, float]:
    """Interval of t with low <= slope t <= high in every row; (inf, -inf) when it is empty.

    Args:
        low: Room to the lower planes, (k,).
        high: Room to the upper planes, (k,).
        slope: Change of y^T w per unit of t, (k,).
    """
    ends = cut_ends(low, high, slope)
    if ends is None:
        return math.inf, -math.inf
    least, greatest = float(ends[0].max()), float(ends[1].min())
    return (least, greatest) if greatest >= least - ON_PLANE else (math.inf, -math.inf)


def cut_ends(low: np.ndarray, high: np.ndarray, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Where t enters and leaves between every pair of planes; None when a pair parallel to the line shuts it out."""
    along = np.abs(slope) > RELATIVE_ZERO
    if (~along & ((low > ON_PLANE) | (high < -ON_PLANE))).any():
        return None
    safe = np.where(along, slope, 1.0)
    first, second = low / safe, high / safe
    enter = np.where(along, np.minimum(first, second), -math.inf)
    return enter, np.where(along, np.maximum(first, second), math.inf)


def _normals(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Normals orthogonal to five independent columns, each scaled to a largest share of one, and all shares."""
    scale = np.abs(matrix).max(axis=1)
    if matrix.shape[1] < 6 or not scale.all() or np.linalg.matrix_rank(matrix / scale[:, None], RELATIVE_ZERO) < 6:
        raise ValueError(f"rotors: {matrix.shape[1]} rotors that do not span all six wrench directions have no facets")
    balanced = matrix / scale[:, None]
    found: list[np.ndarray] = []
    for columns in itertools.combinations(range(matrix.shape[1]), 5):
        _, values, basis = np.linalg.svd(balanced[:, columns].T)
        if values[-1] < RELATIVE_ZERO * values[0]:
            continue
        shares = basis[-1] @ balanced
        shares = np.where(np.abs(shares) < RELATIVE_ZERO * np.abs(shares).max(), 0.0, shares)
        largest = int(np.abs(shares).argmax())
        # Opposite normals are one pair of planes: take the sign whose first share is positive.
        factor = np.abs(shares[largest]) * np.sign(shares[np.flatnonzero(shares)[0]])
        candidate = np.concatenate((basis[-1] / scale / factor, shares / factor))
        if not any(np.allclose(candidate[6:], other[6:], rtol=0.0, atol=1e-7) for other in found):
            found.append(candidate)
    table = np.array(found)
    return table[:, :6].copy(), table[:, 6:].copy()
