r"""Attainable wrench set by its facets: no linear program per query, and the thrust limits may change at each query.

The set :math:`\{B u : l \le u \le h\}` is a zonotope, bounded by pairs of parallel planes

.. math:: \underline s \le y^T w \le \overline s, \quad
          \overline s = \sum_i \max(y^T b_i\, l_i,\; y^T b_i\, h_i), \quad
          \underline s = \sum_i \min(y^T b_i\, l_i,\; y^T b_i\, h_i),

one pair for every normal y that is orthogonal to five independent columns of B. The normals do not depend on the
limits: the support function is linear on every cone of the arrangement of the planes :math:`y^T b_i = 0`, so the rays
of that arrangement give the facets for all limits, also for dead rotors (l = h). Six rotors have six normals, the rows
of B^-1, and the pairs of planes are the limits of the single rotors; eight rotors have at most 56 normals.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from allocation.geometry import RotorGeometry, as_matrix

#: Thrust limit of all rotors [N], (n,), or one number.
Limit = np.ndarray | float

#: Singular values and coefficients below this fraction of the largest count as zero.
RELATIVE_ZERO = 1e-9
#: A wrench beyond a plane by less than this is on it: rounding of sums of some hundred newtons [N].
ON_PLANE = 1e-9
#: Normals whose coefficients differ by less than this are the same [-]: rounding of the singular vectors.
_SAME_NORMAL = 1e-7


class WrenchFacets:
    """Facet normals of the attainable wrench set, and intervals of attainable wrenches on a line.

    Attributes:
        matrix: Control effectiveness B, (6, n).
        normals: Facet normals y, (k, 6), one of each opposite pair.
        coefficients: y^T b_i of every rotor, (k, n); the largest of each row is one, so that distances are in newtons.

    Args:
        rotors: The rotors, or their matrix B of `control_effectiveness`, (6, n).

    Raises:
        ValueError: When the rotors do not span all six wrench directions.
    """

    def __init__(self, rotors: RotorGeometry | np.ndarray) -> None:
        self.matrix = as_matrix(rotors)
        self.normals, self.coefficients = _normals(self.matrix)
        self._positive, self._negative = np.maximum(self.coefficients, 0.0), np.minimum(self.coefficients, 0.0)

    def rooms(self, wrench: np.ndarray, lower: Limit, upper: Limit) -> tuple[np.ndarray, np.ndarray]:
        """Distances of a wrench to the lower (<= 0 inside) and the upper plane (>= 0 inside) of every normal.

        Args:
            wrench: Wrench w, (6,) [N, N m].
            lower: Smallest thrusts, (n,) or one number [N].
            upper: Largest thrusts, (n,) or one number [N]; equal to lower for a dead rotor.

        Returns:
            Both distances, (k,) each [N].

        Raises:
            ValueError: When a lower limit is above its upper limit.
        """
        count = self.matrix.shape[1]
        low, high = (np.broadcast_to(np.asarray(limit, float), (count,)) for limit in (lower, upper))
        if (low > high).any():
            raise ValueError(f"lower thrust limit {low.tolist()} N above the upper one {high.tolist()} N")
        at = self.normals @ wrench
        return self._positive @ low + self._negative @ high - at, self._positive @ high + self._negative @ low - at

    def contains(self, wrench: np.ndarray, lower: Limit, upper: Limit) -> bool:
        """Whether a wrench is attainable within the limits; arguments as in `rooms`."""
        low, high = self.rooms(wrench, lower, upper)
        return bool((low <= ON_PLANE).all() and (high >= -ON_PLANE).all())

    def interval(self, wrench: np.ndarray, direction: np.ndarray, lower: Limit, upper: Limit) -> tuple[float, float]:
        r"""Least and greatest t with :math:`w + t\,d` attainable; (inf, -inf) if no t is.

        Args: as of `rooms`; direction d, (6,), of which t is a multiple.
        """
        enter, leave = crossings(*self.rooms(wrench, lower, upper), self.normals @ direction)
        least, greatest = float(enter.max()), float(leave.min())
        return (least, greatest) if greatest >= least - ON_PLANE else (math.inf, -math.inf)


def crossings(low: np.ndarray, high: np.ndarray, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values of t at which a line enters and leaves the slab between every pair of planes, low <= slope t <= high.

    Args:
        low: Distance to the lower planes, (k,).
        high: Distance to the upper planes, (k,).
        slope: Change of y^T w per unit of t, (k,).

    Returns:
        Entries and exits, (k,) each; a parallel line outside a slab enters it at inf.
    """
    along = np.abs(slope) > RELATIVE_ZERO
    safe = np.where(along, slope, 1.0)
    first, second = low / safe, high / safe
    outside = (low > ON_PLANE) | (high < -ON_PLANE)
    enter = np.where(along, np.minimum(first, second), np.where(outside, math.inf, -math.inf))
    return enter, np.where(along, np.maximum(first, second), math.inf)


def _normals(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Normals orthogonal to five independent columns, scaled to a largest coefficient of one, and all coefficients."""
    count, scale = matrix.shape[1], np.abs(matrix).max(axis=1)
    if count < 6 or not scale.all() or np.linalg.matrix_rank(matrix / scale[:, None], RELATIVE_ZERO) < 6:
        raise ValueError(f"rotors: {count} rotors that do not span all six wrench directions have no facets")
    balanced = matrix / scale[:, None]
    found: list[np.ndarray] = []
    for columns in itertools.combinations(range(count), 5):
        _, values, basis = np.linalg.svd(balanced[:, columns].T)
        if values[-1] < RELATIVE_ZERO * values[0]:
            continue
        row = basis[-1] @ balanced
        row = np.where(np.abs(row) < RELATIVE_ZERO * np.abs(row).max(), 0.0, row)
        # Opposite normals are one pair of planes: take the sign whose first coefficient is positive.
        factor = np.abs(row).max() * np.sign(row[np.flatnonzero(row)[0]])
        candidate = np.concatenate((basis[-1] / scale / factor, row / factor))
        if not any(np.allclose(candidate[6:], other[6:], rtol=0.0, atol=_SAME_NORMAL) for other in found):
            found.append(candidate)
    table = np.array(found)
    return table[:, :6].copy(), table[:, 6:].copy()
