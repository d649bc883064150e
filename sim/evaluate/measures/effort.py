"""How hard and how nervously the rotors work, and the rows of figures that a sweep and a search keep of a flight."""

from __future__ import annotations

import math

import numpy as np

from sim.evaluate.measures.paint import paint_figures
from sim.evaluate.measures.press import press_figures
from sim.evaluate.measures.window import rms
from sim.flight.trace import Trace

#: Before this the vehicle finds its hover [s].
SETTLED_S = 1.0


def effort_figures(trace: Trace) -> dict[str, float]:
    """What the controller asks of the rotors over the flight after its first second.

    Returns:
        ``effort_n``: thrusts away from their own mean, rms over rotors and ticks [N].
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


def paint_row(trace: Trace) -> dict[str, float]:
    """Figures of a paint job with the effort."""
    return paint_figures(trace) | effort_figures(trace)


def press_row(trace: Trace) -> dict[str, float]:
    """Figures of a press with the effort."""
    return press_figures(trace) | effort_figures(trace)
