"""Poses of camera and force sensor of a bag, from ``/tf_static``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ibvs_qp.config import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA

TF, TF_TOPIC = "tf2_msgs/msg/TFMessage", "/tf_static"
#: Differences from the vehicle that are no rounding of a drawing: distance [m] and angle [deg].
DISTANCE_M, ANGLE_DEG = 0.01, 2.0
#: Longest chain of frames between two that are compared [-].
_LONGEST = 64
#: Front-left-up to front-right-down.
_FLU_TO_FRD = Rotation.from_quat((1.0, 0.0, 0.0, 0.0))


@dataclass(frozen=True, kw_only=True)
class StaticPose:
    """Pose of a frame in front-right-down axes of another, usually ``base_link``.

    Attributes:
        position_m: Of its origin [m].
        rotation: Of its axes, which are those of its sensor.
    """

    position_m: np.ndarray
    rotation: Rotation


class StaticPoses:
    """The tree of ``/tf_static``; a later transform of a frame replaces an earlier one."""

    def __init__(self, messages: Iterable[Any] = ()) -> None:
        self._parents: dict[str, tuple[str, Rotation, np.ndarray]] = {}
        for message in messages:
            self.add(message)

    def add(self, message: Any) -> None:
        """Take the transforms of a message."""
        for each in message.transforms:
            turn, move = each.transform.rotation, each.transform.translation
            quaternion = np.array((turn.x, turn.y, turn.z, turn.w))
            position = np.array((move.x, move.y, move.z))
            if np.isfinite(position).all() and 0.9 < np.linalg.norm(quaternion) < 1.1:
                parent, child = each.header.frame_id.lstrip("/"), each.child_frame_id.lstrip("/")
                self._parents[child] = parent, Rotation.from_quat(quaternion), position

    def pose(self, frame: str, base: str) -> StaticPose | None:
        """Pose of a frame in a base, of which it is a descendant; None where the tree does not have it."""
        rotation, position, frame = Rotation.identity(), np.zeros(3), frame.lstrip("/")
        for _ in range(_LONGEST):
            if frame == base:
                return StaticPose(position_m=_FLU_TO_FRD.apply(position), rotation=_FLU_TO_FRD * rotation)
            if frame not in self._parents:
                return None
            frame, turn, move = self._parents[frame]
            rotation, position = turn * rotation, move + turn.apply(position)
        return None


def differences(camera: StaticPose | None, force: StaticPose | None, vehicle: VehicleParams) -> list[str]:
    """Differences of the poses from those of a vehicle, in words.

    The base's origin need not be the centre of mass: of the positions the way from force sensor to camera is compared.
    """
    found = []
    if camera is not None:
        turn = Rotation.from_rotvec(vehicle.camera_turn_deg, degrees=True)
        assumed_axes = turn * Rotation.from_matrix(R_BODY_CAMERA)
        angle = np.degrees((assumed_axes.inv() * camera.rotation).magnitude())
        if angle > ANGLE_DEG:
            found.append(f"the camera of tf_static is turned by {angle:.1f} deg from that of the vehicle")
    if camera is not None and force is not None:
        stated = camera.position_m - force.position_m
        assumed = np.array(vehicle.camera_position_m) - np.array(vehicle.force_torque_position_m)
        if np.linalg.norm(stated - assumed) > DISTANCE_M:
            found.append(
                f"from force sensor to camera tf_static has {np.round(stated, 3).tolist()} m, the vehicle "
                f"{np.round(assumed, 3).tolist()} m (front, right, down)"
            )
    return found
