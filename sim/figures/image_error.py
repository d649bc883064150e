"""Error of the guiding lines in the picture."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from sim.figures.style import law_name, legend_above, new_figure, shade_phases, thin
from sim.flight.trace import Trace

_GUIDES = (("horizontal guide", "#2f7d4f"), ("vertical guide", "#8a4fa3"))
#: The scale shows this share of all errors; the first sight of a guide may lie far off.
SHOWN_PERCENTILE = 99.0
LEAST_SCALE_PX = 4.0


def draw_image_error(traces: dict[str, Trace]) -> Figure:
    """One panel per law: error of the horizontal and the vertical guide at the tip."""
    figure = new_figure(0.3 + 1.75 * len(traces))
    panels = figure.subplots(len(traces), 1, squeeze=False, sharex=True, sharey=True)[:, 0]
    everything = np.abs(np.concatenate([trace.line_error_px.ravel() for trace in traces.values()]))
    seen = everything[np.isfinite(everything)]
    scale = 1.15 * max(LEAST_SCALE_PX, float(np.percentile(seen, SHOWN_PERCENTILE)) if len(seen) else 0.0)
    for axes, (law, trace) in zip(panels, traces.items(), strict=True):
        shade_phases(axes, trace)
        t, error = thin(trace.t, trace.line_error_px)
        for column, (name, colour) in enumerate(_GUIDES):
            axes.plot(t, error[:, column], color=colour, label=name)
        axes.axhline(0.0, color="#333333", linewidth=0.6)
        axes.set(title=law_name(law), ylabel="image error [px]", ylim=(-scale, scale))
    legend_above(panels[0])
    panels[-1].set_xlabel("time [s]")
    panels[-1].set_xlim(0.0, max(float(trace.t[-1]) for trace in traces.values()))
    return figure
