"""Figures of a slide along the edge under push: yaw, speed, height and force while friction holds the tip back."""

from __future__ import annotations

import math

import numpy as np

from sim.evaluate.measures.press import LIMITS, press_figures
from sim.evaluate.measures.reach import push_reach
from sim.evaluate.measures.window import board_tip, mean, peak, phase_window, rms, tilt_deg
from sim.evaluate.path_error import CONTACT_N
from sim.flight.trace import Trace

#: Sliding figures begin this long after the slide was asked for [s]: the speed ramp is over.
SLIDING_AFTER_S = 1.0
#: How a command begins to say that the asked push is beyond reach.
_REDUCED = "reference.push_force"


def slide_figures(trace: Trace) -> dict[str, float]:
    """Figures of the phase ``paint`` of a flight that slides, after those of the press before it.

    Args:
        trace: A flight with `sim.flight.jobs.PressJob` and a slide.

    Returns:
        Figures of `press_figures` under ``hold_*``, and of the slide under their plain names.
    """
    hold = {f"hold_{name}": value for name, value in press_figures(trace).items()}
    begin, end = phase_window(trace, "paint")
    whole = (trace.t >= begin) & (trace.t <= end)
    after = whole & (trace.t >= begin + SLIDING_AFTER_S)
    if not after.any():
        return hold
    tip, t = board_tip(trace), trace.t
    yaw, push = np.degrees(trace.euler[:, 2]), trace.push_true
    asked, wanted = trace.scene.paint.push_n, trace.scene.paint.speed_m_s
    last, first = np.flatnonzero(after)[[-1, 0]]
    speed = float((tip[first, 0] - tip[last, 0]) / (t[last] - t[first])) if last > first else math.nan
    height = tip[:, 1] - trace.scene.paint.edge_margin_m
    limits = (tuple(map(float, trace.arrays[name])) for name in LIMITS)
    reach = push_reach(trace.scene.vehicle.mass_kg, *limits, trace.scene.wall.friction)
    stuck = -np.gradient(tip[after, 0], t[after]) < 0.2 * wanted
    return hold | {
        "yaw_rms_deg": rms(yaw[after]),
        "yaw_peak_deg": peak(yaw[whole]),
        "tilt_rms_deg": rms(tilt_deg(trace)[after]),
        "tilt_peak_deg": peak(tilt_deg(trace)[whole]),
        "speed_m_s": speed,
        "speed_error_share": abs(speed - wanted) / wanted,
        "stuck_share": float(np.mean(stuck)),
        "path_rms_m": rms(height[after]),
        "push_mean_n": mean(push[after]),
        "push_commanded_n": mean(trace.push_reference[after]),
        "reduced_said": float(any(e.kind == "rejected" and e.text.startswith(_REDUCED) for e in trace.events)),
        "force_rms_n": rms(push[after] - trace.push_reference[after]),
        "force_error_rms_n": rms(push[after] - asked),
        "delivered_share": mean(push[after]) / asked,
        "reach_n": reach,
        "reach_share": mean(push[after]) / max(min(reach, asked), 1e-9),
        "force_std_n": float(np.std(push[after])),
        "height_error_peak_m": peak(height[after]),
        "contact_share": float(np.mean(push[after] > CONTACT_N)),
        "friction_mean_n": mean(np.linalg.norm(trace.friction_true[after], axis=1)),
        "limited_share": float(np.mean(trace.active[after].any(axis=1))) if trace.active.size else 0.0,
    }
