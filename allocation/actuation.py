"""Capabilities of the rotors of a vehicle: actuated directions, hover, reach in level flight, and loss of a rotor."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from allocation.allocators import allocate_least_squares
from allocation.geometry import RotorGeometry, control_effectiveness
from allocation.hover import hover_wrench, least_hover_tilt, worst_level_reach
from allocation.reach import PushReach, push_reach, worst_push_reach
from allocation.wrench_facets import WrenchFacets

#: A singular value below this fraction of the largest counts as zero [-]: such a wrench needs 1,000 times the thrust.
LEAST_SINGULAR = 1e-3
#: Least mean lever that moments are divided by [m].
LEAST_LEVER = 1e-3
#: Friction of a painted board, for the sliding reach [-].
SLIDING_FRICTION = 0.3
#: Error of force [N] and moment [N m] with which a hover counts as level.
LEVEL_ERROR = 0.05
#: Components of a wrench.
DIRECTIONS = ("force front", "force right", "force down", "moment roll", "moment pitch", "moment yaw")


@dataclass(frozen=True, kw_only=True)
class Actuation:
    """Capabilities of rotors within their thrust limits.

    Attributes:
        effectiveness: B, (6, n).
        singular_values: Of B with its moments divided by the mean lever, in descending order, (6,) or fewer.
        missing: Wrench directions that the rotors cannot give, in words; empty for a fully-actuated vehicle.
        hover: Thrusts nearest to a level hover [N], (n,).
        hovers: Whether they carry the vehicle level, within the limits.
        level_reach: Smallest horizontal force over all directions in level flight [N]; -inf without a level hover.
        level_reach_azimuth: Its direction from front to right [rad].
        push: Greatest push at the tip, standing still; None for a vehicle that is not fully actuated.
        sliding_push: The same while sliding in the worst direction with a friction of `SLIDING_FRICTION`.
        tilt_without: Least tilt of a hover after the loss of each rotor [deg], (n,); inf for none.
    """

    effectiveness: np.ndarray
    singular_values: np.ndarray
    missing: tuple[str, ...]
    hover: np.ndarray
    hovers: bool
    level_reach: float
    level_reach_azimuth: float
    push: PushReach | None
    sliding_push: PushReach | None
    tilt_without: np.ndarray

    @property
    def condition(self) -> float:
        """Largest over smallest of six singular values [-]; inf for a vehicle that is not fully actuated."""
        return math.inf if self.missing else float(self.singular_values[0] / self.singular_values[5])


def actuation(
    geometry: RotorGeometry, weight: float, tip: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> Actuation:
    """Analyse rotors within their thrust limits.

    Args:
        geometry: The rotors.
        weight: Weight to carry [N].
        tip: Contact point in B [m], (3,).
        lower: Smallest thrusts [N], (n,).
        upper: Largest thrusts [N], (n,).
    """
    matrix, count = control_effectiveness(geometry), geometry.count
    lever = max(float(np.linalg.norm(geometry.positions, axis=1).mean()), LEAST_LEVER)
    scale = np.repeat((1.0, 1.0 / lever), 3)
    left, values, _ = np.linalg.svd(scale[:, None] * matrix)
    rank = int(np.count_nonzero(values > LEAST_SINGULAR * values[0]))
    hover = allocate_least_squares(hover_wrench(weight), matrix, lower, upper)
    error = float(np.abs(matrix @ hover - hover_wrench(weight)).max())
    found: tuple[float, float] = (-math.inf, math.nan)
    push = sliding = None
    tilts = np.full(count, math.inf)
    if rank == 6:
        facets = WrenchFacets(matrix)
        found = worst_level_reach(facets, weight, lower, upper)
        push = push_reach(facets, weight, tip, lower, upper)
        sliding = worst_push_reach(facets, weight, tip, lower, upper, friction=SLIDING_FRICTION)
        for rotor in range(count):
            low, high = lower.copy(), upper.copy()
            low[rotor] = high[rotor] = 0.0
            tilts[rotor] = least_hover_tilt(facets, weight, low, high)
    return Actuation(
        effectiveness=matrix,
        singular_values=values,
        missing=_missing(left[:, rank:]),
        hover=hover,
        hovers=error <= LEVEL_ERROR,
        level_reach=found[0],
        level_reach_azimuth=found[1],
        push=push,
        sliding_push=sliding,
        tilt_without=tilts,
    )


def _missing(null_space: np.ndarray) -> tuple[str, ...]:
    """Directions of the null space of B', (6, k): components that are missing alone, then combinations."""
    alone = np.linalg.norm(null_space, axis=1) > 1.0 - LEAST_SINGULAR
    combined = null_space * ~alone[:, None]
    left, values, _ = np.linalg.svd(combined, full_matrices=False)
    names = [name for name, missing in zip(DIRECTIONS, alone, strict=True) if missing]
    return (*names, *(_in_words(column) for column, value in zip(left.T, values, strict=True) if value > 0.5))


def _in_words(direction: np.ndarray) -> str:
    """Components of a wrench direction, the largest first; those below a tenth of it are left out."""
    order = sorted(range(6), key=lambda index: -abs(direction[index]))
    largest = direction[order[0]]
    others = [(DIRECTIONS[index], direction[index] / largest) for index in order[1:]]
    return " ".join((DIRECTIONS[order[0]], *(f"{part:+.1f} {name}" for name, part in others if abs(part) > 0.1)))
