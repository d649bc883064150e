"""Poses and shapes of vehicle, wall and forces, for viewers in three dimensions.

Frame `WALL` has its origin at the wall, x into it, y to the left and z up, the wall as estimated; the point ahead of
the tip at the start lies at y = z = 0. `VEHICLE` is B: front, right, down. Quaternions are (x, y, z, w), lengths in m.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from scipy.spatial.transform import Rotation

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.estimation.wall_lines import WallAxes
from ibvs_qp.frames import R_BODY_CAMERA, Rotation3, Vector3, cross, dot, unit
from ibvs_qp.interfaces.log.writer import timestamp

WALL, VEHICLE, CAMERA, DEPTH_CAMERA = "wall", "vehicle", "camera", "depth_camera"
#: Colours (r, g, b, a).
ROTOR, ARM, BRUSH, BOARD = (0.25, 0.55, 0.85, 0.5), (0.5, 0.5, 0.5, 1.0), (0.16, 0.35, 0.8, 1.0), (0.9, 0.9, 0.88, 0.5)
_THRUST, _PUSH = (1.0, 0.6, 0.0, 1.0), (0.9, 0.1, 0.1, 1.0)
#: Length of arrows [m/N], of thrusts and of the push; thickness of discs and walls, size of the camera [m].
_THRUST_SCALE, _PUSH_SCALE, _THIN, _CAMERA = 0.01, 0.04, 0.01, 0.06
#: Side of the drawn part of the wall as estimated [m].
_SIDE = 2.0
#: Points on a rotor's circle and on the arm, for viewers without shapes.
_POINTS = 36

Vector = Sequence[float] | np.ndarray
#: A dict of fields: protobuf takes it in place of a message, its type stubs do not.
Message = Any


def quaternion(rotation: Sequence[Sequence[float]] | np.ndarray) -> list[float]:
    """Quaternion of a rotation matrix, (3, 3)."""
    return Rotation.from_matrix(rotation).as_quat().tolist()


def wall_from_body(axes: WallAxes) -> Rotation3:
    """Rotation from B to `WALL`."""
    (rx, ry, rz), (dx, dy, dz), (nx, ny, nz) = axes.right, axes.down, axes.normal
    return (nx, ny, nz), (-rx, -ry, -rz), (-dx, -dy, -dz)


def xyz(vector: Iterable[float]) -> Message:
    """Foxglove's vector or point."""
    return dict(zip("xyz", map(float, vector), strict=True))


def rgba(color: Iterable[float]) -> Message:
    """Foxglove's colour."""
    return dict(zip("rgba", color, strict=True))


def pose(position: Vector, turn: Vector = (0.0, 0.0, 0.0, 1.0)) -> Message:
    """Foxglove's pose."""
    return {"position": xyz(position), "orientation": dict(zip("xyzw", turn, strict=True))}


def pose_in_frame(frame: str, position: Vector, turn: Vector, ns: int) -> PoseInFrame:
    """A pose by itself."""
    return PoseInFrame(timestamp=timestamp(ns), frame_id=frame, pose=pose(position, turn))


def transform(parent: str, child: str, position: Vector, turn: Vector, ns: int) -> Message:
    """Pose of a frame in another, an entry of Foxglove's FrameTransforms."""
    frames = {"parent_frame_id": parent, "child_frame_id": child, "timestamp": timestamp(ns)}
    return frames | {"translation": xyz(position), "rotation": dict(zip("xyzw", turn, strict=True))}


def mounts(vehicle: VehicleParams, ns: int) -> list[Message]:
    """Transforms of the camera, rectified as perception gets it, and of the tip."""
    turn = quaternion(R_BODY_CAMERA)
    cameras = [transform(VEHICLE, name, vehicle.camera_position_m, turn, ns) for name in (CAMERA, DEPTH_CAMERA)]
    return [*cameras, transform(VEHICLE, "tip", vehicle.tip_position_m, (0.0, 0.0, 0.0, 1.0), ns)]


def shapes(frame: str, name: str, ns: int, **primitives: list[Message]) -> SceneUpdate:
    """Shapes of one entity: lists of ``cubes``, ``cylinders`` and so on."""
    entity: Message = {"timestamp": timestamp(ns), "frame_id": frame, "id": name, "frame_locked": True}
    return SceneUpdate(entities=[entity | primitives])


def box(position: Vector, size: Vector, color: Vector, turn: Vector = (0.0, 0.0, 0.0, 1.0)) -> Message:
    """A cube or an ellipsoid with sides or diameters of a size [m], (3,)."""
    return {"pose": pose(position, turn), "size": xyz(size), "color": rgba(color)}


