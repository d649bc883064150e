"""Wall and tip in the picture: the wall's plane, the image of the tip's wall point, the camera's twists."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from ibvs_qp.config import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA, to_camera
from ibvs_qp.model.inputs import Body, Contact

#: Least depth of the wall in front of the camera [m]; it keeps divisions finite.
LEAST_DEPTH = 0.05


@dataclass(frozen=True, kw_only=True)
class CameraView:
    """Common to all lines of a step, in C.

    Attributes:
        plane: Wall plane (A, B, C) for D = -1.
        depth: Depth of the tip's wall point [m]: where the tip meets the wall when it moves along n.
        tip: Image (x_t, y_t) of that point, normalised.
        tip_place: Image of that point for a level vehicle square to the wall, times depth [m], to the right and down.
        twist: Camera twist [v; omega] without motion along the normal, (6,).
        relative_twist: The same minus the commanded travel: zero where the vehicle moves as commanded.
    """

    plane: ca.SX
    depth: ca.SX
    tip: tuple[ca.SX, ca.SX]
    tip_place: tuple[float, float]
    twist: ca.SX
    relative_twist: ca.SX


def camera_view(vehicle: VehicleParams, body: Body, contact: Contact, travel: ca.SX) -> CameraView:
    """Wall, tip and motion in the camera frame; ``travel`` is the commanded velocity in the wall plane, in B [m/s]."""
    to_c = ca.DM(R_BODY_CAMERA.T)
    tip = to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m))
    normal = to_c @ contact.normal
    depth = ca.fmax(contact.distance + ca.dot(normal, ca.DM(tip)), LEAST_DEPTH)
    foot = ca.DM(tip) + contact.distance * normal
    foot_depth = ca.fmax(foot[2], LEAST_DEPTH)
    in_plane = body.velocity - contact.normal * ca.dot(contact.normal, body.velocity)
    velocity = to_c @ (in_plane + ca.cross(body.rate, ca.DM(vehicle.camera_position_m)))
    rate = to_c @ body.rate
    return CameraView(
        plane=ca.if_else(contact.known, normal / depth, ca.DM([0.0, 0.0, 1.0])),
        depth=foot_depth,
        tip=(foot[0] / foot_depth, foot[1] / foot_depth),
        tip_place=(float(tip[0]), float(tip[1])),
        twist=ca.vertcat(velocity, rate),
        relative_twist=ca.vertcat(velocity - to_c @ travel, rate),
    )
