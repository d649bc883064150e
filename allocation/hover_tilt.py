"""Hover at a tilt: whether rotors within their limits can carry a weight without roll and pitch moments at all."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from allocation.wrench_facets import ON_PLANE, WrenchFacets, crossings

#: Tilts and directions of the tilt are tried in these steps [deg].
TILT_STEP_DEG, AZIMUTH_STEP_DEG = 0.5, 3.0
#: Largest tilt that is tried [deg]: beyond it a vehicle counts as flipped.
LARGEST_TILT_DEG = 60.0
_YAW = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


def least_hover_tilt(
    facets: WrenchFacets,
    weight: float,
    lower: np.ndarray | float,
    upper: np.ndarray | float,
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
