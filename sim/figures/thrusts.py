"""Thrust of every rotor between its limits."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from sim.figures.style import law_name, new_figure, shade_phases, thin
from sim.flight.trace import Trace

#: Below this lower limit a logarithmic scale shows nothing but its own floor [N].
LEAST_LOG_N = 0.1
_LIMIT = {"color": "#b3261e", "linewidth": 0.9, "linestyle": (0, (5, 2))}


def draw_thrusts(traces: dict[str, Trace], names: tuple[str, ...] | None = None) -> Figure:
    """One panel per law: commanded thrusts, limit lines, phases.

    Args:
        traces: The flights.
        names: Names of the rotors; None takes those of the nominal vehicle if their number fits.
    """
    figure = new_figure(0.5 + 2.1 * len(traces))
    panels = figure.subplots(len(traces), 1, squeeze=False, sharex=True, sharey=True)[:, 0]
    colours = matplotlib.colormaps["tab10"].colors  # type: ignore[attr-defined]
    for axes, (law, trace) in zip(panels, traces.items(), strict=True):
        shade_phases(axes, trace)
        t, thrusts = thin(trace.t, trace.thrusts)
        labels = _names(names, thrusts.shape[1])
        for rotor, label in enumerate(labels):
            axes.plot(t, thrusts[:, rotor], color=colours[rotor % 10], linewidth=0.8, label=label)
        for limit in np.unique(np.concatenate((trace.thrust_min, trace.thrust_max))):
            axes.axhline(limit, **_LIMIT)
            axes.annotate(
                f"{limit:g} N",
                (1.0, limit),
                xycoords=("axes fraction", "data"),
                xytext=(-2, 2),
                textcoords="offset points",
                ha="right",
                va="bottom",
                fontsize=7,
                color=_LIMIT["color"],
            )
        axes.set(title=law_name(law), ylabel="thrust [N]")
        _scale(axes, float(np.min(trace.thrust_min)), float(np.max(trace.thrust_max)))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=6)
    panels[-1].set_xlabel("time [s]")
    return figure


def _scale(axes, low: float, high: float) -> None:
    """Logarithmic, so that the idle floor, which binds first, can be told from the thrusts above it."""
    if low < LEAST_LOG_N:
        axes.set_ylim(0.0, 1.15 * high)
        return
    axes.set_yscale("log")
    axes.set_ylim(low / 1.25, 1.6 * high)
    ticks = [tick for tick in (0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200) if low / 1.25 < tick < 1.6 * high]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()


def _names(names: tuple[str, ...] | None, count: int) -> tuple[str, ...]:
    from allocation.geometry import TAROT_T960

    names = TAROT_T960.names if names is None else names
    if len(names) != count:
        return tuple(f"rotor {number}" for number in range(1, count + 1))
    return tuple(name.replace("_", " ") for name in names)
