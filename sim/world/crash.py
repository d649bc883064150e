"""End of a flight by the truth: propeller strike, ground contact, flip, non-finite state, or a touchdown."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sim.world.clearance import PropellerClearance

#: A vehicle whose origin is lower than this has hit the ground [m]: legs and half a tilted frame.
GROUND_CLEARANCE_M = 0.15

#: Tilt at which a vehicle counts as flipped [deg].
FLIP_DEG = 60.0

#: The same as the least cosine of the tilt.
FLIP_COSINE = math.cos(math.radians(FLIP_DEG))

#: Fastest sink at ground contact that is a touchdown [m/s]: a fall from 18 mm, which legs take; PX4 lands at 0.7 m/s.
TOUCHDOWN_SINK_M_S = 0.6
#: Largest tilt of a touchdown [deg]: that of a flight without a rotor, 20 degrees, and the oscillation around it. Legs
#: half as wide as the rotor circle and as high as `GROUND_CLEARANCE_M` tip over at 58 degrees.
TOUCHDOWN_TILT_DEG = 25.0
_TOUCHDOWN_COSINE = math.cos(math.radians(TOUCHDOWN_TILT_DEG))


def has_landed(depth: float, upright: float, sink: float) -> bool:
    """Whether a vehicle touches the ground slowly and level: a landing, not a crash.

    Args:
        depth: Of the body origin below the ground, < 0 above it [m].
        upright: Cosine of its tilt.
        sink: Its velocity downwards [m/s].
    """
    return depth > -GROUND_CLEARANCE_M and upright >= _TOUCHDOWN_COSINE and sink <= TOUCHDOWN_SINK_M_S


def crash_reason(
    position: Sequence[float],
    rotation: Sequence[Sequence[float]],
    depth: float,
    upright: float,
    clearance: PropellerClearance,
) -> str | None:
    """Why a vehicle at this pose has crashed, or None.

    Args:
        position: Body origin, world [m], (3,).
        rotation: Rows of the rotation B to I, (3, 3).
        depth: Of the body origin below the ground, < 0 above it [m].
        upright: Cosine of its tilt.
        clearance: Its propeller discs before board and wall.
    """
    if not math.isfinite(sum(position) + sum(map(sum, rotation))):
        return "non-finite state"
    if upright < FLIP_COSINE:
        return f"flip: tilted by more than {FLIP_DEG:g} deg"
    if depth > -GROUND_CLEARANCE_M:
        return "hit the ground"
    return "propeller strike" if clearance.strikes(position, rotation) else None
