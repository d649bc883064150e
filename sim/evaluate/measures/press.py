"""Figures of a static press: how it touches, settles, holds, and what it keeps of height and attitude."""

from __future__ import annotations

import math

import numpy as np

from sim.evaluate.measures.reach import push_reach
from sim.evaluate.measures.window import (
    CONTACT_N,
    PHYSICS_RATE_HZ,
    board_tip,
    contact_clock,
    event_time,
    first_run,
    mean,
    peak,
    phase_window,
    rms,
    tilt_deg,
)
from sim.flight.trace import Trace

#: The push has settled when it stays this near to what was asked [N] for this long [s].
SETTLE_BAND_N, SETTLE_HOLD_S = 0.5, 0.5
#: Losses of contact count as bounces within this time after the first touch [s].
BOUNCE_WINDOW_S = 3.0
#: Steady figures begin this long after the touch, or after a fault [s]: ramp and transients are over.
STEADY_AFTER_S = 4.0
#: Arrays of the true limits.
LIMITS = ("true_thrust_min", "true_thrust_max")
#: A disturbed hold has recovered when push and path stay within these bands for `SETTLE_HOLD_S` [N, m].
RECOVERY_BAND_N, RECOVERY_BAND_M = 0.5, 0.005


def press_figures(trace: Trace) -> dict[str, float]:
    """Figures of the phase ``press`` of a flight with `sim.flight.jobs.PressJob`.

    Args:
        trace: The flight.

    Returns:
        Figures by name; NaN where the flight never came so far.
    """
    begin, end = phase_window(trace, "press")
    asked = trace.scene.paint.push_n
    clock, contact = contact_clock(trace), trace.contact_1khz
    window = (clock >= begin) & (clock <= end)
    clock, contact = clock[window], contact[window]
    touching = contact > CONTACT_N
    fault = event_time(trace, "fault")
    if not touching.any():
        return {"touched": 0.0, **_attitude(trace, begin, end)}
    first = int(np.argmax(touching))
    touch = float(clock[first])
    steady = clock >= (touch if math.isnan(fault) else fault) + STEADY_AFTER_S
    ticks = (trace.t >= clock[0] + 0.0) & (trace.t <= end)
    late = ticks & (trace.t >= (touch if math.isnan(fault) else fault) + STEADY_AFTER_S)
    push = contact[steady]
    commanded = mean(trace.push_reference[late])
    figures = {
        "touched": 1.0,
        **_touch(contact[first:], trace, touch),
        "force_peak_n": peak(contact),
        "contact_share": float(np.mean(touching[steady])) if steady.any() else math.nan,
        "push_mean_n": mean(push),
        "push_commanded_n": commanded,
        "force_error_rms_n": rms(push - asked),
        "force_rms_n": rms(push - commanded),
        "force_std_n": float(np.std(push)) if len(push) else math.nan,
        "delivered_share": mean(push) / asked,
        **_reach(trace, mean(push)),
        "approach_speed_m_s": _touch_speed(trace, touch),
        **_attitude(trace, touch, end),
        **_place(trace, touch, end, late),
        **_effort(trace, late),
    }
    return figures | (_recovery(trace, fault, end) if not math.isnan(fault) else {})


def _touch(contact: np.ndarray, trace: Trace, touch: float) -> dict[str, float]:
    """Settling and bounces; ``contact`` begins at the first touch."""
    window = contact[: round(BOUNCE_WINDOW_S * PHYSICS_RATE_HZ)] > CONTACT_N
    soon = (trace.t >= touch) & (trace.t <= touch + BOUNCE_WINDOW_S)
    target = float(np.max(trace.push_reference[soon], initial=0.0))
    start = first_run(np.abs(contact - target) <= SETTLE_BAND_N, round(SETTLE_HOLD_S * PHYSICS_RATE_HZ))
    return {
        "first_touch_s": touch,
        "settle_s": math.nan if start is None else start / PHYSICS_RATE_HZ,
        "bounces": float(np.count_nonzero(window[:-1] & ~window[1:])),
        "touch_peak_n": peak(contact[: round(BOUNCE_WINDOW_S * PHYSICS_RATE_HZ)]),
    }


