"""Gains of a law for a vehicle that none were tuned for."""

from __future__ import annotations

import dataclasses

from ibvs_qp.config.gains import Gains
from ibvs_qp.config.vehicle import VehicleParams

#: Control laws with tuned gains.
LAWS = ("qp", "paper")
#: Vehicle that both laws were tuned for.
_TUNED_FOR = VehicleParams()
#: Gains of the analytic law that differ, as in its preset; those of the program are the defaults of `Gains`.
_PAPER = {
    "theta_kp": 7.65,
    "theta_kd": 13.59,
    "body_rotation_gain": 0.3843,
}
#: Seconds in the denominator of a unit: what a gain of that unit takes from slower motors.
_PER_SECOND = {"1/s": 1, "1/s^2": 2, "1/s^3": 3, "N s/m": 1, "N/m": 2}


def gain_factors(vehicle: VehicleParams) -> tuple[float, float]:
    """Factors of the impedance by the mass, and of every gain per second by the lag of the motors [-]."""
    pace = min(1.0, _TUNED_FOR.motor_lag_s / vehicle.motor_lag_s)
    return vehicle.mass_kg / _TUNED_FOR.mass_kg, pace


def scaled_gains(vehicle: VehicleParams, law: str = "qp") -> dict[str, float]:
    r"""Tuned gains of a law, scaled to another vehicle.

    All but the impedance act on accelerations, so that mass and inertia are accounted for. The impedance is a force:
    for the same :math:`\ddot e + (K_{sd}/m)\dot e + (K_{sp}/m) e` it grows with the mass. Motors that lag longer by a
    factor slow every loop by it: in units of the lag, poles and damping remain. Faster motors change no gain. Leads and
    filters are against the lag, and follow it.

    Args:
        vehicle: Mass and lag of the motors.
        law: "qp" or "paper".
    """
    mass, pace = gain_factors(vehicle)
    scaled: dict[str, float] = {}
    for field in dataclasses.fields(Gains):
        tuned: float = field.default  # type: ignore[assignment]
        gain = _PAPER.get(field.name, tuned) if law == "paper" else tuned
        unit = field.metadata["unit"]
        factor = pace ** _PER_SECOND.get(unit, 0) * (mass if unit.startswith("N") else 1.0)
        if unit == "s":
            factor = vehicle.motor_lag_s / _TUNED_FOR.motor_lag_s
        scaled[field.name] = min(max(factor * gain, field.metadata["low"]), field.metadata["high"])
    return scaled
