"""Figures of one flight, from its trace alone; docs/metrics.md defines them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from sim.evaluate.paint_plan import PaintPlan, Segment, band_mask, nominal_plan
from sim.evaluate.path_error import PathError, path_error
from sim.evaluate.window import (
    CONTACT_N,
    attitude_figures,
    contact_clock,
    in_phase,
    least,
    peak,
    rms,
    touch_figures,
)
from sim.flight.trace import Trace

#: Attitude figures skip the release of the vehicle [s].
RELEASE_S = 1.0
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
        "vision_ms": _percentiles(trace.vision_ms, p50=50, p99=99),
    }
    metrics["real_time_factor"] = metrics["duration_s"] / trace.wall_time_s if trace.wall_time_s > 0 else math.nan
    flown = [row for row in range(1, trace.scene.paint.rows + 1) if np.any(path.painting & (trace.row == row))]
    metrics["rows"] = [_row(trace, path, row) for row in flown]
    return metrics


def _row(trace: Trace, path: PathError, row: int) -> dict[str, Any]:
    """The same figures over the ticks that painted one row and the climb that leads to it."""
    ticks = path.painting & (trace.row == row)
    last = int(np.flatnonzero(ticks)[-1])
    after = (trace.row > row) | in_phase(trace, "retreat", "done")
    reasons = [event.text for event in trace.events if event.kind == "phase" and event.t > trace.t[last] - 1e-9]
    own = tuple(segment for segment in nominal_plan(trace.scene).segments if segment.row == row)
    tick_s = float(np.median(np.diff(trace.t))) if len(trace.t) > 1 else 0.0
    return {
        "row": row,
        "completed": bool(np.any(after[last:])),
        "reason": reasons[0] if reasons else trace.reason,
        "duration_s": float(np.count_nonzero(ticks)) * tick_s,
        **_window(trace, path, ticks, own, PaintPlan(segments=own)),
        "vision_ms": {"p50": math.nan, "p99": math.nan},
        "real_time_factor": math.nan,
    }


def _window(
    trace: Trace, path: PathError, ticks: np.ndarray, segments: Sequence[Segment], band: PaintPlan
) -> dict[str, Any]:
    """Every figure that exists for a part of a flight.

    Args:
        trace: The flight.
        path: Its path error.
        ticks: Control ticks of the part, (N,) bool.
        segments: Segments whose rows must have been painted.
        band: The intended band.
    """
    straight, corner = ticks & path.painting & ~path.corner, ticks & path.corner
    force = trace.push_true - trace.push_reference
    clock = contact_clock(trace)
    inside = ticks[np.searchsorted(trace.t, clock + 1e-9, side="right") - 1]  # tick of every physics step
    contact, demanded = trace.contact_1khz[inside], trace.painting_1khz[inside].astype(bool)
    rows = [segment.row for segment in segments if segment.kind == "row"]
    return {
        "stroke_m": min((_stroke(trace, path, row) for row in rows), default=0.0),
        "path_rms_straight_m": rms(path.distance[straight]),
        "path_rms_corner_m": rms(path.distance[corner]),
        "path_max_m": peak(path.distance[ticks & path.painting]),
        "force_rms_straight_n": rms(force[straight]),
        "force_rms_corner_n": rms(force[corner]),
        "force_peak_n": peak(contact),
        "contact_share": float(np.mean(contact[demanded] > CONTACT_N)) if demanded.any() else math.nan,
        **attitude_figures(trace, ticks & (trace.t >= RELEASE_S)),
        "height_error_rms_m": rms(path.height[ticks]),
        "coverage": coverage(trace, band),
        "velocity_rms_m_s": _velocity_rms(trace, ticks),
        "propeller_clearance_min_m": least(trace.propeller_clearance[ticks]),
        **touch_figures(trace, contact, clock[inside]),
        "outcomes": {
            name: int(np.count_nonzero(trace.outcome[ticks] == index)) for index, name in enumerate(trace.outcomes)
        },
        "limits": {
            name: float(np.mean(trace.active[ticks, index])) if ticks.any() else math.nan
            for index, name in enumerate(trace.limits)
        },
        "step_us": _percentiles(trace.step_us[ticks], p50=50, p99=99, max=100),
    }


def coverage(trace: Trace, band: PaintPlan | None = None) -> float:
    """Painted fraction of the intended band: discs of the brush's width along the scene's polyline."""
    if trace.coverage_mask is None or not trace.canvas_px_per_m:
        return math.nan
    plan = nominal_plan(trace.scene) if band is None else band
    intended = band_mask(trace.scene, plan, trace.coverage_mask.shape[:2], trace.canvas_px_per_m)
    return float(np.mean(trace.coverage_mask[intended] > PAINTED)) if intended.any() else math.nan


def _stroke(trace: Trace, path: PathError, row: int) -> float:
    ticks = in_phase(trace, "paint") & (trace.row == row) & (trace.push_true > CONTACT_N)
    return float(np.ptp(path.tip[ticks, 0])) if ticks.any() else 0.0


def _velocity_rms(trace: Trace, ticks: np.ndarray) -> float:
    error = (trace.velocity_estimate - trace.velocity)[ticks]
    known = np.isfinite(error).any(axis=1)
    return math.sqrt(np.mean(np.nansum(error[known] ** 2, axis=1))) if known.any() else math.nan


def _percentiles(values: np.ndarray, **percents: float) -> dict[str, float]:
    return {
        name: float(np.percentile(values, percent)) if len(values) else math.nan for name, percent in percents.items()
    }
