"""From a painting command in metres on the wall to the controller's reference in the image."""

from __future__ import annotations

import math

from ibvs_qp.measurement import HORIZONTAL, LineReference, Reference
from ibvs_qp.painting.command import PaintingCommand


def image_reference(target: PaintingCommand, depth: float, tip_below: float, tip_right: float = 0.0) -> Reference:
    r"""Reference of a command; an offset l on the wall from the optical axis becomes :math:`\rho = l / d`.

    Args:
        target: The command.
        depth: Camera to wall along the optical axis [m].
        tip_below: Tip below the optical axis [m].
        tip_right: Tip to the right of it [m].
    """
    references = []
    for line, offset in target.guides:
        if line.role == HORIZONTAL:
            rho, theta = (offset + tip_below) / depth, 0.5 * math.pi
        else:
            rho, theta = (offset + tip_right) / depth, 0.0
        references.append(LineReference(rho=rho, theta=theta, role=line.role))
    return Reference(
        push_force=target.push,
        standoff=target.standoff,
        lines=tuple(references),
        velocity=target.velocity,
        contact=target.contact,
        tilt=target.tilt,
        travel=target.travel,
        trim=target.trim,
    )
