"""Poses of the log's frames.

Frame `WALL` has its origin at the wall, x into it, y to the left and z up, the wall as estimated; what is ahead of the
tip at the start lies at y = z = 0. `VEHICLE` is B: front, right, down.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA, Rotation3
from ibvs_qp.recording.camera import CAMERA, DEPTH_CAMERA

WALL, VEHICLE = "wall", "vehicle"
#: Three numbers; quaternion (x, y, z, w).
Vector = Sequence[float] | np.ndarray
Turn = tuple[float, float, float, float]
STRAIGHT: Turn = (0.0, 0.0, 0.0, 1.0)


def quaternion(rotation: Sequence[Sequence[float]] | np.ndarray) -> Turn:
    """Quaternion (x, y, z, w) of a rotation matrix, (3, 3): the largest component is computed first."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    squares = 1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i  # four times w^2, x^2, y^2, z^2
    rows = (
        (squares[0], h - f, c - g, d - b),
        (h - f, squares[1], b + d, c + g),
        (c - g, b + d, squares[2], f + h),
        (d - b, c + g, f + h, squares[3]),
    )
    w, x, y, z = rows[squares.index(max(squares))]
    scale = 1.0 / float(np.sqrt(w * w + x * x + y * y + z * z))
    return x * scale, y * scale, z * scale, w * scale


def place(pose: Any, position: Vector, turn: Turn = STRAIGHT) -> None:
    """Fill a Foxglove pose: position [m], (3,), and quaternion (x, y, z, w)."""
    pose.position.x, pose.position.y, pose.position.z = map(float, position)
    pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w = turn


def transform(frames: FrameTransforms, parent: str, child: str, position: Vector, turn: Turn, ns: int) -> None:
    """Add the pose of a frame in another: position [m], (3,), and quaternion (x, y, z, w)."""
    entry = frames.transforms.add(parent_frame_id=parent, child_frame_id=child)
    entry.timestamp.FromNanoseconds(ns)
    entry.translation.x, entry.translation.y, entry.translation.z = map(float, position)
    entry.rotation.x, entry.rotation.y, entry.rotation.z, entry.rotation.w = map(float, turn)


def mounts(message: FrameTransforms, vehicle: VehicleParams, ns: int) -> None:
    """Add the camera, rectified as perception gets it, and the tip to the vehicle."""
    turn = quaternion(R_BODY_CAMERA.tolist())
    transform(message, VEHICLE, CAMERA, vehicle.camera_position_m, turn, ns)
    transform(message, VEHICLE, DEPTH_CAMERA, vehicle.camera_position_m, turn, ns)
    transform(message, VEHICLE, "tip", vehicle.tip_position_m, STRAIGHT, ns)


def pose_in_frame(frame: str, position: Vector, turn: Turn, ns: int) -> PoseInFrame:
    """A pose by itself."""
    message = PoseInFrame(frame_id=frame)
    message.timestamp.FromNanoseconds(ns)
    place(message.pose, position, turn)
    return message


def wall_from_body(right: Sequence[float], down: Sequence[float], normal: Sequence[float]) -> Rotation3:
    """Rotation from B to `WALL`, by the wall's axes in B."""
    (rx, ry, rz), (dx, dy, dz), (nx, ny, nz) = right, down, normal
    return (nx, ny, nz), (-rx, -ry, -rz), (-dx, -dy, -dz)
