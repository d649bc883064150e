"""Figures of a flight that loses a rotor: survival, retreat from the wall, descent."""

from __future__ import annotations

import math

import numpy as np

from sim.evaluate.window import CONTACT_N, contact_clock, event_time, peak, tilt_deg
from sim.flight.trace import Trace
from sim.world.board import BoardGeometry

#: The vehicle counts as detached when its tip is this far from the board at the end [m].
DETACHED_M = 0.10


def loss_figures(trace: Trace) -> dict[str, float]:
    """Figures from the loss to the end of the flight.

    Returns:
        ``survived_s``: from the loss to the crash, the landing or the planned end. ``yaw_turned_deg``: largest turn
        from the heading at the loss, full turns included. ``push_spike_n``: largest push after the loss. Empty without
        a fault.
    """
    fault = event_time(trace, "fault")
    after = trace.t >= fault if not math.isnan(fault) else np.zeros(len(trace.t), bool)
    if not after.any():
        return {}
    down = _rate(trace.position[after] @ BoardGeometry(trace.scene).down, trace.t[after])
    touching = trace.push_true[after] > CONTACT_N
    return {
        "survived_s": float(trace.t[-1] - fault),
        "tilt_peak_deg": peak(tilt_deg(trace)[after]),
        "yaw_turned_deg": peak(np.degrees(np.unwrap(trace.euler[after, 2]) - trace.euler[after, 2][0])),
        "yaw_rate_peak_deg_s": peak(np.degrees(_rate(np.unwrap(trace.euler[after, 2]), trace.t[after]))),
        "push_spike_n": peak(trace.contact_1khz[contact_clock(trace) >= fault]),
        "descent_peak_m_s": float(np.max(down)),
        "detached": float(-trace.tip[-1, 0] > DETACHED_M and not touching[-1]),
        "contact_after_s": float(np.count_nonzero(touching)) * float(np.median(np.diff(trace.t))),
        "clearance_min_m": float(np.min(trace.propeller_clearance[after])),
    }


def _rate(values: np.ndarray, t: np.ndarray) -> np.ndarray:
    return np.gradient(values, t) if len(t) > 1 else np.zeros(1)
