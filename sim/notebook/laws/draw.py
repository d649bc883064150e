"""Both laws on the same ticks, and side by side in the closed loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim.evaluate.window import board_tip, phase_window, tilt_deg
from sim.figures.style import REFERENCE, law_colour, law_name, new_figure
from sim.flight.trace import Trace
from sim.notebook.laws.agreement import Agreement
from sim.notebook.laws.shadow import ShadowFlight

#: Differences below this are rounding and drawn as this [N].
ROUNDING_N = 1e-9
#: Filters have settled by then [s].
BEGIN_S = 0.3
#: Tint of full contact and of ticks at which a limit binds.
CONTACT, LIMITED = "#e3eef5", "#f4dfc8"
#: Curves over time: label, from a trace.
SERIES = {
    "push [N]": lambda trace: trace.push_true,
    "height [mm]": lambda trace: 1e3 * (board_tip(trace)[:, 1] - trace.scene.paint.edge_margin_m),
    "tilt [deg]": tilt_deg,
    "roll [deg]": lambda trace: np.degrees(trace.euler[:, 0]),
    "yaw [deg]": lambda trace: np.degrees(trace.euler[:, 2]),
}
#: Wrench rows [Fx Fy Fz Mx My Mz] and their names.
FORCES, MOMENTS = {0: "front", 1: "right", 2: "down"}, {3: "roll", 4: "pitch", 5: "yaw"}


def draw_agreement(rows: Sequence[Agreement]) -> Figure:
    """Thrust difference over the weight of the line rows: full lines the worst tick, dots the median."""
    figure = new_figure(3.0)
    axes = figure.subplots()
    weights = [row.weight for row in rows]
    for name, words, colour in (
        ("free", "free flight", "#0b6f9e"),
        ("contact", "contact, as printed: $S\\,L^\\dagger$", "#d55e1a"),
        ("selected", "contact, selected first: $(L S)^\\dagger$", "#3a8a4d"),
    ):
        middle, worst = np.array([getattr(row, name) for row in rows]).T
        axes.plot(weights, worst, "o-", color=colour, markersize=3.5, label=words)
        axes.plot(weights, middle, ":", color=colour)
    axes.set(xscale="log", yscale="log", xlabel="weight of the line rows over all other wishes",
             ylabel="thrust difference [N]", title="Program minus law, same set-points, no limits")  # fmt: skip
    axes.legend()
    return figure


def draw_difference(flight: ShadowFlight) -> Figure:
    """Thrust difference of the two laws tick by tick, and the wrench difference it stands for."""
    figure = new_figure(4.6)
    grid = figure.subplots(3, 1, sharex=True)
    free = np.abs(flight.qp_free - flight.law_free).max(axis=1)
    flown = np.abs(flight.qp - flight.law).max(axis=1)
    grid[0].plot(flight.t, np.maximum(flown, ROUNDING_N), color="#333333", label="as commanded", linewidth=0.8)
    grid[0].plot(flight.t, np.maximum(free, ROUNDING_N), color="#d55e1a", label="without limits", linewidth=0.8)
    grid[0].set(yscale="log", ylabel="thrusts [N]", title="QP minus analytic law; blue: contact, orange: a limit binds")
    wrench = (flight.qp - flight.law) @ flight.effectiveness.T
    _lines(grid[1], flight.t, wrench, FORCES)
    _lines(grid[2], flight.t, wrench, MOMENTS)
    grid[1].set_ylabel("forces [N]")
    grid[2].set(ylabel="moments [N m]", xlabel="time [s]")
    for axes in grid:
        _tint(axes, flight)
        axes.legend(loc="lower right" if axes is grid[0] else "upper right", ncols=3, fontsize=7)
    grid[0].set_xlim(min(BEGIN_S, float(flight.t[-1]) / 2), float(flight.t[-1]))
    for axes, most in ((grid[1], 2.0), (grid[2], 0.2)):
        axes.set_ylim(-most / 2, most)
    figure.align_ylabels(grid)
    return figure


def draw_given_up(flight: ShadowFlight) -> Figure:
    """Wrench that the limits take from each law's own wish at the same ticks of one flight."""
    figure = new_figure(4.2)
    grid = figure.subplots(2, 2, sharex=True, sharey="row")
    for column, law in enumerate(("qp", "paper")):
        lost = flight.wrench_given_up(law)
        _lines(grid[0, column], flight.t, lost, FORCES)
        _lines(grid[1, column], flight.t, lost, MOMENTS)
        grid[0, column].set_title(law_name(law) + (", flown" if law == "qp" else ", asked at every tick, not flown"))
        grid[1, column].set_xlabel("time [s]")
        for axes in grid[:, column]:
            _tint(axes, flight)
    late = flight.contact_weight > 0.5
    if late.any():
        grid[0, 0].set_xlim(float(flight.t[late][0]) - 0.1, float(flight.t[-1]))
    grid[0, 0].set_ylabel("forces given up [N]")
    grid[1, 0].set_ylabel("moments given up [N m]")
    # Where the program gives up nothing but push there is room; both columns have the same colours.
    grid[0, 0].legend(loc="center right", ncols=3, fontsize=7)
    grid[1, 0].legend(loc="lower right", ncols=3, fontsize=7)
    figure.align_ylabels(grid[:, 0])
    return figure


def draw_flown(flights: Mapping[str, Trace], panels: Sequence[str]) -> Figure:
    """Flights over one another from just before the wall: full lines as shipped, dashes with a switch off."""
    figure = new_figure(0.7 + 1.25 * len(panels))
    grid = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for name, trace in flights.items():
        style = {"color": law_colour(trace.law), "linestyle": "--" if "without" in name else "-"}
        shown = trace.t >= np.nan_to_num(phase_window(trace, "press")[0])
        for axes, panel in zip(grid, panels, strict=True):
            values = SERIES[panel](trace)
            axes.plot(trace.t[shown], values[shown], label=name, **style)
            if trace.reason.startswith("crash"):
                axes.plot(trace.t[-1], values[-1], "x", color=law_colour(trace.law), markersize=7)
    for axes, panel in zip(grid, panels, strict=True):
        axes.set_ylabel(panel)
        if panel == "push [N]":
            asked = next(iter(flights.values())).scene.paint.push_n
            axes.axhline(asked, **REFERENCE)
    grid[-1].set_xlabel("time [s]")
    grid[-1].margins(x=0.0)
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    figure.align_ylabels(grid)
    return figure


def _lines(axes: Axes, t: np.ndarray, wrench: np.ndarray, names: Mapping[int, str]) -> None:
    for (row, name), colour in zip(names.items(), ("#0b6f9e", "#3a8a4d", "#d55e1a"), strict=True):
        axes.plot(t, wrench[:, row], color=colour, label=name, linewidth=0.9)
    axes.axhline(0.0, color="#333333", linewidth=0.5)


def _tint(axes: Axes, flight: ShadowFlight) -> None:
    place = {"transform": axes.get_xaxis_transform(), "linewidth": 0, "zorder": 0}
    axes.fill_between(flight.t, 0, 1, where=(flight.contact_weight > 0.5).tolist(), color=CONTACT, **place)
    axes.fill_between(flight.t, 0, 0.06, where=flight.limited.tolist(), color=LIMITED, **place)
