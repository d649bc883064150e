"""Rotor terms of a tick: the thrust window, and where the last step would lead."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.limits.thrust import thrust_window
from ibvs_qp.model.signals import Signals


def rotor_terms(signals: Signals, count: int) -> None:
    """Last thrusts, the step repeated, and box and rate limit of this tick [N], (n,) each."""
    last, change = signals.input("thrust_last", count), signals.input("thrust_change", count)
    bounds = (signals.input(f"thrust_{name}", count) for name in ("low", "high", "floor", "ceiling"))
    low, high, floor, ceiling = bounds
    lower, upper = thrust_window(last, low, high, signals.input("thrust_step"), floor, ceiling)
    signals.output("last_thrust", last)
    signals.output("thrust_lower", lower)
    signals.output("thrust_upper", upper)
    signals.output("extrapolated_thrust", ca.fmin(ca.fmax(last + change, lower), upper))
