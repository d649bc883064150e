"""Flat cuts through the attainable wrench set: what two components can be while the other four are fixed."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from sim.notebook.ability.case import VehicleCase

#: A cut thinner than this has no area worth drawing [N].
THIN_N = 1e-6
#: Rows of a wrench [Fx Fy Fz Mx My Mz].
FRONT, RIGHT, DOWN, ROLL, PITCH, YAW = np.eye(6)


def wrench_cut(case: VehicleCase, origin: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    r"""Corners of all (a, b) with :math:`w_0 + a\,d_1 + b\,d_2` attainable.

    Args:
        case: The vehicle.
        origin: Wrench w_0, (6,) [N, N m].
        first: Direction d_1, (6,).
        second: Direction d_2, (6,).

    Returns:
        Corners in order around the polygon, (k, 2); (0, 2) when there is none with an area.
    """
    facets = case.facets
    low, high = facets.rooms(origin, case.lower, case.upper)
    slopes = facets.normals @ np.column_stack((first, second))
    rows, room = np.vstack((slopes, -slopes)), np.concatenate((high, -low))
    sloped = np.linalg.norm(rows, axis=1) > THIN_N
    if (room[~sloped] < -THIN_N).any():
        return np.empty((0, 2))
    rows, room = rows[sloped], room[sloped]
    centre = _centre(rows, room)
    if centre is None:
        return np.empty((0, 2))
    try:
        corners = HalfspaceIntersection(np.column_stack((rows, -room)), centre).intersections
        return corners[ConvexHull(corners).vertices]
    except QhullError:
        return np.empty((0, 2))


def _centre(rows: np.ndarray, room: np.ndarray) -> np.ndarray | None:
    """Centre of the largest disc inside, or None if there is hardly one."""
    size = np.linalg.norm(rows, axis=1)
    found = linprog(
        [0.0, 0.0, -1.0], A_ub=np.column_stack((rows, size)), b_ub=room, bounds=[(None, None)] * 3, method="highs"
    )
    return found.x[:2] if found.status == 0 and found.x[2] > THIN_N else None


def level_cut(case: VehicleCase) -> np.ndarray:
    """Horizontal forces (front, right) [N] in level flight at full lift without moment, (k, 2)."""
    return wrench_cut(case, -case.weight_n * DOWN, FRONT, RIGHT)


def side_cut(case: VehicleCase) -> np.ndarray:
    """Forces (front, up) [N] without lateral force and moment, (k, 2)."""
    return wrench_cut(case, np.zeros(6), FRONT, -DOWN)


def yaw_cut(case: VehicleCase) -> np.ndarray:
    """Force to the front [N] against yaw moment [N m] in level flight at full lift, (k, 2)."""
    return wrench_cut(case, -case.weight_n * DOWN, FRONT, YAW)
