"""The straightened picture while the tip presses: the part of the wall in view, and the places of guides."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.config.field_of_view import camera_rotation, field_of_view, picture_outline, straightened_intrinsics
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import to_camera
from ibvs_qp.measurement import HORIZONTAL
from ibvs_qp.pilot.config import PilotConfig
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.pattern import Pattern
from ibvs_qp.vision.picture.layout import propeller_mask, vehicle_mask

#: Least distance of camera and wall that is computed with [m].
_LEAST_DEPTH_M = 0.01
#: Distance of the fresh edge that is looked for from the brush, and from the picture's border, normalised: the margin
#: of the brush's mask and half of a profile; the blur at the border.
_BESIDE_BRUSH, _BORDER = 0.02, 0.012
#: Rows beside a guide's own that count as it [px]: rounding.
_ROWS = 1


@dataclass(frozen=True, kw_only=True)
class ContactPicture:
    """Geometry of a level vehicle square to the wall, its tip on it.

    Attributes:
        intrinsics: (fx, fy, cx, cy) of the straightened picture [px].
        depth: Camera to wall [m].
        tip: Image of the tip [px], (2,).
        shows_tip: Whether it lies in the real picture.
        seen: Where the real picture shows wall: not outside of it, not behind brush, arm or propellers, bool (H, W).
        propellers: Where a propeller hides the wall, bool (H, W).
    """

    intrinsics: tuple[float, float, float, float]
    depth: float
    tip: np.ndarray
    shows_tip: bool
    seen: np.ndarray
    propellers: np.ndarray

    def place(self, offset_m: float, level: bool = True) -> float:
        """Row of a level line on the wall so far below the tip, or column of an upright one right of it [px]."""
        axis = 1 if level else 0
        return float(self.tip[axis]) + self.intrinsics[axis] * offset_m / self.depth

    def beside(self, offset_m: float, level: bool = True) -> tuple[float, float]:
        """Length of a line in view on both sides of the tip, in widths of the picture.

        Args:
            offset_m: Its distance below the tip, or to the right of it [m].
            level: Whether it is level; else upright.
        """
        seen, along = (self.seen, 0) if level else (self.seen.T, 1)
        place, middle = round(self.place(offset_m, level)), min(max(round(float(self.tip[along])), 0), seen.shape[1])
        if not _ROWS <= place < seen.shape[0] - _ROWS:
            return 0.0, 0.0
        shown: np.ndarray = np.all(seen[place - _ROWS : place + _ROWS + 1], axis=0)
        width = self.seen.shape[1]
        return float(shown[:middle].sum()) / width, float(shown[middle:].sum()) / width


def contact_picture(config: PilotConfig) -> ContactPicture:
    """The picture of a configuration's vehicle in contact."""
    vehicle, vision = config.controller.vehicle, config.vision
    (width, height), rotation = vehicle.camera_size_px, camera_rotation(vehicle.camera_turn_deg)
    fx, fy, cx, cy = straightened_intrinsics(vehicle.camera_intrinsics_px, (width, height), rotation)
    depth = max(vehicle.contact_depth_m, _LEAST_DEPTH_M)
    x, y, _ = to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m))
    tip = np.array((fx * x / depth + cx, fy * y / depth + cy))
    corners = picture_outline(vehicle) * (fx, fy) + (cx, cy)
    picture = np.zeros((height, width), np.uint8)
    cv2.fillConvexPoly(picture, np.rint(np.clip(corners, -4 * width, 4 * width)).astype(np.int32), 255)
    arguments = vision.brush_width_m, vision.mask, (fx, fy, cx, cy), (height, width)
    hidden, propellers = vehicle_mask(vehicle, *arguments) > 0, propeller_mask(vehicle, *arguments[1:]) > 0
    ray = rotation.T @ to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m))
    (own_fx, own_fy, own_cx, own_cy), ahead = vehicle.camera_intrinsics_px, float(ray[2])
    column, row = (
        own_fx * ray[0] / max(ahead, _LEAST_DEPTH_M) + own_cx,
        own_fy * ray[1] / max(ahead, _LEAST_DEPTH_M) + own_cy,
    )
    inside = ahead > _LEAST_DEPTH_M and 0 <= column < width and 0 <= row < height
    return ContactPicture(
        intrinsics=(fx, fy, cx, cy),
        depth=depth,
        tip=tip,
        shows_tip=inside,
        seen=(picture > 0) & ~hidden,
        propellers=propellers & (picture > 0),
    )


def guide_direction(painting: PaintingConfig) -> tuple[bool, float]:
    """Whether guides are level, and on which side of the tip: +1 below or to the right of it, else -1."""
    pattern = Pattern(painting.pattern, painting.start)
    right, down = pattern.across
    return pattern.guide_role == HORIZONTAL, -(right + down)


def hint_span(vehicle: VehicleParams, brush_width_m: float, role: str, ahead: int) -> tuple[float, float]:
    """Where the last stroke's edge beside the brush is looked for, along the edge; empty where its ends are reversed.

    Args:
        vehicle: Tip and camera.
        brush_width_m: Diameter of the brush [m].
        role: Of the edge: "horizontal" or "vertical".
        ahead: +1 to the right of the brush or below it, -1 to the left or above.

    Returns:
        Range of the normalised x of a level edge, of the normalised y of an upright one, in C.
    """
    depth, view = max(vehicle.contact_depth_m, _LEAST_DEPTH_M), field_of_view(vehicle)
    x, y, _ = to_camera(np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m)) / depth
    tip, low, high = (x, view.left, view.right) if role == HORIZONTAL else (y, view.up, view.down)
    beside = 0.5 * brush_width_m / depth + _BESIDE_BRUSH
    return (float(tip + beside), high - _BORDER) if ahead > 0 else (low + _BORDER, float(tip - beside))
