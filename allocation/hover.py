"""Hover: horizontal forces that are possible at zero tilt and zero moment, and the least tilt of any hover."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence

import numpy as np

from allocation.wrench_facets import ON_PLANE, RELATIVE_ZERO, Limit, WrenchFacets, crossings

#: Corners nearer than this are one [N]: rounding of the intersection of two lines.
_SAME_CORNER_N = 1e-7
#: Tilts and directions of the tilt are tried in these steps [deg].
TILT_STEP_DEG, AZIMUTH_STEP_DEG = 0.5, 3.0
#: Largest tilt that is tried [deg]: beyond it a vehicle counts as flipped.
LARGEST_TILT_DEG = 60.0
_YAW = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


def hover_wrench(weight: float) -> np.ndarray:
    """Wrench of the rotors that carries a weight [N] in level flight, (6,)."""
    return np.array([0.0, 0.0, -weight, 0.0, 0.0, 0.0])


def worst_level_reach(facets: WrenchFacets, weight: float, lower: Limit, upper: Limit) -> tuple[float, float]:
    """Smallest level reach over all horizontal directions [N], and its azimuth from front to right [rad].

    The worst direction is the normal of the nearest edge of the `level_polygon`. Arguments as of it.

    Returns:
        Reach and azimuth; (-inf, NaN) when level hover itself is out of reach.
    """
    if not facets.contains(hover_wrench(weight), lower, upper):
        return -math.inf, math.nan
    rows, rooms = _half_planes(facets, weight, lower, upper)
    distances = rooms / np.linalg.norm(rows, axis=1)
    front, right = rows[np.argmin(distances)]
    return float(distances.min()), math.atan2(right, front)


def level_polygon(facets: WrenchFacets, weight: float, lower: Limit, upper: Limit) -> np.ndarray:
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


def _half_planes(facets: WrenchFacets, weight: float, lower: Limit, upper: Limit) -> tuple[np.ndarray, np.ndarray]:
    """Rows a and bounds b of a^T (front, right) <= b that bound the level forces, (2k, 2) and (2k,)."""
    low, high = facets.rooms(hover_wrench(weight), lower, upper)
    rows = facets.normals[:, :2]
    sloped = np.abs(rows).max(axis=1) > RELATIVE_ZERO
    return np.vstack((rows[sloped], -rows[sloped])), np.concatenate((high[sloped], -low[sloped]))


def least_hover_tilt(
    facets: WrenchFacets,
    weight: float,
    lower: Limit,
    upper: Limit,
    *,
    centre: Sequence[float] = (0.0, 0.0, 0.0),
    hold_yaw: bool = False,
) -> float:
    """Least tilt at which the rotors can carry the weight, without any roll and pitch moment about its centre.

    Args:
        facets: Facets of the wrench set.
        weight: Weight to carry [N].
        lower: Smallest thrusts, (n,) or one number [N]; equal to ``upper`` for a rotor that is lost or stuck.
        upper: Largest thrusts, (n,) or one number [N].
        centre: Centre of mass in B [m], (3,).
        hold_yaw: Whether the yaw moment must be zero too; otherwise the vehicle may turn.

    Returns:
        The tilt to `TILT_STEP_DEG` [deg]; inf when there is no hover up to `LARGEST_TILT_DEG`.
    """
    forces, tilts = _forces(weight)
    wrenches = np.vstack((forces, np.cross(np.asarray(centre, float), forces.T).T))
    low, high = facets.rooms(np.zeros(6), lower, upper)
    at = facets.normals @ wrenches
    enter, leave = crossings(low[:, None] - at, high[:, None] - at, (facets.normals @ _YAW)[:, None])
    least, greatest = enter.max(axis=0), leave.min(axis=0)
    possible = least <= greatest + ON_PLANE
    if hold_yaw:
        possible &= (least <= ON_PLANE) & (greatest >= -ON_PLANE)
    return float(tilts[possible].min(initial=math.inf))


@functools.lru_cache(maxsize=8)
def _forces(weight: float) -> tuple[np.ndarray, np.ndarray]:
    """Forces that carry the weight, in B, and the tilt of each: (3, k) [N], (k,) [deg]."""
    tilts, azimuths = np.meshgrid(
        np.arange(0.0, LARGEST_TILT_DEG + TILT_STEP_DEG, TILT_STEP_DEG), np.arange(0.0, 360.0, AZIMUTH_STEP_DEG)
    )
    tilt, azimuth = np.radians(tilts.ravel()), np.radians(azimuths.ravel())
    across = weight * np.sin(tilt)
    return np.stack((across * np.cos(azimuth), across * np.sin(azimuth), -weight * np.cos(tilt))), tilts.ravel()
