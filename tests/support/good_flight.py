"""Figures of a flight with a fault that breaks no criterion."""

from __future__ import annotations

from typing import Any

from ibvs_qp.config.vehicle import VehicleParams

VEHICLE = VehicleParams()
GOOD: dict[str, Any] = {
    "struck": 1.0,
    "bad_thrusts": 0.0,
    "box_excess_n": 0.0,
    "rate_peak_n_s": 500.0,
    "crashed": 0.0,
    "tilt_peak_deg": 3.0,
    "tilt_contact_deg": 2.0,
    "push_peak_n": 6.0,
    "speed_peak_m_s": 0.3,
    "touching_s": 0.5,
    "advance_m": 0.01,
    "state_before": 0.0,
    "state": 2.0,
    "to_degraded_s": 0.2,
    "to_retreat_s": 0.3,
    "unexplained": 0.0,
}
