"""Picture of arm, brush and propellers in the camera, constant because all are rigid."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

import cv2
import numpy as np

from allocation.geometry import disc_rim
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA, rotation_from_vector
from sim.world.drawn_shape import BRUSH_LENGTH_M, brush_color
from sim.world.scene import Scene

#: Step along the brush between the slices it is drawn in [m].
_SLICE_M = 0.002
#: Corners of a propeller disc [-].
_RIM_POINTS = 180
#: Least depth drawn [m].
_NEAR_M = 0.05
#: Fraction of the light that a spinning propeller blocks.
_PROPELLER_SHADE = 0.35
_ARM_COLOR = (58, 60, 64)
_SHIFT, _ONE = 4, 16


@dataclass(frozen=True, kw_only=True)
class VehicleLayer:
    """Constant picture of the vehicle's own parts."""

    picture: np.ndarray  # uint8 (H, W, 4), valid under the mask
    mask: np.ndarray  # 255 where arm or brush hide the scene, uint8 (H, W)
    inverse_depth: np.ndarray  # 1/Z of arm and brush under the mask [1/m], float32 (H, W)
    holes: np.ndarray  # 255 where the depth step along the outline leaves no reading, uint8 (H, W)
    propellers: np.ndarray  # 255 where a propeller disc lies in front of the scene, uint8 (H, W)


def vehicle_layer(
    scene: Scene, vehicle: VehicleParams, intrinsics: tuple[float, float, float, float], rng: np.random.Generator
) -> VehicleLayer:
    """Draw arm, brush and propellers as the camera sees them.

    Args:
        scene: Gives picture size, brush width and colours.
        vehicle: Gives every position and size.
        intrinsics: (fx, fy, cx, cy) [px].
        rng: Raggedness of the depth holes along the outline.
    """
    shape = (scene.camera.height, scene.camera.width)
    picture, mask = np.zeros((*shape, 4), np.uint8), np.zeros(shape, np.uint8)
    inverse_depth, propellers = np.zeros(shape, np.float32), np.zeros(shape, np.uint8)
    camera, turn = np.asarray(vehicle.camera_position_m), to_camera(vehicle)
    tip, base = np.asarray(vehicle.tip_position_m), np.asarray(vehicle.force_torque_position_m)
    ferrule = tip - np.array([BRUSH_LENGTH_M, 0.0, 0.0])
    color = np.array(brush_color(scene), float)
    slices: list[tuple[np.ndarray, float, np.ndarray]] = []  # centre in C, radius, colour; far to near
    count = round(BRUSH_LENGTH_M / _SLICE_M)
    for k in range(count + 1):
        tone = 1.0 if k == count else 0.55 + 0.25 * k / count
        center = tip + (ferrule - tip) * k / count
        slices.append((center, 0.5 * scene.paint.brush_width_m, color * tone))
    steps = max(2, round(float(np.linalg.norm(ferrule - base)) / _SLICE_M))
    for k in range(steps + 1):
        slices.append((ferrule + (base - ferrule) * k / steps, vehicle.arm_radius_m, np.array(_ARM_COLOR, float)))
    fx, fy, cx, cy = intrinsics
    for center, radius, tone in slices:
        x, y, z = turn @ (center - camera)
        if z < _NEAR_M:
            continue
        place = (round((fx * x / z + cx) * _ONE), round((fy * y / z + cy) * _ONE))
        size = round(fx * radius / z * _ONE)
        cv2.circle(picture, place, size, (*tone.tolist(), 255.0), -1, cv2.LINE_8, _SHIFT)
        cv2.circle(mask, place, size, 255.0, -1, cv2.LINE_8, _SHIFT)
        cv2.circle(inverse_depth, place, size, 1.0 / z, -1, cv2.LINE_8, _SHIFT)
    for hub, axis in zip(vehicle.geometry.positions, vehicle.geometry.axes, strict=True):
        rim = hub - camera + disc_rim(axis, vehicle.propeller_radius_m, _RIM_POINTS)
        _fill(propellers, rim @ turn.T, intrinsics)
    return VehicleLayer(
        picture=picture, mask=mask, inverse_depth=inverse_depth, holes=_ragged_outline(mask, rng), propellers=propellers
    )


def to_camera(vehicle: VehicleParams) -> np.ndarray:
    """Rotation from B to the axes of the camera, (3, 3)."""
    turn = rotation_from_vector(np.radians(vehicle.camera_turn_deg))
    return (turn @ R_BODY_CAMERA).T


#: Cache of masks by everything that they depend on: every geometric flight needs one, and drawing takes 30 ms.
_masks: dict[Hashable, np.ndarray] = {}


def vehicle_mask(scene: Scene, vehicle: VehicleParams, intrinsics: tuple[float, float, float, float]) -> np.ndarray:
    """255 where arm or brush hide the scene, uint8 (H, W), not to be written; arguments as for `vehicle_layer`."""
    key = scene.camera.height, scene.camera.width, scene.paint.brush_width_m, vehicle, intrinsics
    if key not in _masks:
        _masks[key] = vehicle_layer(scene, vehicle, intrinsics, np.random.default_rng(0)).mask
        _masks[key].flags.writeable = False
    return _masks[key]


def shade_propellers(picture: np.ndarray, propellers: np.ndarray) -> None:
    """Darken a picture, uint8 (H, W, C), in place under the propeller mask, as fast blades do."""
    dimmed = cv2.convertScaleAbs(picture, alpha=1.0 - _PROPELLER_SHADE, beta=12.0)
    cv2.copyTo(dimmed, propellers, picture)


def _fill(mask: np.ndarray, outline: np.ndarray, intrinsics: tuple[float, float, float, float]) -> None:
    """Draw a convex outline in camera axes, (n, 3)."""
    points = clip_near(outline, _NEAR_M)
    if len(points) < 3:
        return
    fx, fy, cx, cy = intrinsics
    pixels = np.column_stack((fx * points[:, 0] / points[:, 2] + cx, fy * points[:, 1] / points[:, 2] + cy))
    cv2.fillConvexPoly(mask, np.rint(pixels * _ONE).astype(np.int32), 255.0, cv2.LINE_8, _SHIFT)


def clip_near(points: np.ndarray, near_m: float) -> np.ndarray:
    """The part of a polygon in camera coordinates, (n, 3), that lies at depth ``near_m`` or beyond."""
    inside = []
    for start, stop in zip(points, np.roll(points, -1, axis=0), strict=True):
        if start[2] >= near_m:
            inside.append(start)
        if (start[2] >= near_m) != (stop[2] >= near_m):
            inside.append(start + (near_m - start[2]) / (stop[2] - start[2]) * (stop - start))
    return np.array(inside).reshape(-1, 3)


def _ragged_outline(mask: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A band one to three pixels wide around the mask, narrower and wider at random."""
    near = cv2.dilate(mask, np.ones((3, 3), np.uint8))
    far = cv2.dilate(mask, np.ones((7, 7), np.uint8))
    patches = cv2.GaussianBlur(rng.standard_normal(mask.shape, np.float32), (0, 0), 3.0) > 0.0
    return np.where((near > 0) | ((far > 0) & patches), np.uint8(255), np.uint8(0)) & ~mask
