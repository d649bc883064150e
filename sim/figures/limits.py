"""Active limits over time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from sim.figures.style import law_colour, law_panels, note_empty, runs, shade_phases
from sim.flight.trace import Trace

#: An active stretch is drawn at least this long, so that a single tick is visible [s].
LEAST_WIDTH_S = 0.05


def draw_limits(traces: dict[str, Trace]) -> Figure:
    """One panel per law, one bar per limit where it was active; at the right its fraction of the flight."""
    counts = [max(1, len(trace.limits)) for trace in traces.values()]
    height = 0.8 + 0.55 * len(traces) + 0.2 * sum(counts)
    figure, panels = law_panels(traces, height, sharex=True, gridspec_kw={"height_ratios": counts})
    for (axes, law, trace), count in zip(panels, counts, strict=True):
        shade_phases(axes, trace, labels=False)
        axes.set(ylim=(count - 0.4, -0.6), yticks=[])
        axes.grid(visible=False)
        if not trace.limits or not trace.active.any():
            note_empty(axes, "no limit was active")
            continue
        order = np.argsort(-trace.active.mean(axis=0))
        axes.set_yticks(range(len(order)), [trace.limits[column].replace("_", " ") for column in order], fontsize=7)
        for place, column in enumerate(order):
            active = trace.active[:, column]
            bars = [
                (float(trace.t[first]), max(float(trace.t[last] - trace.t[first]), LEAST_WIDTH_S))
                for first, last in runs(active)
                if active[first]
            ]
            axes.broken_barh(bars, (place - 0.35, 0.7), color=law_colour(law), linewidth=0)
            text = f"{float(active.mean()):.2%}"
            axes.text(1.01, place, text, transform=axes.get_yaxis_transform(), va="center", fontsize=7)
    panels[-1][0].set_xlabel("time [s]")
    return figure
