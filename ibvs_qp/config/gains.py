"""Gains of both laws, their scaling to a vehicle, and weights of the program's tasks.

``python -m sim.report.catalogue`` writes out the weights next to their tasks (docs/tasks_and_limits.md).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from ibvs_qp.config.settings import Checked, Derived, setting
from ibvs_qp.config.vehicle import VehicleParams

#: Control laws with tuned gains.
LAWS = ("qp", "paper")
#: Vehicle that both laws were tuned for.
_TUNED_FOR = VehicleParams()
#: Gains of the analytic law that differ, as in its preset; those of the program are the defaults of `Gains`.
_PAPER = {"theta_kp": 7.65, "theta_kd": 13.59, "body_rotation_gain": 0.3843}
#: Power of seconds in the denominator of a unit: slower motors reduce gains of that unit by it.
_PER_SECOND = {"1/s": 1, "1/s^2": 2, "1/s^3": 3, "N s/m": 1, "N/m": 2}
#: Longest filter of a row [s]. An approach is unstable with 0.5 s. With 0.1 s it has M_s 2.2, but level flight 32 and
#: lines 11; with the shipped filters 1.7 at most (`ibvs_qp.model.motion_margin`).
LONGEST_FILTER = 0.1


def _gain(default: float, doc: str, *, unit: str = "", high: float) -> Any:
    """Setting of a gain; one that is not stated is that of the law, scaled to the vehicle (`scaled_gains`)."""
    return setting(Derived(default), doc, unit, 0.0, high)


def _lead(of: str, default: float) -> Any:
    """Setting of a lead against the motors' lag; 0 switches it off."""
    return _gain(default, f"lead of the {of}: this far ahead by the modelled acceleration", unit="s", high=0.5)


def _filter(rows: str, default: float) -> Any:
    """Setting of a row filter; 0 switches it off."""
    return _gain(default, f"filter of the {rows} towards the last achieved command", unit="s", high=LONGEST_FILTER)


@dataclass(frozen=True, kw_only=True)
class Gains(Checked):
    """Feedback gains, the same object for both laws.

    Leads and filters are those of rows with the rotors in them (`ibvs_qp.model.model.Model.filtered`).
    """

    line_kp: float = _gain(200.0, "line error to image acceleration", unit="1/s^2", high=1000.0)
    line_kd: float = _gain(34.0, "line error rate", unit="1/s", high=100.0)
    line_ki: float = _gain(1.148, "integral of the line error", unit="1/s^3", high=100.0)
    line_lead_s: float = _lead("line error rate", 0.045)
    line_filter_s: float = _filter("line rows", 0.0078)
    theta_kp: float = _gain(33.34, "line angle error", unit="1/s^2", high=400.0)
    theta_kd: float = _gain(9.223, "line angle rate", unit="1/s", high=100.0)
    body_rotation_gain: float = _gain(0.4796, "fraction of body rotation in line rows during travel", high=1.0)
    velocity_kp: float = _gain(5.0, "velocity error along free directions", unit="1/s", high=50.0)
    velocity_ki: float = _gain(2.804, "integral of that error", unit="1/s^2", high=50.0)
    velocity_lead_s: float = _lead("velocity error", 0.055)
    velocity_filter_s: float = _filter("velocity rows", 0.0112)
    attitude_kp: float = _gain(300.0, "roll and pitch", unit="1/s^2", high=400.0)
    attitude_kd: float = _gain(50.0, "roll and pitch rate", unit="1/s", high=100.0)
    attitude_filter_s: float = _filter("level rows", 0.0058)
    yaw_kp: float = _gain(150.0, "yaw to the wall normal", unit="1/s^2", high=400.0)
    yaw_kd: float = _gain(32.0, "yaw rate", unit="1/s", high=100.0)
    yaw_filter_s: float = _filter("yaw row", 0.0058)
    standoff_kp: float = _gain(2.0, "distance error to approach speed", unit="1/s", high=20.0)
    standoff_kd: float = _gain(5.0, "approach speed error to acceleration", unit="1/s", high=50.0)
    force_ksp: float = _gain(78.0, "impedance stiffness K_sp", unit="N/m", high=5000.0)
    force_ksd: float = _gain(63.0, "impedance damping K_sd", unit="N s/m", high=1000.0)
    force_kfp: float = _gain(0.02, "force error K_fp, up to contact.full_gain_stiffness_n_m", high=10.0)
    force_kfi: float = _gain(0.0, "integral of the force error K_fi", unit="1/s", high=50.0)
    push_lead_s: float = _lead("rate of penetration or distance, in impedance and approach", 0.0575)
    push_filter_s: float = _filter("push and stand-off rows", 0.0135)


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


def _weight(default: float, rows: str, unit: str, why: str) -> Any:
    """Setting of a weight per squared unit of its rows, so that the cost has no unit."""
    return setting(default, rows, unit, 0.0, 1e6, why=why)


@dataclass(frozen=True, kw_only=True)
class Weights(Checked):
    """Weights of the least-squares tasks, each the inverse square of an acceptable error in its unit."""

    line: float = _weight(100.0, "line rows", "s^4", "0.1 image units/s^2: 5 cm/s^2 half a metre from the wall")
    line_angle: float = _weight(
        0.05, "angle rows of the lines", "s^4/rad^2", "four orders below level: a sloped edge must not tilt"
    )
    push: float = _weight(
        0.5, "push row; with 1 - lambda the stand-off row", "1/N^2", "1.4 N: an unreachable push yields first"
    )
    level: float = _weight(
        400.0, "roll and pitch rows", "s^4/rad^2", "0.05 rad/s^2: 3.5 cm/s^2 at the tip, below the lines"
    )
    yaw: float = _weight(400.0, "yaw row", "s^4/rad^2", "as roll and pitch; with 60 weak rotors end on the ground")
    velocity: float = _weight(
        100.0, "free velocity rows", "s^4/m^2", "0.1 m/s^2, as the lines: yields before height and level"
    )
    height: float = _weight(1.6e3, "height row", "s^4/m^2", "0.025 m/s^2 = 0.15 N: an unreachable push must not lift")
    margin: float = _weight(
        0.01, "redundant thrusts, of more than six rotors", "1/N^2", "10 N: above effort, below every task"
    )
    effort: float = setting(
        1e-3, "thrust away from the last one", "1/N^2", 1e-9, 1e3, why="30 N: with smoothness 0.004 N rms of push"
    )
    smoothness: float = setting(1e-3, "change of the thrust step", "1/N^2", 0.0, 1e3, why="30 N, as the effort row")
    line_sigma: float = setting(2e-2, "line deviation at which a row's weight halves", low=1e-6, high=1.0)
