"""Figures of one flight, from its trace alone; every one is defined in docs/metrics.md."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from sim.evaluate.paint_plan import PaintPlan, Segment, band_mask, nominal_plan
from sim.evaluate.path_error import CONTACT_N, PathError, in_phase, path_error
from sim.flight.trace import Trace

#: Rate of the contact arrays [Hz].
PHYSICS_RATE_HZ = 1000.0
#: Attitude counts from here on: the first second belongs to the release [s].
RELEASE_S = 1.0
#: A push has settled when it stays within this band of its target [N] ...
SETTLE_BAND_N = 0.5
#: ... for this long [s].
SETTLE_HOLD_S = 0.5
#: Losses of contact count as bounces, and the target push is read, within this time after the first touch [s].
BOUNCE_WINDOW_S = 3.0
#: Paint coverage of a pixel above which it counts as painted.
PAINTED = 0.5


def compute_metrics(trace: Trace) -> dict[str, Any]:
    """Compute M of the contract.

    Args:
        trace: One flight, complete or not.

    Returns:
        The figures by name, and those of every row flown under ``rows``; a figure without data is NaN.
    """
    path = path_error(trace)
    everything = np.ones(len(trace.t), bool)
    metrics = {
        "completed": bool(trace.completed),
        "reason": trace.reason,
        "duration_s": float(trace.t[-1] - trace.t[0]) if len(trace.t) else 0.0,
        **_window(trace, path, everything, path.plan.segments, nominal_plan(trace.scene)),
        "vision_ms": _percentiles(trace.vision_ms, ("p50", "p99")),
    }
    metrics["real_time_factor"] = metrics["duration_s"] / trace.wall_time_s if trace.wall_time_s > 0 else math.nan
    flown = [row for row in range(1, trace.scene.paint.rows + 1) if np.any(path.painting & (trace.row == row))]
    metrics["rows"] = [_row(trace, path, row) for row in flown]
    return metrics


def _row(trace: Trace, path: PathError, row: int) -> dict[str, Any]:
    """The same figures over the time in which one row, with the climb that leads to it, was painted."""
    ticks = path.painting & (trace.row == row)
    last = int(np.flatnonzero(ticks)[-1])
    after = (trace.row > row) | in_phase(trace, "retreat", "done")
    reasons = [event.text for event in trace.events if event.kind == "phase" and event.t > trace.t[last] - 1e-9]
    own = [segment for segment in nominal_plan(trace.scene).segments if segment.row == row]
    return {
        "row": row,
        "completed": bool(np.any(after[last:])),
        "reason": reasons[0] if reasons else trace.reason,
        "duration_s": float(np.count_nonzero(ticks)) * _tick(trace),
        **_window(trace, path, ticks, own, PaintPlan(segments=tuple(own))),
        "vision_ms": {"p50": math.nan, "p99": math.nan},
        "real_time_factor": math.nan,
    }


def _window(
    trace: Trace, path: PathError, ticks: np.ndarray, segments: Sequence[Segment], band: PaintPlan
) -> dict[str, Any]:
    """Every figure that can be taken over a part of a flight.

    Args:
        trace: The flight.
        path: Its path error.
        ticks: Control ticks that count, (N,) bool.
        segments: Segments whose rows must have been painted.
        band: What shall be covered.
    """
    straight, corner = ticks & path.painting & ~path.corner, ticks & path.corner
    force = trace.push_true - trace.push_reference
    attitude = ticks & (trace.t >= RELEASE_S)
    tilt = np.degrees(_tilt(trace.attitude[attitude]))
    yaw = np.degrees(trace.euler[attitude, 2])
    contact, demanded, clock = _physics(trace, ticks)
    rows = [segment.row for segment in segments if segment.kind == "row"]
    return {
        "stroke_m": min((_stroke(trace, path, row) for row in rows), default=0.0),
        "path_rms_straight_m": _rms(path.distance[straight]),
        "path_rms_corner_m": _rms(path.distance[corner]),
        "path_max_m": _peak(path.distance[ticks & path.painting]),
        "force_rms_straight_n": _rms(force[straight]),
        "force_rms_corner_n": _rms(force[corner]),
        "force_peak_n": _peak(contact),
        "contact_share": float(np.mean(contact[demanded] > CONTACT_N)) if demanded.any() else math.nan,
        "tilt_rms_deg": _rms(tilt),
        "tilt_peak_deg": _peak(tilt),
        "yaw_rms_deg": _rms(yaw),
        "yaw_peak_deg": _peak(yaw),
        "height_error_rms_m": _rms(path.height[ticks]),
        "coverage": coverage(trace, band),
        "velocity_rms_m_s": _velocity_rms(trace, ticks),
        "propeller_clearance_min_m": -_peak(-trace.propeller_clearance[ticks], absolute=False),
        **_touch(trace, contact, clock),
        "outcomes": _counts(trace.outcome[ticks], trace.outcomes),
        "limits": {
            name: float(np.mean(trace.active[ticks, index])) if ticks.any() else math.nan
            for index, name in enumerate(trace.limits)
        },
        "step_us": _percentiles(trace.step_us[ticks], ("p50", "p99", "max")),
    }


def coverage(trace: Trace, band: PaintPlan | None = None) -> float:
    """Painted share of the intended band: discs of the brush's width along the scene's polyline."""
    if trace.coverage_mask is None or not trace.canvas_px_per_m:
        return math.nan
    plan = nominal_plan(trace.scene) if band is None else band
    wanted = band_mask(trace.scene, plan, trace.coverage_mask.shape[:2], trace.canvas_px_per_m)
    return float(np.mean(trace.coverage_mask[wanted] > PAINTED)) if wanted.any() else math.nan


def _touch(trace: Trace, contact: np.ndarray, clock: np.ndarray) -> dict[str, Any]:
    touching = contact > CONTACT_N
    if not touching.any():
        return {"first_touch_s": math.nan, "settle_s": math.nan, "bounces": 0}
    first = int(np.argmax(touching))
    window = slice(first, first + round(BOUNCE_WINDOW_S * PHYSICS_RATE_HZ))
    lost = np.count_nonzero(touching[window][:-1] & ~touching[window][1:])
    soon = (trace.t >= clock[first]) & (trace.t <= clock[first] + BOUNCE_WINDOW_S)
    target = _peak(trace.push_reference[soon])
    settled = np.abs(contact[first:] - target) <= SETTLE_BAND_N
    start = _first_run(settled, round(SETTLE_HOLD_S * PHYSICS_RATE_HZ))
    settle = math.nan if start is None else start / PHYSICS_RATE_HZ
    return {"first_touch_s": float(clock[first]), "settle_s": settle, "bounces": int(lost)}


def _first_run(good: np.ndarray, length: int) -> int | None:
    """Start of the first run of at least ``length`` True values."""
    total = np.concatenate(([0], np.cumsum(good)))
    full = np.flatnonzero(total[length:] - total[:-length] == length) if len(good) >= length else np.array([])
    return int(full[0]) if len(full) else None


def _physics(trace: Trace, ticks: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contact force, contact demanded, and time of the physics steps within the ticks."""
    clock = trace.t[0] + np.arange(len(trace.contact_1khz)) / PHYSICS_RATE_HZ if len(trace.t) else np.array([])
    tick = np.searchsorted(trace.t, clock + 1e-9, side="right") - 1
    inside = ticks[tick] if len(clock) else np.array([], bool)
    return trace.contact_1khz[inside], trace.painting_1khz[inside].astype(bool), clock[inside]


