"""Bounds, slack weights and switches of the limits: unit, range and reason of every number."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ibvs_qp.config.field_of_view import field_of_view
from ibvs_qp.config.settings import Checked, require_order, setting
from ibvs_qp.config.vehicle import VehicleParams

#: Yaw bound per yaw at which a propeller strikes the wall [-], and its range [deg]: at least the lower end of
#: `yaw_deg`, at most where the errors of the lines are exact.
_OF_STRIKE, _LEAST_YAW_DEG, _MOST_YAW_DEG = 0.5, 0.5, 10.0
#: Least room for a guide between two bounds of the view [-]: of a camera that looks past the wall, which is refused
#: elsewhere.
_LEAST_VIEW = 0.02


def _slack_weight(default: float, name: str, unit: str, why: str) -> Any:
    """Setting of a slack weight per squared unit of its rows."""
    return setting(default, f"slack weight of {name}", unit, 1e-3, 1e8, why=why)


def _poles(default: float, name: str, why: str) -> Any:
    """Setting of the pole of a barrier: how fast its bound may be approached."""
    return setting(default, f"poles of {name}", "1/s", 0.1, 100.0, why=why)


def _view_bound(meaning: str, border: str) -> Any:
    """Setting of one bound of the view barriers; from the camera if not stated."""
    why = f"the image's {border} border and view_margin; default from the camera"
    return setting(None, meaning, low=-10, high=10, why=why)


@dataclass(frozen=True, kw_only=True)
class LimitSettings(Checked):
    """Bounds of the soft limits, weights of their slack per squared unit, and switches.

    The program exceeds a bound by the fraction weight / (weight + slack weight) of the demand beyond it, so compare a
    slack weight with the weights of the rows that pull against it (`tests/ibvs_qp/limits/test_barriers.py`).
    """

    tilt_deg: float = setting(
        1.0, "bound on roll and pitch", "deg", 0.05, 45.0, why="a job allows 2 deg; calm air takes 0.12 deg rms"
    )
    trim_deg: float = setting(
        0.0,
        "roll and pitch that a push above 85 % of the level reach may take",
        unit="deg",
        why="a permission of the mission: 2 deg add 1.0 N at rest and 2.0 N sliding sideways at a friction of 0.8",
        low=0.0,
        high=10.0,
    )
    thrust_noise_n: float = setting(
        0.5,
        "excess of a thrust over its limits in contact that is clipped as noise; fades out at 5 times this",
        unit="N",
        why="twice the noise of a thrust in calm air; at the reach 1 N of a rear thrust is 3 N of push",
        low=0.0,
        high=10.0,
    )
    tilt_slack_weight: float = _slack_weight(4000.0, "the tilt barriers", "s^4/rad^2", "ten times the level rows")
    tilt_rate_1_s: float = _poles(
        12.0, "the tilt barriers", "below the level loop's 17 1/s, whose braking they must not limit"
    )
    yaw_deg: float = setting(
        None,
        "yaw bound; default from propellers and tip",
        unit="deg",
        why="half of the yaw at which a propeller strikes (Tarot T960: 19 deg), at most 10 deg",
        low=0.5,
        high=45.0,
    )
    yaw_slack_weight: float = _slack_weight(
        1000.0, "the yaw barrier", "s^4/rad^2", "above every row that turns the vehicle"
    )
    yaw_rate_1_s: float = _poles(5.0, "the yaw barrier", "a third of the motors' 17 1/s; 20 1/s brake too late")
    view_margin: float = setting(
        0.033,
        "least distance of a guide from the image border over the image width",
        why="perception needs 14 of 640 px on each side of a line, and the soft barrier yields by half as much",
        low=0.0,
        high=0.4,
    )
    view_up: float = _view_bound("least rho of a level guide, its normal down", "upper")
    view_down: float = _view_bound("largest rho of a level guide, its normal down", "lower")
    view_left: float = _view_bound("least rho of an upright guide, its normal to the right", "left")
    view_right: float = _view_bound("largest rho of an upright guide, its normal to the right", "right")
    view_slack_weight: float = _slack_weight(
        4e4, "the line-in-view barriers", "s^4", "400 times the line rows; a thirtieth loses guides"
    )
    view_rate_1_s: float = _poles(
        10.0, "the line-in-view barriers", "as the line loop: slower ones limit its corrections"
    )
    push_ceiling_ratio: float = setting(
        1.5, "push ceiling over the reference", why="three times the error in gusts of 2 N rms", low=1.0, high=100.0
    )
    push_quiet_m_s: float = setting(
        0.005, "closing speed that the push ceiling ignores", "m/s", 0.0, 1.0, why="noise: 2.4 N at 10 kN/m"
    )
    push_slack_weight: float = _slack_weight(40.0, "the push ceiling", "1/N^2", "80 times the push row")
    approach_speed_ratio: float = setting(
        1.5, "largest closing over approach speed", why="active in 5 % of an approach; 1.0: 82 %", low=1.0, high=100.0
    )
    approach_rate_1_s: float = _poles(
        10.0, "the approach-speed barrier", "stops 0.3 m/s within 0.12 m; with 5 the tip strikes"
    )
    approach_slack_weight: float = _slack_weight(
        4000.0, "the approach-speed barrier", "s^4/m^2", "220 times the stand-off row"
    )
    tilt_barrier: bool = setting(True, "zero-tilt barriers on roll and pitch")
    yaw_barrier: bool = setting(True, "yaw barrier")
    view_barrier: bool = setting(True, "line-in-view barriers")
    view_rotation: bool = setting(False, "line-in-view barriers turn the vehicle too, which moves the tip")
    push_barrier: bool = setting(True, "push-force ceiling")
    approach_barrier: bool = setting(True, "approach-speed barrier")
    hard_barriers: bool = setting(
        False, "no slack on any barrier; the conflicting rows of an infeasible program are named"
    )

    def __post_init__(self) -> None:
        """Validate; the bounds of the view in their order."""
        super().__post_init__()
        require_order(self, "view_up", "view_down", "a level guide has its place between them")
        require_order(self, "view_left", "view_right", "an upright guide has its place between them")


def limit_values(vehicle: VehicleParams, view_margin: float) -> dict[str, float]:
    """Settings of `LimitSettings` that follow from propellers, tip and camera, at a `view_margin`."""
    yaw = _OF_STRIKE * math.floor(vehicle.strike_yaw_deg)
    margin = view_margin * vehicle.camera_size_px[0] / vehicle.camera_intrinsics_px[0]
    view = field_of_view(vehicle)
    left, right = _within(view.left + margin, view.right - margin)
    up, down = _within(view.up + margin, view.down - margin)
    bounds = {"view_left": left, "view_right": right, "view_up": up, "view_down": down}
    return {"yaw_deg": min(max(yaw, _LEAST_YAW_DEG), _MOST_YAW_DEG)} | bounds


def _within(low: float, high: float) -> tuple[float, float]:
    """The bounds, or a narrow pair in their middle where they cross."""
    middle = 0.5 * (low + high)
    return min(low, middle - 0.5 * _LEAST_VIEW), max(high, middle + 0.5 * _LEAST_VIEW)
