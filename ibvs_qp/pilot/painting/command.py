"""Input and output of a strategy at one tick, and the controller's reference that follows from the output."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ibvs_qp.estimation.tracked_line import TrackedLine
from ibvs_qp.measurement import HORIZONTAL, LineReference, Reference

#: No tilt, no travel; one array for all commands.
ZERO = np.zeros(2)
ZERO.flags.writeable = False


@dataclass(slots=True)
class PainterInput:
    """Estimates at one tick.

    Attributes:
        time_s: Time since the first tick [s].
        lines: Tracked lines by track.
        odometer: Position of the tip along the wall (right, down) [m], (2,).
        velocity: Velocity of the tip along the wall (right, down) [m/s], (2,).
        distance: Tip to wall [m].
        wall_known: Whether a plane was measured.
        in_contact: Whether the brush touches the wall.
        time_since_touch: Time since the touch [s].
        push: Measured push [N].
        push_reference: Push that the controller commands after ramp and reach check [N].
        tared: Whether the wrench is tared.
    """

    time_s: float
    lines: Mapping[int, TrackedLine]
    odometer: Sequence[float]
    velocity: Sequence[float]
    distance: float
    wall_known: bool
    in_contact: bool
    time_since_touch: float
    push: float
    push_reference: float
    tared: bool


@dataclass(slots=True)
class PaintingCommand:
    """Targets of one tick.

    Attributes:
        contact: Press the wall (True) or keep the stand-off.
        standoff: Tip to wall while not in contact [m].
        velocity: Velocity along the wall (right, down) [m/s], (2,).
        guides: Lines to follow, each with its target offset [m]; where one leads, the velocity is its feed-forward.
        push: Push [N].
        tilt: Roll and pitch [rad], (2,).
        trim: Roll and pitch of a vehicle with a limited rotor, otherwise controlled as level [rad], (2,).
        travel: Velocity along the wall that is planned at this push (right, down) [m/s], (2,).
    """

    contact: bool
    standoff: float = 0.0
    velocity: np.ndarray = field(default_factory=lambda: ZERO)
    guides: list[tuple[TrackedLine, float]] = field(default_factory=list)
    push: float = 0.0
    tilt: np.ndarray = field(default_factory=lambda: ZERO)
    travel: np.ndarray = field(default_factory=lambda: ZERO)
    trim: np.ndarray = field(default_factory=lambda: ZERO)


@dataclass(frozen=True, slots=True)
class ExpectedEdge:
    """A painted edge that should come into view.

    Attributes:
        role: "horizontal" or "vertical".
        offset: Signed distance from the tip's wall point along the normal that points down or right [m].
        side: Side of the bare surface along that normal, +1 or -1.
        ahead: Where it is in view beside the brush: +1 to the right or downwards, -1 to the left or upwards.
    """

    role: str
    offset: float
    side: int
    ahead: int


def image_reference(target: PaintingCommand, depth: float, tip_below: float, tip_right: float) -> Reference:
    r"""Reference of a command; an offset l on the wall from the optical axis becomes :math:`\rho = l / d`.

    Args:
        target: The command.
        depth: Camera to wall along the optical axis [m].
        tip_below: Tip below the optical axis [m].
        tip_right: Tip to the right of it [m].
    """
    lines = []
    for line, offset in target.guides:
        tip, theta = (tip_below, 0.5 * math.pi) if line.role == HORIZONTAL else (tip_right, 0.0)
        lines.append(LineReference(rho=(offset + tip) / depth, theta=theta, role=line.role))
    return Reference(
        push_force=target.push,
        standoff=target.standoff,
        lines=tuple(lines),
        velocity=target.velocity,
        contact=target.contact,
        tilt=target.tilt,
        travel=target.travel,
        trim=target.trim,
    )
