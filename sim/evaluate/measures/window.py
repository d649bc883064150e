"""Windows of a trace and the statistics taken over them."""

from __future__ import annotations

import math

import numpy as np

from sim.flight.trace import Trace
from sim.world.board import BoardGeometry

#: Rate of the contact arrays [Hz] and normal force above which brush and board count as touching [N].
PHYSICS_RATE_HZ, CONTACT_N = 1000.0, 0.05


def rms(values: np.ndarray) -> float:
    """Root of the mean square of what is finite; NaN of nothing."""
    good = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else math.nan


def mean(values: np.ndarray) -> float:
    """Mean of what is finite; NaN of nothing."""
    good = values[np.isfinite(values)]
    return float(np.mean(good)) if len(good) else math.nan


def peak(values: np.ndarray) -> float:
    """Greatest magnitude of what is finite; NaN of nothing."""
    good = values[np.isfinite(values)]
    return float(np.max(np.abs(good))) if len(good) else math.nan


def tilt_deg(trace: Trace) -> np.ndarray:
    """Angle between the body's down axis and the world's [deg], (N,)."""
    _, x, y, _ = trace.attitude.T
    return np.degrees(2.0 * np.arcsin(np.clip(np.hypot(x, y), 0.0, 1.0)))


def board_tip(trace: Trace) -> np.ndarray:
    """True tip in board coordinates (along, up), (N, 2) [m]."""
    return BoardGeometry(trace.scene).board_coordinates(trace.tip[:, 1:])


def contact_clock(trace: Trace) -> np.ndarray:
    """Time of every physics step of ``contact_1khz`` [s], (M,)."""
    begin = trace.t[0] if len(trace.t) else 0.0
    return begin + np.arange(len(trace.contact_1khz)) / PHYSICS_RATE_HZ


def phase_window(trace: Trace, phase: str) -> tuple[float, float]:
    """First and last time of a phase [s]; NaN if it was never entered."""
    if phase not in trace.phases:
        return math.nan, math.nan
    inside = np.flatnonzero(trace.phase == trace.phases.index(phase))
    return (float(trace.t[inside[0]]), float(trace.t[inside[-1]])) if len(inside) else (math.nan, math.nan)


def event_time(trace: Trace, kind: str) -> float:
    """Time of the first event of a kind [s], NaN without one."""
    return next((event.t for event in trace.events if event.kind == kind), math.nan)


def first_run(good: np.ndarray, length: int) -> int | None:
    """Start of the first run of at least ``length`` True values, or None."""
    total = np.concatenate(([0], np.cumsum(good)))
    full = np.flatnonzero(total[length:] - total[:-length] == length) if len(good) >= length else np.array([])
    return int(full[0]) if len(full) else None