def _reach(trace: Trace, push: float) -> dict[str, float]:
    """Push that the true limits allow at the end of the flight, and the delivered share of it or of what was asked."""
    reach = push_reach(trace.scene.vehicle.mass_kg, *(tuple(map(float, trace.arrays[name])) for name in LIMITS))
    return {"reach_n": reach, "reach_share": push / max(min(reach, trace.scene.paint.push_n), 1e-9)}


def _touch_speed(trace: Trace, touch: float) -> float:
    """Speed towards the wall just before the first touch [m/s]."""
    before = np.flatnonzero((trace.t < touch) & (trace.t > touch - 0.05))
    if len(before) < 2:
        return math.nan
    first, last = before[0], before[-1]
    return float((trace.tip[last, 0] - trace.tip[first, 0]) / (trace.t[last] - trace.t[first]))


def _attitude(trace: Trace, begin: float, end: float) -> dict[str, float]:
    inside = (trace.t >= begin) & (trace.t <= end)
    tilt, yaw = tilt_deg(trace)[inside], np.degrees(trace.euler[inside, 2])
    return {
        "tilt_rms_deg": rms(tilt),
        "tilt_peak_deg": peak(tilt),
        "yaw_rms_deg": rms(yaw),
        "yaw_peak_deg": peak(yaw),
    }


def _place(trace: Trace, touch: float, end: float, late: np.ndarray) -> dict[str, float]:
    """Height over the guide's target, and how far the tip moved along the board after the touch."""
    tip = board_tip(trace)
    inside = (trace.t >= touch) & (trace.t <= end)
    height = tip[:, 1] - trace.scene.paint.edge_margin_m
    along = tip[inside, 0] - tip[inside, 0][0] if inside.any() else np.array([])
    return {
        "height_error_rms_m": rms(height[inside]),
        "height_error_peak_m": peak(height[inside]),
        "height_error_steady_m": mean(height[late]),
        "slip_peak_m": peak(along),
        "path_rms_m": rms(np.hypot(height[inside], along)),
    }


def _effort(trace: Trace, late: np.ndarray) -> dict[str, float]:
    """What the rotors did in the steady part: wrench in the body, share of ticks with a limit active."""
    from allocation import TAROT_T960, control_effectiveness

    wrench = trace.thrusts_actual[late] @ control_effectiveness(TAROT_T960).T
    names = ("thrust_front_n", "thrust_right_n", "thrust_down_n")
    figures = {name: mean(wrench[:, axis]) if late.any() else math.nan for axis, name in enumerate(names)}
    active = trace.active[late]
    return figures | {"limited_share": float(np.mean(active.any(axis=1))) if late.any() and active.size else 0.0}


def _recovery(trace: Trace, fault: float, end: float) -> dict[str, float]:
    """Greatest deviation after a fault, and when push and place are back within their bands for good."""
    inside = (trace.t >= fault) & (trace.t <= end)
    if not inside.any():
        return {}
    t, tip = trace.t[inside], board_tip(trace)[inside]
    start = np.flatnonzero(inside)[0]
    off = np.linalg.norm(tip - board_tip(trace)[start], axis=1)
    error = np.abs(trace.push_true[inside] - trace.push_reference[inside])
    outside = np.flatnonzero((error > RECOVERY_BAND_N) | (off > RECOVERY_BAND_M))
    back = 0.0 if not len(outside) else math.inf if outside[-1] == len(t) - 1 else float(t[outside[-1] + 1] - fault)
    return {
        "recovery_s": back if math.isfinite(back) else math.nan,
        "fault_force_peak_n": peak(error),
        "fault_path_peak_m": peak(off),
    }
