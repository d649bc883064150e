"""Reach in level flight: the horizontal forces that are possible at zero tilt and zero moment."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import linprog

from allocation.wrench_set import WrenchSet

#: Corners nearer than this are one [N]; the linear programs work to about 1e-9.
_TOLERANCE_N = 1e-7


def level_reach(wrenches: WrenchSet, weight: float, direction: np.ndarray) -> float:
    """Largest force along a horizontal body direction in level flight, without moment, at full lift [N].

    Args:
        wrenches: The rotors' wrench set.
        weight: Weight to carry [N].
        direction: Horizontal direction (front, right), (2,); its length does not matter. The vehicle pushes a wall
            ahead with the reach along (1, 0).

    Returns:
        The force; -inf when level hover itself is out of reach.
    """
    front, right = np.asarray(direction, float) / np.linalg.norm(direction)
    hover = np.array([0.0, 0.0, -weight, 0.0, 0.0, 0.0])
    return wrenches.reach(hover, np.array([front, right, 0.0, 0.0, 0.0, 0.0])).distance


def worst_level_reach(wrenches: WrenchSet, weight: float) -> tuple[float, float]:
    """Smallest level reach over all horizontal directions [N], and its azimuth from front to right [rad].

    The worst direction is the normal of the nearest edge of the `level_polygon`.
    """
    hover = np.array([0.0, 0.0, -weight, 0.0, 0.0, 0.0])
    if not wrenches.contains(hover):
        return -math.inf, math.nan
    corners = level_polygon(wrenches, weight)
    best = (math.inf, math.nan)
    for first, second in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge = second - first
        length = float(np.linalg.norm(edge))
        if length > _TOLERANCE_N:
            normal = np.array([edge[1], -edge[0]]) / length
            distance = float(normal @ first)
            if distance < best[0]:
                best = (distance, math.atan2(normal[1], normal[0]))
    return best


def _support(wrenches: WrenchSet, weight: float, direction: np.ndarray) -> np.ndarray:
    """Corner of the level, moment-free force polygon that lies farthest along a direction, (front, right) [N]."""
    matrix = wrenches.matrix
    result = linprog(
        -(direction @ matrix[:2]),
        A_eq=matrix[2:],
        b_eq=np.array([-weight, 0.0, 0.0, 0.0]),
        bounds=[*zip(wrenches.lower, wrenches.upper, strict=True)],
        method="highs",
    )
    return matrix[:2] @ result.x


def level_polygon(wrenches: WrenchSet, weight: float) -> np.ndarray:
    """Corners of all horizontal forces that rotors can make while they carry the weight without any moment.

    The cut of a convex set is a convex polygon. Supporting lines find its corners: the normal of the line between
    two known corners leads to a new one between them, until the line is an edge.

    Args:
        wrenches: The rotors' wrench set; must contain level hover.
        weight: Weight to carry [N].

    Returns:
        Corners (front, right) [N], (k, 2), in the order of growing azimuth from front to right.
    """

    def between(first: np.ndarray, second: np.ndarray) -> list[np.ndarray]:
        edge = second - first
        if float(edge @ edge) < _TOLERANCE_N**2:
            return []
        normal = np.array([edge[1], -edge[0]]) / np.linalg.norm(edge)
        corner = _support(wrenches, weight, normal)
        if normal @ (corner - first) < _TOLERANCE_N:
            return []
        return [*between(first, corner), corner, *between(corner, second)]

    azimuth = np.radians([0.0, 120.0, 240.0])
    seeds = [_support(wrenches, weight, np.array([math.cos(a), math.sin(a)])) for a in azimuth]
    corners: list[np.ndarray] = []
    for first, second in zip(seeds, seeds[1:] + seeds[:1], strict=True):
        corners += [first, *between(first, second)]
    return np.array(corners)