def _cylinder(position: Vector, axis: Vector, radius: float, length: float, color: Vector) -> Message:
    size, turn = (2.0 * radius, 2.0 * radius, length), _turn((0.0, 0.0, 1.0), axis)
    return box(position, size, color, turn) | {"bottom_scale": 1.0, "top_scale": 1.0}


def vehicle_scene(vehicle: VehicleParams, frame: str, ns: int, rotor: Vector = ROTOR) -> SceneUpdate:
    """Rotor discs, arm, brush and camera."""
    rotors, tip = vehicle.geometry, np.array(vehicle.tip_position_m)
    discs = [
        _cylinder(position, axis, vehicle.propeller_radius_m, _THIN, rotor)
        for position, axis in zip(rotors.positions, rotors.axes, strict=True)
    ]
    arm = _cylinder(0.5 * tip, tip, vehicle.arm_radius_m, float(np.linalg.norm(tip)), ARM)
    brush = box(tip, [4.0 * vehicle.arm_radius_m] * 3, BRUSH)
    camera = box(vehicle.camera_position_m, [_CAMERA] * 3, ARM)
    return shapes(frame, frame, ns, cylinders=[*discs, arm], spheres=[brush], cubes=[camera])


def estimated_wall(ns: int) -> SceneUpdate:
    """The wall as estimated."""
    return shapes(WALL, WALL, ns, cubes=[box((0.5 * _THIN, 0.0, 0.0), (_THIN, _SIDE, _SIDE), BOARD)])


def force_arrows(vehicle: VehicleParams, thrusts: np.ndarray, push: float, normal: Vector, ns: int) -> SceneUpdate:
    """Thrusts at the rotors, and the push at the tip along the wall's normal [N]."""
    rotors = vehicle.geometry
    arrows = [
        _arrow(position, axis, _THRUST_SCALE * float(thrust), _THRUST)
        for position, axis, thrust in zip(rotors.positions, rotors.axes, thrusts, strict=True)
    ]
    arrows.append(_arrow(vehicle.tip_position_m, normal, _PUSH_SCALE * max(push, 0.0), _PUSH))
    return shapes(VEHICLE, "forces", ns, arrows=arrows)


def _arrow(start: Vector, axis: Vector, length: float, color: Vector) -> Message:
    shaft, head = {"shaft_length": 0.8 * length, "shaft_diameter": 0.01}, {"head_length": 0.2 * length}
    turn = _turn((1.0, 0.0, 0.0), axis)
    return shaft | head | {"head_diameter": 0.025, "pose": pose(start, turn), "color": rgba(color)}


def vehicle_points(vehicle: VehicleParams, ns: int) -> PointCloud:
    """Circles of the rotors and the arm as points."""
    angles = np.linspace(0.0, 2.0 * np.pi, _POINTS, endpoint=False)[:, None]
    axes, centres = np.array(vehicle.geometry.axes)[:, None], np.array(vehicle.geometry.positions)[:, None]
    across = np.cross(axes, (1.0, 0.0, 0.0))
    across /= np.linalg.norm(across, axis=2, keepdims=True)
    circles = centres + vehicle.propeller_radius_m * (np.cos(angles) * across + np.sin(angles) * np.cross(axes, across))
    arm = np.linspace(0.0, 1.0, _POINTS)[:, None] * np.array(vehicle.tip_position_m)
    return _cloud(np.concatenate((circles.reshape(-1, 3), arm)), VEHICLE, ns)


def wall_points(ns: int) -> PointCloud:
    """The estimated wall as a grid of points."""
    ticks = np.linspace(-0.5 * _SIDE, 0.5 * _SIDE, 21)
    y, z = (grid.ravel() for grid in np.meshgrid(ticks, ticks))
    return _cloud(np.column_stack((np.zeros(len(y)), y, z)), WALL, ns)


def _cloud(points: np.ndarray, frame: str, ns: int) -> PointCloud:
    return PointCloud(
        timestamp=timestamp(ns),
        frame_id=frame,
        pose=pose((0.0, 0.0, 0.0)),
        point_stride=12,
        fields=[
            PackedElementField(name=name, offset=4 * i, type=PackedElementField.FLOAT32) for i, name in enumerate("xyz")
        ],
        data=points.astype("<f4").tobytes(),
    )


def _turn(start: Vector3, end: Vector) -> tuple[float, float, float, float]:
    """Quaternion of the shortest turn from a unit vector to a direction."""
    direction = unit([*end])
    (x, y, z), w = cross(start, direction), 1.0 + dot(start, direction)
    if w < 1e-9:  # opposite: half a turn about an axis across
        x, y, z, w = start[1], start[2], start[0], 0.0
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return x / length, y / length, z / length, w / length
