"""Which limit was active when."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from sim.figures.style import law_colour, law_name, new_figure, shade_phases
from sim.flight.trace import Trace

#: An active stretch is drawn at least this long, so that a single tick can be seen [s].
LEAST_WIDTH_S = 0.05


def draw_limits(traces: dict[str, Trace]) -> Figure:
    """One panel per law, one line per limit, shaded where it was active; its share of the flight at the right."""
    rows = {law: max(1, len(trace.limits)) for law, trace in traces.items()}
    figure = new_figure(0.8 + 0.55 * len(traces) + 0.2 * sum(rows.values()))
    panels = figure.subplots(
        len(traces), 1, squeeze=False, sharex=True, gridspec_kw={"height_ratios": [rows[law] for law in traces]}
    )[:, 0]
    for axes, (law, trace) in zip(panels, traces.items(), strict=True):
        shade_phases(axes, trace, labels=False)
        axes.set(title=law_name(law), ylim=(rows[law] - 0.4, -0.6), yticks=[])
        axes.grid(visible=False)
        if not trace.limits or not trace.active.any():
            axes.text(0.5, 0.5, "no limit was active", transform=axes.transAxes, ha="center", va="center")
            continue
        order = np.argsort(-trace.active.mean(axis=0))
        axes.set_yticks(range(len(order)), [trace.limits[column].replace("_", " ") for column in order], fontsize=7)
        for place, column in enumerate(order):
            axes.broken_barh(_stretches(trace, column), (place - 0.35, 0.7), color=law_colour(law), linewidth=0)
            share = float(trace.active[:, column].mean())
            axes.text(1.01, place, f"{share:.2%}", transform=axes.get_yaxis_transform(), va="center", fontsize=7)
    panels[-1].set_xlabel("time [s]")
    return figure


def _stretches(trace: Trace, column: int) -> list[tuple[float, float]]:
    """(begin, duration) of every stretch in which a limit was active [s]."""
    edges = np.diff(np.concatenate(([False], trace.active[:, column], [False])).astype(int))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    return [
        (float(trace.t[begin]), max(float(trace.t[end] - trace.t[begin]), LEAST_WIDTH_S))
        for begin, end in zip(begins, ends, strict=True)
    ]
