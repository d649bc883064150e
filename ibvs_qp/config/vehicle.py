"""Physical parameters of the vehicle: one object feeds the controller's model, the limits and the simulated plant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allocation import TAROT_T960, RotorGeometry
from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.config.settings import Checked, require_order, setting

#: Rounding of the largest moment of inertia against the sum of the others [-]: equal for a flat body.
INERTIA_TOLERANCE = 1e-9
#: Shortest focal length [px].
SHORTEST_PX = 1.0
#: Yaw angles at which the clearance of the propellers is computed [deg].
_YAWS_DEG = np.linspace(0.0, 60.0, 1201)

Vector = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class VehicleParams(Checked):
    """The tilted hexarotor with its arm, tool, force/torque sensor and camera (positions FRD from the centre of mass).

    Nominal values: the Tarot T960 of the paper, with the arm and tool assumed here.
    """

    geometry: RotorGeometry = TAROT_T960
    mass_kg: float = setting(6.0, "all-up mass, tool included", "kg", 0.5, 50.0)
    inertia_kg_m2: Vector = setting(
        (0.22, 0.30, 0.48), "inertia xx, yy, zz about the centre of mass", "kg m^2", 1e-3, 50.0
    )
    inertia_products_kg_m2: Vector = setting((0.0, 0.0, 0.0), "entries xy, xz, yz", "kg m^2", -25.0, 25.0)
    thrust_min_n: float | tuple[float, ...] = setting(
        1.2, "idle thrust of a rotor", "N", 0.0, 200.0, why="15 % of full speed: stopped propellers start late"
    )
    thrust_max_n: float | tuple[float, ...] = setting(
        52.56, "full thrust of a rotor", "N", 0.0, 200.0, why="KDE 4215XF, 15 inch propeller, as published"
    )
    thrust_rate_n_s: float = setting(
        500.0, "fastest commanded thrust change", "N/s", 1.0, 1e5, why="2 N a tick: faster than the motors, no jumps"
    )
    motor_lag_up_s: float = setting(0.045, "first-order lag of rising thrust", "s", 1e-3, 0.5)
    motor_lag_down_s: float = setting(0.070, "first-order lag of falling thrust", "s", 1e-3, 0.5)
    propeller_radius_m: float = setting(0.19, "propeller disc (15 inch)", "m", 0.01, 1.0)
    linear_drag_n_s_m: float = setting(0.9, "drag per airspeed", "N s/m", 0.0, 20.0)
    tip_position_m: Vector = setting((0.70, 0.0, 0.0), "brush tip", "m", -3.0, 3.0)
    force_torque_position_m: Vector = setting((0.25, 0.0, 0.0), "force/torque sensor", "m", -3.0, 3.0)
    force_torque_turn_deg: Vector = setting((0.0, 0.0, 0.0), "its turn, rotation vector in B", "deg", -180.0, 180.0)
    tool_mass_kg: float = setting(0.35, "mass beyond the force/torque sensor", "kg", 0.0, 5.0)
    tool_position_m: Vector = setting((0.50, 0.0, 0.0), "centre of mass of the tool", "m", -3.0, 3.0)
    arm_radius_m: float = setting(0.015, "radius of the arm", "m", 0.001, 0.2)
    camera_position_m: Vector = setting((0.20, 0.0, 0.08), "camera centre", "m", -3.0, 3.0)
    camera_turn_deg: Vector = setting((0.0, 0.0, 0.0), "its turn from +x, rotation vector in B", "deg", -180.0, 180.0)
    camera_size_px: tuple[int, int] = setting((640, 480), "width and height of the image", "px", 32, 8192)
    camera_intrinsics_px: tuple[float, float, float, float] = setting(
        (625.22, 625.22, 319.5, 239.5), "fx, fy, cx, cy; pixel centres at integers", "px", -1e5, 1e5
    )

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        super().__post_init__()
        require_order(self, "tool_mass_kg", "mass_kg", "the tool is part of the vehicle")
        if min(self.camera_intrinsics_px[:2]) < SHORTEST_PX:
            allowed = f"focal lengths must be at least {SHORTEST_PX:g} px"
            raise out_of_range("camera_intrinsics_px", self.camera_intrinsics_px, "px", allowed)
        for field in ("thrust_min_n", "thrust_max_n"):
            value = getattr(self, field)
            if isinstance(value, tuple) and len(value) != self.geometry.count:
                raise out_of_range(field, value, "N", f"one number or {self.geometry.count} (one per rotor)")
        xx, yy, zz = np.linalg.eigvalsh(self.inertia).tolist()  # in ascending order
        if not 0.0 < xx <= yy <= zz <= xx + yy + INERTIA_TOLERANCE * zz:
            products = f"{self.inertia_kg_m2} kg m^2 with the products {self.inertia_products_kg_m2}"
            raise ConfigError(f"inertia_kg_m2 = {products} is refused: no rigid body has such an inertia")
        if np.any(self.thrust_min >= self.thrust_max):
            raise out_of_range("thrust_min_n", self.thrust_min_n, "N", "must lie below thrust_max_n on every rotor")

    @property
    def thrust_min(self) -> np.ndarray:
        """Lower thrust limits [N], (n,)."""
        return np.broadcast_to(np.asarray(self.thrust_min_n, float), (self.geometry.count,)).copy()

    @property
    def thrust_max(self) -> np.ndarray:
        """Upper thrust limits [N], (n,)."""
        return np.broadcast_to(np.asarray(self.thrust_max_n, float), (self.geometry.count,)).copy()

    @property
    def motor_lag_s(self) -> float:
        """Mean lag of rising and falling thrust [s]."""
        return 0.5 * (self.motor_lag_up_s + self.motor_lag_down_s)

    @property
    def inertia(self) -> np.ndarray:
        """Inertia J about the centre of mass, in B [kg m^2], (3, 3)."""
        xy, xz, yz = self.inertia_products_kg_m2
        return np.diag(self.inertia_kg_m2) + np.array([[0.0, xy, xz], [xy, 0.0, yz], [xz, yz, 0.0]])

    @property
    def mass_matrix(self) -> np.ndarray:
        """Rigid-body mass matrix diag(m I, J), (6, 6)."""
        matrix = self.mass_kg * np.eye(6)
        matrix[3:, 3:] = self.inertia
        return matrix

    @property
    def contact_depth_m(self) -> float:
        """Camera to wall in contact, of a level vehicle square to the wall [m]."""
        return self.tip_position_m[0] - self.camera_position_m[0]

    @property
    def strike_yaw_deg(self) -> float:
        r"""Yaw, with the tip on the wall, at which the first propeller strikes it [deg]; 0 if one does at no yaw.

        A disc with hub p, axis t and radius r reaches :math:`n \cdot p + r\sqrt{1 - (n \cdot t)^2}` along the wall's
        normal n, the tip :math:`n \cdot x`.
        """
        yaw = np.radians(np.concatenate((_YAWS_DEG, -_YAWS_DEG)))
        normals = np.column_stack((np.cos(yaw), np.sin(yaw), np.zeros(len(yaw))))
        hubs, axes = normals @ self.geometry.positions.T, normals @ self.geometry.axes.T
        reach = (hubs + self.propeller_radius_m * np.sqrt(np.maximum(1.0 - axes**2, 0.0))).max(axis=1)
        struck = (reach >= normals @ np.array(self.tip_position_m)).reshape(2, -1).any(axis=0)
        return float(_YAWS_DEG[int(np.argmax(struck))]) if struck.any() else float(_YAWS_DEG[-1])
