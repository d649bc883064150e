"""Thrust of every rotor between its limits."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from allocation import TAROT_T960
from sim.figures.style import law_panels, shade_phases, thin
from sim.flight.trace import Trace

#: With a lower limit below this the scale is linear: a logarithmic one would show little but the limit [N].
LEAST_LOG_N = 0.1
#: Candidates for ticks of the logarithmic scale [N].
_LOG_TICKS_N = (0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200)
_LIMIT = {"color": "#b3261e", "linewidth": 0.9, "linestyle": (0, (5, 2))}


def draw_thrusts(traces: dict[str, Trace]) -> Figure:
    """One panel per law: commanded thrusts, limits, phases; names are those of the nominal vehicle if they fit."""
    figure, panels = law_panels(traces, 0.5 + 2.1 * len(traces), sharex=True, sharey=True)
    colours = matplotlib.colormaps["tab10"].colors  # type: ignore[attr-defined]
    for axes, _, trace in panels:
        shade_phases(axes, trace)
        t, thrusts = thin(trace.t, trace.thrusts)
        count = thrusts.shape[1]
        names = TAROT_T960.names
        names = names if len(names) == count else [f"rotor {number}" for number in range(1, count + 1)]
        for rotor, label in enumerate(names):
            line = {"color": colours[rotor % 10], "linewidth": 0.8, "label": label.replace("_", " ")}
            axes.plot(t, thrusts[:, rotor], **line)
        for limit in np.unique(np.concatenate((trace.thrust_min, trace.thrust_max))):
            axes.axhline(limit, **_LIMIT)
            place = {"xy": (1.0, limit), "xycoords": ("axes fraction", "data"), "textcoords": "offset points"}
            above = limit < trace.thrust_max.min()  # texts between the limits: above the panel stand the phases
            text = {"xytext": (-2, 2 if above else -2), "ha": "right", "va": "bottom" if above else "top"}
            axes.annotate(f"{limit:g} N", **place, **text, fontsize=7, color=_LIMIT["color"])
        axes.set_ylabel("thrust [N]")
        _scale(axes, float(np.min(trace.thrust_min)), float(np.max(trace.thrust_max)))
    figure.legend(*panels[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=6)
    panels[-1][0].set_xlabel("time [s]")
    return figure


def _scale(axes: Axes, low: float, high: float) -> None:
    """Logarithmic, so that the lower limit, usually the first active one, stands apart from the thrusts above it."""
    if low < LEAST_LOG_N:
        axes.set_ylim(0.0, 1.15 * high)
        return
    axes.set_yscale("log")
    axes.set_ylim(low / 1.25, 1.6 * high)
    ticks = [tick for tick in _LOG_TICKS_N if low / 1.25 < tick < 1.6 * high]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
