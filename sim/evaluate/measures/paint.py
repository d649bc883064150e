"""Figures of a paint job as a flat row: those of `sim.evaluate.metrics` without the machine-dependent timings."""

from __future__ import annotations

import numpy as np

from sim.evaluate.measures.window import rms
from sim.evaluate.metrics import compute_metrics
from sim.evaluate.path_error import path_error
from sim.flight.trace import Trace

#: Durations on this computer: not a result of the flight.
_TIMINGS = ("real_time_factor",)


def paint_figures(trace: Trace) -> dict[str, float]:
    """Every number of M, path and push over straights and corners together, shares of ticks solved and limited."""
    metrics = compute_metrics(trace)
    figures = {
        name: float(value)
        for name, value in metrics.items()
        if isinstance(value, (int, float)) and not isinstance(value, bool) and name not in _TIMINGS
    }
    ticks = sum(metrics["outcomes"].values())
    figures["solved_share"] = metrics["outcomes"].get("solved", 0) / ticks if ticks else float("nan")
    figures["limited_share"] = float(np.mean(trace.active.any(axis=1))) if trace.active.size else 0.0
    path = path_error(trace)
    figures["path_rms_m"] = rms(path.distance[path.painting])
    figures["force_rms_n"] = rms((trace.push_true - trace.push_reference)[path.painting])
    return figures
