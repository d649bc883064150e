"""Estimated and true velocity; true attitude."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from sim.figures.style import ZERO, law_colour, legend_above, new_figure, shade_phases, thin
from sim.flight.trace import Trace, law_name

_VELOCITY = ("forward", "right", "down")
_ATTITUDE = ("roll", "pitch", "yaw")
#: Smallest half height of the attitude scale [deg].
LEAST_ATTITUDE_DEG = 0.5
_TRUE = {"color": "#333333", "linewidth": 0.9}


def draw_velocity(traces: dict[str, Trace]) -> Figure:
    """One column per law: true and estimated velocity in the body frame."""
    figure = new_figure(4.6)
    grid = figure.subplots(3, len(traces), squeeze=False, sharex="col", sharey="row")
    for column, (law, trace) in enumerate(traces.items()):
        t, true, estimate = thin(trace.t, trace.velocity, trace.velocity_estimate)
        for row, name in enumerate(_VELOCITY):
            axes = grid[row][column]
            shade_phases(axes, trace, labels=row == 0, columns=len(traces))
            axes.plot(t, estimate[:, row], color=law_colour(law), label="estimated")
            axes.plot(t, true[:, row], **_TRUE, label="true")
            if column == 0:
                axes.set_ylabel(f"{name} [m/s]")
        grid[0][column].set_title(law_name(law))
        grid[-1][column].set_xlabel("time [s]")
        legend_above(grid[0][column])
    for axes in grid[0]:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.12 * (high - low))  # room for the labels of the phases
    return figure


def draw_attitude(traces: dict[str, Trace]) -> Figure:
    """True roll, pitch and yaw of all laws in common panels."""
    figure = new_figure(4.4)
    panels = figure.subplots(3, 1, sharex=True)
    longest = max(traces.values(), key=lambda trace: float(trace.t[-1]))
    for row, (axes, name) in enumerate(zip(panels, _ATTITUDE, strict=True)):
        axes.axhline(0.0, **ZERO)
        for law, trace in traces.items():
            t, euler = thin(trace.t, trace.euler)
            axes.plot(t, np.degrees(euler[:, row]), color=law_colour(law), label=law_name(law))
        shade_phases(axes, longest, labels=row == 0)
        axes.set_ylabel(f"{name} [deg]")
        low, high = axes.get_ylim()
        scale = 1.2 * max(abs(low), abs(high), LEAST_ATTITUDE_DEG)
        axes.set_ylim(-scale, scale)
    legend_above(panels[0])
    panels[-1].set_xlabel("time [s]")
    return figure
