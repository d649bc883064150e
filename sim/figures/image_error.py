"""Error of the guiding lines in the picture."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from sim.figures.style import ZERO, law_panels, legend_above, shade_phases, thin
from sim.flight.trace import Trace

_GUIDES = (("horizontal guide", "#2f7d4f"), ("vertical guide", "#8a4fa3"))
#: The scale covers this percentile of all errors; a guide may first appear far from its reference.
SHOWN_PERCENTILE = 99.0
#: Smallest half height of the scale [px].
LEAST_SCALE_PX = 4.0


def draw_image_error(traces: dict[str, Trace]) -> Figure:
    """One panel per law: error of the horizontal and the vertical guide at the tip."""
    figure, panels = law_panels(traces, 0.3 + 1.75 * len(traces), sharex=True, sharey=True)
    errors = np.abs(np.concatenate([trace.line_error_px.ravel() for trace in traces.values()]))
    errors = errors[np.isfinite(errors)]
    scale = 1.15 * max(LEAST_SCALE_PX, float(np.percentile(errors, SHOWN_PERCENTILE)) if len(errors) else 0.0)
    for axes, _, trace in panels:
        shade_phases(axes, trace)
        t, error = thin(trace.t, trace.line_error_px)
        for column, (name, colour) in enumerate(_GUIDES):
            axes.plot(t, error[:, column], color=colour, label=name)
        axes.axhline(0.0, **ZERO)
        axes.set(ylabel="image error [px]", ylim=(-scale, scale))
    legend_above(panels[0][0])
    panels[-1][0].set_xlabel("time [s]")
    panels[-1][0].set_xlim(0.0, max(float(trace.t[-1]) for trace in traces.values()))
    return figure
