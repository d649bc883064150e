"""Reach in level flight: the horizontal forces that are possible at zero tilt and zero moment."""

from __future__ import annotations

import itertools
import math

import numpy as np

from allocation.contact_reach import hover_wrench
from allocation.wrench_facets import RELATIVE_ZERO, WrenchFacets

#: Corners nearer than this are one [N]: rounding of the intersection of two lines.
_SAME_CORNER_N = 1e-7


def worst_level_reach(
    facets: WrenchFacets, weight: float, lower: np.ndarray | float, upper: np.ndarray | float
) -> tuple[float, float]:
    """Smallest level reach over all horizontal directions [N], and its azimuth from front to right [rad].

    The worst direction is the normal of the nearest edge of the `level_polygon`.

    Args:
        facets: Facets of the wrench set.
        weight: Weight to carry [N].
        lower: Smallest thrusts, (n,) or one number [N].
        upper: Largest thrusts, (n,) or one number [N].

    Returns:
        Reach and azimuth; (-inf, NaN) when level hover itself is out of reach.
    """
    if not facets.contains(hover_wrench(weight), lower, upper):
        return -math.inf, math.nan
    rows, rooms = _half_planes(facets, weight, lower, upper)
    distances = rooms / np.linalg.norm(rows, axis=1)
    front, right = rows[np.argmin(distances)]
    return float(distances.min()), math.atan2(right, front)


def level_polygon(
    facets: WrenchFacets, weight: float, lower: np.ndarray | float, upper: np.ndarray | float
) -> np.ndarray:
    """Corners of all horizontal forces that rotors can make while they carry the weight without any moment.

    Args:
        facets: Facets of the wrench set, which must contain level hover.
        weight: Weight to carry [N].
        lower: Smallest thrusts, (n,) or one number [N].
        upper: Largest thrusts, (n,) or one number [N].

    Returns:
        Corners (front, right) [N], (k, 2), in the order of growing azimuth from front to right.
    """
    rows, rooms = _half_planes(facets, weight, lower, upper)
    corners: list[np.ndarray] = []
    for pair in itertools.combinations(range(len(rows)), 2):
        lines = rows[list(pair)]
        if abs(np.linalg.det(lines)) < RELATIVE_ZERO * np.prod(np.linalg.norm(lines, axis=1)):
            continue
        corner = np.linalg.solve(lines, rooms[list(pair)])
        inside = (rows @ corner <= rooms + _SAME_CORNER_N).all()
        if inside and not any(np.abs(corner - other).max() < _SAME_CORNER_N for other in corners):
            corners.append(corner)
    polygon = np.array(corners)
    around = polygon - polygon.mean(axis=0)
    return polygon[np.argsort(np.arctan2(around[:, 1], around[:, 0]))]


def _half_planes(
    facets: WrenchFacets, weight: float, lower: np.ndarray | float, upper: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Rows a and bounds b of a^T (front, right) <= b that bound the level forces, (2k, 2) and (2k,)."""
    low, high = facets.rooms(hover_wrench(weight), lower, upper)
    rows = facets.normals[:, :2]
    sloped = np.abs(rows).max(axis=1) > RELATIVE_ZERO
    return np.vstack((rows[sloped], -rows[sloped])), np.concatenate((high[sloped], -low[sloped]))
