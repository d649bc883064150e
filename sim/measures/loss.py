"""Figures of a flight that loses a rotor: does it live, does it leave the wall, how does it come down."""

from __future__ import annotations

import math

import numpy as np

from sim.measures.window import CONTACT_N, event_time, peak, tilt_deg
from sim.trace import Trace

#: The vehicle counts as detached when its tip is this far from the board at the end [m].
DETACHED_M = 0.10


def loss_figures(trace: Trace) -> dict[str, float]:
    """Figures from the loss to the end of the flight.

    Args:
        trace: A flight with a lost rotor.

    Returns:
        ``survived_s`` counts from the loss to the crash or the planned end; empty if the fault never came.
    """
    fault = event_time(trace, "fault")
    after = trace.t >= fault if not math.isnan(fault) else np.zeros(len(trace.t), bool)
    if not after.any():
        return {}
    down = np.gradient(trace.position[after, 2], trace.t[after]) if np.count_nonzero(after) > 1 else np.zeros(1)
    touching = trace.push_true[after] > CONTACT_N
    return {
        "survived_s": float(trace.t[-1] - fault),
        "tilt_peak_deg": peak(tilt_deg(trace)[after]),
        "yaw_peak_deg": peak(np.degrees(trace.euler[after, 2])),
        "descent_peak_m_s": float(np.max(down)),
        "detached": float(-trace.tip[-1, 0] > DETACHED_M and not touching[-1]),
        "contact_after_s": float(np.count_nonzero(touching)) * float(np.median(np.diff(trace.t))),
        "clearance_min_m": float(np.min(trace.propeller_clearance[after])),
    }
