"""Time windows of a trace, statistics over them, and the figures that several kinds of flight share."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ibvs_qp.quaternion import multiply
from sim.flight.trace import Trace
from sim.world.board import BoardGeometry

#: Rate of the contact arrays [Hz] and normal force above which brush and board count as touching [N].
PHYSICS_RATE_HZ, CONTACT_N = 1000.0, 0.05
#: The push has settled when it stays this near to the commanded push [N] for this long [s].
SETTLE_BAND_N, SETTLE_HOLD_S = 0.5, 0.5
#: The vehicle finds its hover within this time after release [s].
SETTLED_S = 1.0
#: Losses of contact count as bounces, and the push to settle at is read, within this time after first touch [s].
BOUNCE_WINDOW_S = 3.0


def _of_finite(values: np.ndarray, statistic: Callable[[np.ndarray], np.floating]) -> float:
    good = values[np.isfinite(values)]
    return float(statistic(good)) if len(good) else math.nan


def rms(values: np.ndarray) -> float:
    """Root mean square of the finite values; NaN if there are none."""
    return _of_finite(values, lambda good: np.sqrt(np.mean(good**2)))


def mean(values: np.ndarray) -> float:
    """Mean of the finite values; NaN if there are none."""
    return _of_finite(values, np.mean)


def peak(values: np.ndarray) -> float:
    """Largest magnitude of the finite values; NaN if there are none."""
    return _of_finite(values, lambda good: np.max(np.abs(good)))


def least(values: np.ndarray) -> float:
    """Smallest finite value; NaN if there are none."""
    return _of_finite(values, np.min)


def percentile(values: np.ndarray, percent: float) -> float:
    """Percentile; NaN without values."""
    return float(np.percentile(values, percent)) if len(values) else math.nan


def tilt_deg(trace: Trace) -> np.ndarray:
    """Angle between the body's down axis and gravity [deg], (N,); exact near zero, where arccos is not."""
    _, x, y, _ = multiply(BoardGeometry(trace.scene).attitude.tolist(), list(trace.attitude.T))
    return np.degrees(2.0 * np.arcsin(np.clip(np.hypot(x, y), 0.0, 1.0)))


def board_tip(trace: Trace) -> np.ndarray:
    """True tip in board coordinates (along, up), (N, 2) [m]."""
    return BoardGeometry(trace.scene).board_coordinates(trace.tip[:, 1:])


def contact_clock(trace: Trace) -> np.ndarray:
    """Time of every physics step of ``contact_1khz`` [s], (M,)."""
    begin = trace.t[0] if len(trace.t) else 0.0
    return begin + np.arange(len(trace.contact_1khz)) / PHYSICS_RATE_HZ


def physics_ticks(trace: Trace) -> np.ndarray:
    """Index of the control tick of every physics step, (M,)."""
    return np.searchsorted(trace.t, contact_clock(trace) + 1e-9, side="right") - 1


def in_phase(trace: Trace, *names: str) -> np.ndarray:
    """Control ticks in one of the named phases, (N,) bool."""
    return np.isin(trace.phase, [index for index, name in enumerate(trace.phases) if name in names])


def phase_window(trace: Trace, phase: str) -> tuple[float, float]:
    """First and last time of a phase [s]; NaN if the flight never entered it."""
    inside = np.flatnonzero(in_phase(trace, phase))
    return (float(trace.t[inside[0]]), float(trace.t[inside[-1]])) if len(inside) else (math.nan, math.nan)


def event_time(trace: Trace, kind: str) -> float:
    """Time of the first event of a kind [s]; NaN without one."""
    return next((event.t for event in trace.events if event.kind == kind), math.nan)


def last_event(trace: Trace, kind: str) -> str | None:
    """Text of the last event of a kind; None without one."""
    return next((event.text for event in reversed(trace.events) if event.kind == kind), None)


def first_run(good: np.ndarray, length: int) -> int | None:
    """Start of the first run of at least ``length`` True values, or None."""
    total = np.concatenate(([0], np.cumsum(good)))
    full = np.flatnonzero(total[length:] - total[:-length] == length) if len(good) >= length else np.array([])
    return int(full[0]) if len(full) else None


def touch_figures(trace: Trace, contact: np.ndarray, clock: np.ndarray) -> dict[str, float]:
    """Time of the first touch, time to settle, and bounces.

    Args:
        trace: The flight.
        contact: Contact force at the physics rate within the window of interest [N], (K,).
        clock: Time of each sample [s], (K,).
    """
    touching = contact > CONTACT_N
    if not touching.any():
        return {"first_touch_s": math.nan, "settle_s": math.nan, "bounces": 0}
    first = int(np.argmax(touching))
    window = touching[first : first + round(BOUNCE_WINDOW_S * PHYSICS_RATE_HZ)]
    soon = (trace.t >= clock[first]) & (trace.t <= clock[first] + BOUNCE_WINDOW_S)
    settled = np.abs(contact[first:] - peak(trace.push_reference[soon])) <= SETTLE_BAND_N
    start = first_run(settled, round(SETTLE_HOLD_S * PHYSICS_RATE_HZ))
    return {
        "first_touch_s": float(clock[first]),
        "settle_s": math.nan if start is None else start / PHYSICS_RATE_HZ,
        "bounces": int(np.count_nonzero(window[:-1] & ~window[1:])),
    }


def attitude_figures(trace: Trace, ticks: np.ndarray, peak_ticks: np.ndarray | None = None) -> dict[str, float]:
    """Tilt and yaw, rms and peak, over control ticks (N,) bool; the peaks over other ticks where these are given."""
    peak_ticks = ticks if peak_ticks is None else peak_ticks
    tilt, yaw = tilt_deg(trace), np.degrees(trace.euler[:, 2])
    return {
        "tilt_rms_deg": rms(tilt[ticks]),
        "tilt_peak_deg": peak(tilt[peak_ticks]),
        "yaw_rms_deg": rms(yaw[ticks]),
        "yaw_peak_deg": peak(yaw[peak_ticks]),
    }


def limited_fraction(trace: Trace, ticks: np.ndarray) -> float:
    """Fraction of the control ticks (N,) bool with at least one active limit."""
    return float(np.mean(trace.active[ticks].any(axis=1))) if ticks.any() and trace.active.size else 0.0
