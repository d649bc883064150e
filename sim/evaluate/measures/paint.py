"""Figures of a paint job as a flat row, without machine-dependent timings; effort of the rotors."""

from __future__ import annotations

import math

import numpy as np

from sim.evaluate.metrics import compute_metrics
from sim.evaluate.path_error import path_error
from sim.evaluate.window import limited_fraction, rms
from sim.flight.trace import CRASH, Trace

#: The vehicle finds its hover within this time after release [s].
SETTLED_S = 1.0


def paint_figures(trace: Trace) -> dict[str, float]:
    """Every number of M, rms of path and push over the whole painting, fractions of ticks solved and limited, crash.

    Also effort and thrust rate.
    ``push_peak_ratio``: greatest push at 1 kHz over the push of the job. ``crashed``: 1 if the flight ended so, else 0.
    ``path_rms_last_row_m``: path on the straight of the last row, NaN if it was not reached.
    """
    metrics = compute_metrics(trace)
    figures = {
        name: float(value)
        for name, value in metrics.items()
        if isinstance(value, (int, float)) and not isinstance(value, bool) and name != "real_time_factor"
    }
    ticks = sum(metrics["outcomes"].values())
    figures["solved_share"] = metrics["outcomes"].get("solved", 0) / ticks if ticks else math.nan
    figures["limited_share"] = limited_fraction(trace, np.ones(len(trace.t), bool))
    figures["push_peak_ratio"] = metrics["force_peak_n"] / trace.scene.paint.push_n
    figures["crashed"] = float(trace.reason.startswith(CRASH))
    rows = metrics["rows"]
    reached = len(rows) == trace.scene.paint.rows
    figures["path_rms_last_row_m"] = rows[-1]["path_rms_straight_m"] if reached else math.nan
    path = path_error(trace)
    figures["path_rms_m"] = rms(path.distance[path.painting])
    figures["force_rms_n"] = rms((trace.push_true - trace.push_reference)[path.painting])
    return figures | effort_figures(trace)


def paint_timed_figures(trace: Trace) -> dict[str, float]:
    """Figures of a paint job with a timing of the machine: ``perception_hz``, from the median time per picture."""
    per_picture_ms = float(np.median(trace.vision_ms)) if len(trace.vision_ms) else 0.0
    return paint_figures(trace) | {"perception_hz": 1e3 / per_picture_ms if per_picture_ms > 0.0 else math.nan}


def effort_figures(trace: Trace) -> dict[str, float]:
    """Thrust effort and thrust rate over the flight after its first second.

    Returns:
        ``effort_n``: thrusts minus their own mean, rms over rotors and ticks [N].
        ``jitter_n_s``: rate of the commanded thrusts, rms over rotors and ticks [N/s].
    """
    thrusts = trace.thrusts[trace.t >= SETTLED_S]
    if len(thrusts) < 2:
        return {"effort_n": math.nan, "jitter_n_s": math.nan}
    tick = float(np.median(np.diff(trace.t)))
    return {
        "effort_n": rms(thrusts - thrusts.mean(axis=0)),
        "jitter_n_s": rms(np.diff(thrusts, axis=0) / tick),
    }
