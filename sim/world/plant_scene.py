"""The section ``[plant]`` of a scene: differences of the true vehicle from the nominal one of the controller."""

from __future__ import annotations

from dataclasses import dataclass

from allocation import RotorGeometry
from ibvs_qp.config.settings import setting, validate

Vector = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class PlantScene:
    """The true vehicle; no input of the controller. A missing key has the nominal value.

    Positions FRD from the assumed centre of mass. ``geometry`` has the keys of a preset's vehicle: the true rotors, as
    many as the nominal ones, on a circle or each with a position, an axis and a torque ratio of its own.
    """

    geometry: RotorGeometry | None = None
    mass_kg: float | None = setting(None, "all-up mass, tool included", unit="kg", low=2.0, high=20.0)
    com_offset_m: Vector = setting(
        (0.0, 0.0, 0.0), "true centre of mass from the assumed one, FRD", unit="m", low=-0.1, high=0.1
    )
    inertia_kg_m2: Vector | None = setting(
        None, "moments xx, yy, zz of the inertia about the true centre of mass", unit="kg m^2", low=0.01, high=10.0
    )
    inertia_products_kg_m2: Vector | None = setting(
        None, "entries xy, xz, yz of the same inertia matrix", unit="kg m^2", low=-5.0, high=5.0
    )
    thrust_gain: float | tuple[float, ...] = setting(
        1.0, "true over commanded thrust, one number or one per rotor", low=0.3, high=2.0
    )
    thrust_min_n: float | tuple[float, ...] | None = setting(
        None, "true idle thrust, one number or one per rotor", unit="N", low=0.0, high=100.0
    )
    thrust_max_n: float | tuple[float, ...] | None = setting(
        None, "true full thrust, one number or one per rotor", unit="N", low=0.0, high=100.0
    )
    motor_lag_up_s: float | None = setting(None, "lag of rising thrust", unit="s", low=0.001, high=0.5)
    motor_lag_down_s: float | None = setting(None, "lag of falling thrust", unit="s", low=0.001, high=0.5)
    linear_drag_n_s_m: float | None = setting(None, "drag per airspeed", unit="N s/m", low=0.0, high=20.0)
    tip_position_m: Vector | None = setting(None, "brush tip", unit="m", low=-3.0, high=3.0)
    tool_mass_kg: float | None = setting(None, "mass beyond the force/torque sensor", unit="kg", low=0.0, high=5.0)
    tool_position_m: Vector | None = setting(None, "centre of mass of the tool", unit="m", low=-3.0, high=3.0)
    force_torque_position_m: Vector | None = setting(None, "force/torque sensor", unit="m", low=-3.0, high=3.0)
    force_torque_turn_deg: Vector | None = setting(
        None, "turn of the force/torque sensor, rotation vector FRD", unit="deg", low=-180.0, high=180.0
    )
    camera_position_m: Vector | None = setting(None, "camera centre", unit="m", low=-3.0, high=3.0)
    camera_turn_deg: Vector | None = setting(
        None, "turn of the camera from looking along +x, rotation vector FRD", unit="deg", low=-180.0, high=180.0
    )
    focal_ratio: float = setting(1.0, "reported over true focal length; needs pictures", low=0.8, high=1.2)

    def __post_init__(self) -> None:
        """Validate every field."""
        validate(self)
