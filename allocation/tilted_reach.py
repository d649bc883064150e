"""Greatest push with a deliberate tilt, by linear programs over push, roll and pitch."""

from __future__ import annotations

import math

import numpy as np

from allocation.contact_reach import hover_wrench, push_direction, ray_reach
from allocation.wrench_facets import WrenchFacets

#: Directions of travel that are tried, and steps of the linearisation [-]: the third changes less than 0.01 N.
TRAVELS, STEPS = 48, 3


def tilted_push_reach(
    facets: WrenchFacets,
    weight: float,
    tip: np.ndarray,
    lower: np.ndarray | float,
    upper: np.ndarray | float,
    *,
    tilt: float,
    friction: float = 0.0,
    travel: np.ndarray | None = None,
) -> tuple[float, np.ndarray]:
    r"""Greatest push against a wall straight ahead while roll and pitch may deviate from level.

    In level axes the rotors make the force :math:`F = f d - m g e_z` and the moment :math:`f p \times d`; in a body
    tilted by :math:`\theta` they change by :math:`F \times \theta` and :math:`f p \times (d \times \theta)`. A linear
    program finds f and :math:`\theta` with the f of the last step in these products. The push returned is exact at the
    angles returned.

    Args:
        facets: Facets of the wrench set.
        weight: Weight to carry m g [N].
        tip: Contact point in B [m], (3,).
        lower: Smallest thrusts [N], (n,) or one number.
        upper: Largest thrusts [N], (n,) or one number.
        tilt: Largest roll and pitch [rad].
        friction: Coulomb coefficient [-].
        travel: Direction in which the tip slides, in level axes, (3,); None when it stands still.

    Returns:
        Push [N], NaN when none is possible; and the roll and pitch that it takes [rad], (2,).
    """
    from scipy.optimize import linprog  # a second of import that flights do not need

    tip, level = np.asarray(tip, float), hover_wrench(weight)
    low, high = facets.rooms(level, lower, upper)
    direction, angles = push_direction(tip, friction, travel), np.zeros(2)
    push = ray_reach(facets, level, direction, lower, upper).push
    for _ in range(STEPS):
        force = (0.0 if math.isnan(push) else push) * direction[:3]
        turned = [np.cross(force + level[:3], axis) for axis in np.eye(3)[:2]]
        moments = [np.cross(tip, np.cross(force, axis)) for axis in np.eye(3)[:2]]
        columns = facets.normals @ np.vstack((np.transpose(turned), np.transpose(moments)))
        rows = np.column_stack((facets.normals @ direction, columns))
        found = linprog(
            (-1.0, 0.0, 0.0),
            A_ub=np.vstack((rows, -rows)),
            b_ub=np.concatenate((high, -low)),
            bounds=[(0.0, None), (-tilt, tilt), (-tilt, tilt)],
        )
        if found.status != 0:
            return math.nan, np.full(2, math.nan)
        angles = found.x[1:]
        push = _at(facets, weight, tip, direction[:3], angles, lower, upper)
    return push, angles


def _at(
    facets: WrenchFacets,
    weight: float,
    tip: np.ndarray,
    direction: np.ndarray,
    angles: np.ndarray,
    lower: np.ndarray | float,
    upper: np.ndarray | float,
) -> float:
    """Greatest push at a roll and a pitch [N]; ``direction`` is the force per newton of push in level axes."""
    (cr, cp), (sr, sp) = np.cos(angles), np.sin(angles)
    body = np.array([[cp, 0.0, -sp], [sr * sp, cr, sr * cp], [cr * sp, -sr, cr * cp]])  # level axes to B
    force = body @ direction
    carried = np.concatenate((body @ hover_wrench(weight)[:3], np.zeros(3)))
    return ray_reach(facets, carried, np.concatenate((force, np.cross(tip, force))), lower, upper).push


def worst_tilted_push_reach(
    facets: WrenchFacets,
    weight: float,
    tip: np.ndarray,
    lower: np.ndarray | float,
    upper: np.ndarray | float,
    *,
    tilt: float,
    friction: float,
) -> float:
    """Greatest push that is possible in each of `TRAVELS` directions along the wall [N], NaN when none is.

    Args: as `tilted_push_reach`.
    """
    angles = 2.0 * math.pi * np.arange(TRAVELS) / TRAVELS
    travels = np.column_stack((np.zeros(TRAVELS), np.cos(angles), np.sin(angles)))
    limits = facets, weight, tip, lower, upper
    pushes = [tilted_push_reach(*limits, tilt=tilt, friction=friction, travel=travel)[0] for travel in travels]
    return float(np.min(pushes))  # NaN if one is
