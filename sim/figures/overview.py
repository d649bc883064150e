"""Overview of a run: camera view, painted board, push."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from sim.figures.board import draw_canvas
from sim.figures.style import REFERENCE, law_colour, legend_above, new_figure, shade_phases, thin
from sim.flight.pictures import unpack_picture
from sim.flight.trace import Trace, law_name
from sim.world.board import BoardGeometry

#: The camera view is taken at this fraction of the last row.
FRACTION_OF_ROW = 0.35


def draw_overview(traces: dict[str, Trace]) -> Figure:
    """Camera view and painted board of the first law, push force of all."""
    law, trace = next(iter(traces.items()))
    figure = new_figure(4.35)
    upper, lower = figure.subfigures(2, 1, squeeze=False, height_ratios=[1.42, 1])[:, 0]
    picture = _picture(trace)
    widths = [1.75] if picture is None else [1, 1.75]
    panels = upper.subplots(1, len(widths), squeeze=False, width_ratios=widths)[0]
    if picture is not None:
        panels[0].imshow(unpack_picture(picture))
        panels[0].set_axis_off()
        panels[0].set_title("camera view")
    draw_canvas(panels[-1], trace)
    panels[-1].set_title(f"painted board, {law_name(law)}")
    axes = lower.subplots()
    shade_phases(axes, trace)
    for name, flight in traces.items():
        t, push = thin(flight.t, flight.push_true)
        axes.plot(t, push, color=law_colour(name), label=law_name(name))
    axes.plot(*thin(trace.t, trace.push_reference), **REFERENCE, label="reference")
    top = 1.5 * max(float(trace.push_reference.max()), 1.0)
    axes.set(title="push on the board", xlabel="time [s]", ylabel="push [N]", ylim=(-0.05 * top, top))
    axes.set_xlim(0.0, max(float(flight.t[-1]) for flight in traces.values()))
    legend_above(axes)
    return figure


def _picture(trace: Trace) -> np.ndarray | None:
    """A picture of the last row, or the latest before it; None without pictures."""
    painting = [picture for _, picture, phase in trace.pictures if phase.startswith("paint")]
    if not painting:
        return trace.pictures[-1][1] if trace.pictures else None
    rows = BoardGeometry(trace.scene).strokes
    return painting[min(int((rows - 1 + FRACTION_OF_ROW) / rows * len(painting)), len(painting) - 1)]
