"""What ends a flight: a propeller at the wall, the ground, a flip, or numbers that are none."""

from __future__ import annotations

import math

import numpy as np

from sim.clearance import PropellerClearance

#: A vehicle whose origin is lower than this has hit the ground [m]: legs and half a tilted frame.
GROUND_CLEARANCE_M = 0.15

#: Tilt at which a vehicle counts as flipped [deg].
FLIP_DEG = 60.0

_FLIP_COSINE = math.cos(math.radians(FLIP_DEG))


def crash_reason(position: np.ndarray, rotation: np.ndarray, clearance: PropellerClearance) -> str | None:
    """Why a vehicle at this pose has crashed, or None.

    Args:
        position: Body origin, world NED [m], (3,).
        rotation: Rotation B to I, (3, 3).
        clearance: Its propeller discs before board and wall.
    """
    if not math.isfinite(float(position.sum() + rotation.sum())):
        return "non-finite state"
    if rotation[2, 2] < _FLIP_COSINE:
        return f"flip: tilted by more than {FLIP_DEG:g} deg"
    if position[2] > -GROUND_CLEARANCE_M:
        return "hit the ground"
    if clearance.foremost(position, rotation) > 0.0 and clearance.distance(position, rotation) <= 0.0:
        return "propeller strike"
    return None