def _stroke(trace: Trace, path: PathError, row: int) -> float:
    ticks = in_phase(trace, "paint") & (trace.row == row) & (trace.push_true > CONTACT_N)
    along = path.tip[ticks, 0]
    return float(along.max() - along.min()) if len(along) else 0.0


def _tilt(attitude: np.ndarray) -> np.ndarray:
    """Angle between the body's down axis and the world's [rad], (N,); exact near zero, where arccos is not."""
    _, x, y, _ = attitude.T
    return 2.0 * np.arcsin(np.clip(np.hypot(x, y), 0.0, 1.0))


def _velocity_rms(trace: Trace, ticks: np.ndarray) -> float:
    error = (trace.velocity_estimate - trace.velocity)[ticks]
    known = np.isfinite(error).any(axis=1)
    return math.sqrt(np.mean(np.nansum(error[known] ** 2, axis=1))) if known.any() else math.nan


def _tick(trace: Trace) -> float:
    return float(np.median(np.diff(trace.t))) if len(trace.t) > 1 else 0.0


def _rms(values: np.ndarray) -> float:
    good = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else math.nan


def _peak(values: np.ndarray, absolute: bool = True) -> float:
    good = values[np.isfinite(values)]
    return float(np.max(np.abs(good) if absolute else good)) if len(good) else math.nan


def _counts(index: np.ndarray, names: tuple[str, ...]) -> dict[str, int]:
    return {name: int(np.count_nonzero(index == number)) for number, name in enumerate(names)}


def _percentiles(values: np.ndarray, names: tuple[str, ...]) -> dict[str, float]:
    share = {"p50": 50, "p99": 99, "max": 100}
    return {name: float(np.percentile(values, share[name])) if len(values) else math.nan for name in names}
