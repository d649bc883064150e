r"""Attainable wrench set: what the rotors can do at the same time within their thrust limits.

The set :math:`\{B u : l \le u \le h\}` is a convex polytope, so how far it reaches from a wrench inside along a
direction is a linear program in the thrusts and the reach.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from allocation.effectiveness import control_effectiveness
from allocation.geometry import RotorGeometry

#: Entries of a wrench count as met within this [N, N m]; the linear programs work to about 1e-9.
_TOLERANCE = 1e-7


@dataclass(frozen=True, kw_only=True)
class Reach:
    """How far one can go from a wrench along a direction.

    Attributes:
        distance: Largest t with ``wrench + t direction`` attainable; negative when only a retreat along the
            direction is, -inf when the whole line is out of reach.
        thrusts: Thrusts there [N], (n,); NaN when out of reach.
    """

    distance: float
    thrusts: np.ndarray


class WrenchSet:
    """Wrenches that rotors attain within their thrust limits.

    Args:
        rotors: The rotors, or their matrix B of `control_effectiveness`, (6, n).
        lower: Smallest thrusts [N], (n,) or one number.
        upper: Largest thrusts [N], (n,) or one number.
    """

    def __init__(
        self, rotors: RotorGeometry | np.ndarray, lower: np.ndarray | float, upper: np.ndarray | float
    ) -> None:
        self.matrix = control_effectiveness(rotors) if isinstance(rotors, RotorGeometry) else np.asarray(rotors, float)
        count = self.matrix.shape[1]
        self.lower = np.broadcast_to(np.asarray(lower, float), (count,)).copy()
        self.upper = np.broadcast_to(np.asarray(upper, float), (count,)).copy()

    def reach(self, wrench: np.ndarray, direction: np.ndarray) -> Reach:
        r"""Largest t such that :math:`w + t\,d` is attainable: max t with B u - t d = w, l <= u <= h.

        Args:
            wrench: Starting wrench w, (6,) [N, N m].
            direction: Direction d, (6,), not zero; t counts in its length.
        """
        count = self.matrix.shape[1]
        result = linprog(
            np.concatenate((np.zeros(count), [-1.0])),
            A_eq=np.column_stack((self.matrix, -np.asarray(direction, float))),
            b_eq=np.asarray(wrench, float),
            bounds=[*zip(self.lower, self.upper, strict=True), (None, None)],
            method="highs",
        )
        if result.status != 0:
            return Reach(distance=-math.inf, thrusts=np.full(count, math.nan))
        return Reach(distance=float(result.x[-1]), thrusts=result.x[:-1])

    def margin(self, wrench: np.ndarray) -> float:
        r"""Smallest distance of any rotor to its limits at the best thrusts for a wrench [N].

        Solves max s with B u = w, l + s <= u <= h - s. Positive: attainable with room on every rotor; negative:
        every limit would have to give way by that much; -inf: no thrusts make this wrench.
        """
        count = self.matrix.shape[1]
        ones = np.ones((count, 1))
        result = linprog(
            np.concatenate((np.zeros(count), [-1.0])),
            A_ub=np.vstack((np.hstack((np.eye(count), ones)), np.hstack((-np.eye(count), ones)))),
            b_ub=np.concatenate((self.upper, -self.lower)),
            A_eq=np.column_stack((self.matrix, np.zeros(6))),
            b_eq=np.asarray(wrench, float),
            bounds=[(None, None)] * (count + 1),
            method="highs",
        )
        return float(result.x[-1]) if result.status == 0 else -math.inf

    def contains(self, wrench: np.ndarray) -> bool:
        """Whether a wrench is attainable."""
        return self.margin(wrench) >= -_TOLERANCE
