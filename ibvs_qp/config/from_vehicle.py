"""Settings of the controller that follow from vehicle and camera."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.config.field_of_view import field_of_view
from ibvs_qp.config.vehicle import VehicleParams

#: Camera to wall beyond that in contact [m]: the push is full up to the first and none from the second. The depth of a
#: picture is good to millimetres, and the stand-off before a touch is 6 cm.
_FULL_PUSH_M, _NO_PUSH_M = 0.03, 0.13
#: Yaw bound per yaw at which a propeller strikes the wall [-], and the largest bound [deg]: the lines' errors are exact
#: for small yaw.
_OF_STRIKE, _MOST_YAW_DEG = 0.5, 10.0
#: Least yaw bound [deg], of a vehicle without any room: the least that `limits.yaw_deg` takes.
_LEAST_YAW_DEG = 0.5
#: Yaw angles at which the clearance is computed [deg].
_YAWS_DEG = np.linspace(0.0, 60.0, 1201)
#: Least room for a guide between two bounds of the view [-]: of a camera that looks past the wall, which is refused
#: elsewhere.
_LEAST_VIEW = 0.02


def contact_depth(vehicle: VehicleParams) -> float:
    """Camera to wall in contact, of a level vehicle square to the wall [m]."""
    return vehicle.tip_position_m[0] - vehicle.camera_position_m[0]


def contact_values(vehicle: VehicleParams) -> dict[str, float]:
    """Settings of `contact` that follow from tip and camera."""
    arm = max(contact_depth(vehicle), 0.0)
    return {"depth_min_m": round(arm + _FULL_PUSH_M, 9), "depth_max_m": round(arm + _NO_PUSH_M, 9)}


def limit_values(vehicle: VehicleParams, view_margin: float) -> dict[str, float]:
    """Settings of `limits` that follow from propellers, tip and camera.

    Args:
        vehicle: The vehicle.
        view_margin: `limits.view_margin`, a share of the picture's width.
    """
    yaw = _OF_STRIKE * math.floor(strike_yaw_deg(vehicle))
    margin = view_margin * vehicle.camera_size_px[0] / vehicle.camera_intrinsics_px[0]
    view = field_of_view(vehicle)
    left, right = _within(view.left + margin, view.right - margin)
    up, down = _within(view.up + margin, view.down - margin)
    return {
        "yaw_deg": min(max(yaw, _LEAST_YAW_DEG), _MOST_YAW_DEG),
        "view_left": left,
        "view_right": right,
        "view_up": up,
        "view_down": down,
    }


def strike_yaw_deg(vehicle: VehicleParams) -> float:
    r"""Yaw, with the tip on the wall, at which the first propeller strikes it [deg]; 0 for one that does already.

    A disc with hub p, axis t and radius r reaches :math:`n \cdot p + r\sqrt{1 - (n \cdot t)^2}` along the wall's
    normal n, the tip :math:`n \cdot x`.
    """
    yaw = np.radians(np.concatenate((_YAWS_DEG, -_YAWS_DEG)))
    normals = np.column_stack((np.cos(yaw), np.sin(yaw), np.zeros(len(yaw))))
    hubs, axes = normals @ vehicle.geometry.positions.T, normals @ vehicle.geometry.axes.T
    reach = (hubs + vehicle.propeller_radius_m * np.sqrt(np.maximum(1.0 - axes**2, 0.0))).max(axis=1)
    struck = (reach >= normals @ np.array(vehicle.tip_position_m)).reshape(2, -1).any(axis=0)
    return float(_YAWS_DEG[int(np.argmax(struck))]) if struck.any() else float(_YAWS_DEG[-1])


def _within(low: float, high: float) -> tuple[float, float]:
    """The bounds, or a narrow pair in their middle where they cross."""
    middle = 0.5 * (low + high)
    return min(low, middle - 0.5 * _LEAST_VIEW), max(high, middle + 0.5 * _LEAST_VIEW)
