"""Shapes of vehicle, wall and forces, for viewers in three dimensions."""

from __future__ import annotations

from typing import Any

import numpy as np
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import Vector3, cross, dot
from ibvs_qp.recording.poses import STRAIGHT, VEHICLE, WALL, Turn, Vector, place

#: Colours (r, g, b, a).
ROTOR, ARM, BRUSH, BOARD = (0.25, 0.55, 0.85, 0.5), (0.5, 0.5, 0.5, 1.0), (0.16, 0.35, 0.8, 1.0), (0.9, 0.9, 0.88, 0.5)
_THRUST, _PUSH = (1.0, 0.6, 0.0, 1.0), (0.9, 0.1, 0.1, 1.0)
#: Length of arrows [m/N], of thrusts and of the push; thickness of discs and walls, size of the camera [m].
_THRUST_SCALE, _PUSH_SCALE, _THIN, _CAMERA = 0.01, 0.04, 0.01, 0.06
#: Side of the drawn part of the wall as estimated [m].
_SIDE = 2.0
#: Points on a rotor's circle and on the arm, for viewers without shapes.
_POINTS = 36

Color = tuple[float, float, float, float]


def _paint(target: Any, color: Color) -> None:
    target.r, target.g, target.b, target.a = color


def _entity(update: SceneUpdate, frame: str, name: str, ns: int) -> SceneEntity:
    entity = update.entities.add(frame_id=frame, id=name, frame_locked=True)
    entity.timestamp.FromNanoseconds(ns)
    return entity


def vehicle_scene(vehicle: VehicleParams, frame: str, ns: int, rotor: Color = ROTOR) -> SceneUpdate:
    """Rotor discs, arm, brush and camera."""
    update = SceneUpdate()
    entity = _entity(update, frame, frame, ns)
    for position, axis in zip(vehicle.geometry.positions, vehicle.geometry.axes, strict=True):
        disc = entity.cylinders.add(bottom_scale=1.0, top_scale=1.0)
        place(disc.pose, position, _from_z(axis))
        disc.size.x = disc.size.y = 2.0 * vehicle.propeller_radius_m
        disc.size.z = _THIN
        _paint(disc.color, rotor)
    tip = np.array(vehicle.tip_position_m)
    arm = entity.cylinders.add(bottom_scale=1.0, top_scale=1.0)
    place(arm.pose, 0.5 * tip, _from_z(tip))
    arm.size.x = arm.size.y = 2.0 * vehicle.arm_radius_m
    arm.size.z = float(np.linalg.norm(tip))
    _paint(arm.color, ARM)
    brush, camera = entity.spheres.add(), entity.cubes.add()
    place(brush.pose, tip)
    place(camera.pose, vehicle.camera_position_m)
    for axis in "xyz":
        setattr(brush.size, axis, 4.0 * vehicle.arm_radius_m)
        setattr(camera.size, axis, _CAMERA)
    _paint(brush.color, BRUSH)
    _paint(camera.color, ARM)
    return update


def vehicle_points(vehicle: VehicleParams, ns: int) -> PointCloud:
    """Circles of the rotors and the arm as points."""
    angles = np.linspace(0.0, 2.0 * np.pi, _POINTS, endpoint=False)
    circles = []
    for position, axis in zip(vehicle.geometry.positions, vehicle.geometry.axes, strict=True):
        first = np.cross(axis, (1.0, 0.0, 0.0))
        first /= np.linalg.norm(first)
        second = np.cross(axis, first)
        ring = np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * second
        circles.append(position + vehicle.propeller_radius_m * ring)
    arm = np.linspace(0.0, 1.0, _POINTS)[:, None] * np.array(vehicle.tip_position_m)
    return _cloud(np.concatenate([*circles, arm]), VEHICLE, ns)


def wall_points(ns: int) -> PointCloud:
    """The estimated wall as a grid of points."""
    ticks = np.linspace(-0.5 * _SIDE, 0.5 * _SIDE, 21)
    y, z = (grid.ravel() for grid in np.meshgrid(ticks, ticks))
    return _cloud(np.column_stack((np.zeros(len(y)), y, z)), WALL, ns)


def _cloud(points: np.ndarray, frame: str, ns: int) -> PointCloud:
    message = PointCloud(frame_id=frame, point_stride=12, data=points.astype("<f4").tobytes())
    message.timestamp.FromNanoseconds(ns)
    place(message.pose, (0.0, 0.0, 0.0))
    for index, name in enumerate("xyz"):
        message.fields.add(name=name, offset=4 * index, type=PackedElementField.FLOAT32)
    return message


def plate(
    frame: str,
    name: str,
    centre: Vector,
    size: Vector,
    color: Color,
    ns: int,
    turn: Turn = STRAIGHT,
) -> SceneUpdate:
    """A plate: centre and sides [m], (3,)."""
    update = SceneUpdate()
    cube = _entity(update, frame, name, ns).cubes.add()
    place(cube.pose, centre, turn)
    cube.size.x, cube.size.y, cube.size.z = map(float, size)
    _paint(cube.color, color)
    return update


def estimated_wall(ns: int) -> SceneUpdate:
    """The wall as estimated."""
    return plate(WALL, WALL, (0.5 * _THIN, 0.0, 0.0), (_THIN, _SIDE, _SIDE), BOARD, ns)


def force_arrows(vehicle: VehicleParams, thrusts: np.ndarray, push: float, normal: Vector, ns: int) -> SceneUpdate:
    """Thrusts at the rotors, and the push at the tip along the wall's normal [N]."""
    update = SceneUpdate()
    entity = _entity(update, VEHICLE, "forces", ns)
    for position, axis, thrust in zip(vehicle.geometry.positions, vehicle.geometry.axes, thrusts, strict=True):
        _arrow(entity, position, axis, _THRUST_SCALE * float(thrust), _THRUST)
    _arrow(entity, vehicle.tip_position_m, normal, _PUSH_SCALE * max(push, 0.0), _PUSH)
    return update


def _arrow(entity: SceneEntity, start: Vector, axis: Vector, length: float, color: Color) -> None:
    arrow = entity.arrows.add(
        shaft_length=0.8 * length, shaft_diameter=0.01, head_length=0.2 * length, head_diameter=0.025
    )
    place(arrow.pose, start, _turn((1.0, 0.0, 0.0), axis))
    _paint(arrow.color, color)


def _from_z(axis: Vector) -> Turn:
    return _turn((0.0, 0.0, 1.0), axis)


def _turn(start: Vector3, end: Vector) -> Turn:
    """Quaternion (x, y, z, w) of the shortest turn from one direction to another."""
    unit = (np.asarray(end, float) / np.linalg.norm(end)).tolist()
    w = 1.0 + dot(start, unit)
    x, y, z = cross(start, unit) if w > 1e-9 else (start[1], start[2], start[0])  # opposite: half a turn
    length = float(np.sqrt(x * x + y * y + z * z + (w * w if w > 1e-9 else 0.0)))
    return x / length, y / length, z / length, (w if w > 1e-9 else 0.0) / length
