"""Greatest push with a deliberate tilt, by a linear program over push, roll and pitch."""

from __future__ import annotations

import math

import numpy as np

from allocation.contact_reach import hover_wrench, push_direction
from allocation.wrench_facets import WrenchFacets

#: Directions of travel that are tried [-].
TRAVELS = 24


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

    .. math:: \max f \quad\text{s.t.}\quad Y (w_0 + f d + m g\,(\vartheta, -\varphi, 0, 0, 0, 0)) \in [\underline s,
        \overline s],\; |\varphi|, |\vartheta| \le \theta_{max}

    to first order in the tilt: the weight turns in the body, the push does not.

    Args:
        facets: Facets Y of the wrench set.
        weight: Weight to carry m g [N].
        tip: Contact point in B [m], (3,).
        lower: Smallest thrusts [N], (n,) or one number.
        upper: Largest thrusts [N], (n,) or one number.
        tilt: Largest roll and pitch [rad].
        friction: Coulomb coefficient [-].
        travel: Direction in which the tip slides, in B, (3,); None when it stands still.

    Returns:
        Push [N], NaN when none is possible; and the roll and pitch that it takes [rad], (2,).
    """
    from scipy.optimize import linprog  # a second of import that flights do not need

    low, high = facets.rooms(hover_wrench(weight), lower, upper)
    direction = push_direction(tip, friction, travel)
    rows = np.column_stack((facets.normals @ direction, -weight * facets.normals[:, 1], weight * facets.normals[:, 0]))
    found = linprog(
        (-1.0, 0.0, 0.0),
        A_ub=np.vstack((rows, -rows)),
        b_ub=np.concatenate((high, -low)),
        bounds=[(0.0, None), (-tilt, tilt), (-tilt, tilt)],
    )
    return (float(found.x[0]), found.x[1:]) if found.status == 0 else (math.nan, np.full(2, math.nan))


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
