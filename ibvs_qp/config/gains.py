"""Feedback gains, the same object for both laws."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ibvs_qp.config.derived import Derived
from ibvs_qp.config.settings import setting, validate


def _gain(default: float, doc: str, *, unit: str = "", high: float) -> Any:
    """Setting of a gain; one that is not stated is that of the law, scaled to the vehicle (`scaled_gains`)."""
    return setting(Derived(default), doc, unit=unit, low=0.0, high=high)


def _lead(of: str, default: float) -> Any:
    """Setting of a lead against the motors' lag; 0 is none."""
    return _gain(default, f"lead of the {of}: this far ahead by the modelled acceleration", unit="s", high=0.5)


#: Longest filter of a row [s]. An approach is unstable with 0.5 s. With 0.1 s it has M_s 2.2, but level flight 32 and
#: lines 11; with the shipped filters 1.7 at most (`ibvs_qp.config.motion_margin`).
LONGEST_FILTER = 0.1


def _filter(rows: str, default: float) -> Any:
    """Setting of a row filter; 0 is none."""
    return _gain(default, f"filter of the {rows} towards the last achieved command", unit="s", high=LONGEST_FILTER)


@dataclass(frozen=True, kw_only=True)
class Gains:
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
    body_rotation_gain: float = _gain(
        0.4796, "fraction of the body's rotation in line rows while the tip travels", high=1.0
    )
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

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
