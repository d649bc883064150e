"""Where the vehicle hides its own view: arm, brush and the tilted propellers, from geometry and intrinsics."""

from __future__ import annotations

import itertools
import math

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA
from ibvs_qp.vision.config import REFERENCE_WIDTH, MaskConfig

#: Parts nearer to the camera plane than this are cut off [m]; their image runs out of any picture.
NEAR_M = 0.03
#: Corners of a drawn circle and stations along a rod.
_CORNERS, _STATIONS = 48, 40
#: Sub-pixel bits of the polygon fill.
_SHIFT = 4

Intrinsics = tuple[float, float, float, float]


def vehicle_mask(
    vehicle: VehicleParams, brush_width_m: float, config: MaskConfig, intrinsics: Intrinsics, shape: tuple[int, int]
) -> np.ndarray:
    """Pixels hidden by the vehicle itself.

    Args:
        vehicle: Geometry of arm, tip, camera and rotors.
        brush_width_m: Diameter of the round brush [m].
        config: Brush length and margin.
        intrinsics: (fx, fy, cx, cy) [px].
        shape: (height, width) of the picture [px].

    Returns:
        uint8 picture of that shape, 255 where hidden.
    """
    mask = np.zeros(shape, np.uint8)
    tip = np.asarray(vehicle.tip_position_m, float)
    axis = np.array([1.0, 0.0, 0.0])
    _fill_rod(mask, vehicle, intrinsics, np.array([0.0, tip[1], tip[2]]), tip, vehicle.arm_radius_m)
    _fill_rod(mask, vehicle, intrinsics, tip - config.brush_length_m * axis, tip, 0.5 * brush_width_m)
    return _grow(mask, config.margin_px * shape[1] / REFERENCE_WIDTH) | propeller_mask(
        vehicle, config, intrinsics, shape
    )


def propeller_mask(
    vehicle: VehicleParams, config: MaskConfig, intrinsics: Intrinsics, shape: tuple[int, int]
) -> np.ndarray:
    """The part of `vehicle_mask` that its propellers hide."""
    mask = np.zeros(shape, np.uint8)
    for hub, thrust_axis in zip(vehicle.geometry.positions, vehicle.geometry.axes, strict=True):
        disc = hub + _circle(thrust_axis, vehicle.propeller_radius_m)
        _fill_hull(mask, _project(disc, vehicle, intrinsics))
    return _grow(mask, config.margin_px * shape[1] / REFERENCE_WIDTH)


def brush_zone(
    vehicle: VehicleParams, brush_width_m: float, config: MaskConfig, intrinsics: Intrinsics, shape: tuple[int, int]
) -> np.ndarray:
    """Pixels of the brush grown by the margin within which fresh paint appears, uint8 (H, W)."""
    zone = np.zeros(shape, np.uint8)
    tip = np.asarray(vehicle.tip_position_m, float)
    rear = tip - config.brush_length_m * np.array([1.0, 0.0, 0.0])
    _fill_rod(zone, vehicle, intrinsics, rear, tip, 0.5 * brush_width_m)
    return _grow(zone, config.paint_margin_px * shape[1] / REFERENCE_WIDTH)


def _circle(axis: np.ndarray, radius: float) -> np.ndarray:
    """Points of a circle around an axis, seen from its centre, (n, 3)."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = np.cross(axis, helper)
    first /= np.linalg.norm(first)
    angle = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)[:, None]
    return radius * (np.cos(angle) * first + np.sin(angle) * np.cross(axis, first))


def _project(points: np.ndarray, vehicle: VehicleParams, intrinsics: Intrinsics) -> np.ndarray:
    """Pixels of the body points in front of the camera, (m, 2)."""
    camera = (points - np.asarray(vehicle.camera_position_m, float)) @ R_BODY_CAMERA
    camera = camera[camera[:, 2] > NEAR_M]
    fx, fy, cx, cy = intrinsics
    return np.column_stack((fx * camera[:, 0] / camera[:, 2] + cx, fy * camera[:, 1] / camera[:, 2] + cy))


def _fill_rod(
    mask: np.ndarray, vehicle: VehicleParams, intrinsics: Intrinsics, start: np.ndarray, end: np.ndarray, radius: float
) -> None:
    """Fill the image of a round rod: hulls of neighbouring cross sections, so that perspective is kept."""
    axis = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    circle = _circle(axis, radius)
    sections = [
        _project(start + share * (end - start) + circle, vehicle, intrinsics)
        for share in np.linspace(0.0, 1.0, _STATIONS)
    ]
    for one, two in itertools.pairwise(sections):
        _fill_hull(mask, np.vstack((one, two)))


def _fill_hull(mask: np.ndarray, pixels: np.ndarray) -> None:
    if len(pixels) < 3:
        return
    limit = 8.0 * max(mask.shape)  # far outside: keeps the fixed-point polygon fill from overflowing
    hull = cv2.convexHull(np.clip(pixels, -limit, limit).astype(np.float32))
    cv2.fillConvexPoly(mask, np.round(hull * (1 << _SHIFT)).astype(np.int32), 255, shift=_SHIFT)


def _grow(mask: np.ndarray, margin: float) -> np.ndarray:
    """The mask with a margin [px]; in cells where the picture is wider than the reference, which hide a little more.

    The dilation's cost grows with the fourth power of the width: 0.3 s at 1920, 25 s at 4096 pixels.
    """
    rows, columns = mask.shape
    cell = math.ceil(columns / REFERENCE_WIDTH)
    if cell > 1:
        padded = cv2.copyMakeBorder(mask, 0, -rows % cell, 0, -columns % cell, cv2.BORDER_CONSTANT)
        height, width = padded.shape
        means = cv2.resize(padded, (width // cell, height // cell), interpolation=cv2.INTER_AREA)
        grown = _grow(np.where(means > 0, np.uint8(255), np.uint8(0)), margin / cell)
        return np.ascontiguousarray(
            cv2.resize(grown, (width, height), interpolation=cv2.INTER_NEAREST)[:rows, :columns]
        )
    size = 2 * round(margin) + 1
    return cv2.dilate(mask, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))) if size > 1 else mask
