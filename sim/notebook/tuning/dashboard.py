"""The one picture that answers a change: response at the left, limits, prices and margins at the right."""

from __future__ import annotations

import math

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from sim.evaluate.window import tilt_deg
from sim.figures.style import REFERENCE, law_colour
from sim.flight.trace import Trace
from sim.notebook.tuning.bench import Comparison
from sim.notebook.tuning.comparison import thrust_room
from sim.notebook.tuning.limits_panel import draw_prices
from sim.notebook.tuning.reach_panel import draw_reach

#: Size [in] and place of the panels in it; a fixed layout is drawn in half the time of a fitted one.
SIZE_IN = (11.0, 7.2)
MARGINS = {"left": 0.055, "right": 0.945, "top": 0.92, "bottom": 0.075, "wspace": 0.24, "hspace": 0.3}
#: Names and looks of the three flights.
LOOKS = {
    "analytic": {"color": law_colour("paper"), "linewidth": 0.9},
    "last": {"color": "#6db3d6", "linewidth": 0.9},
    "now": {"color": law_colour("qp"), "linewidth": 1.3},
}
NAMES = {"now": "QP now", "last": "QP before", "analytic": "analytic law"}
#: The first tenths of a second are the vehicle's coming into the hover; scales leave them out [s].
SETTLING_S = 1.0
EVERY = 2
#: Ticks up an axis at most; writing is the dearest part of the drawing.
TICKS = 5
#: Room for the time under the second panel at the right, in shares of the figure's height.
CLOCK_ROOM = 0.03
#: Where a grid is drawn: over the ground, under everything else.
GRID_LAYER = 0.5
#: Places of the axes' labels, in shares of their axes.
X_LABEL, Y_LABEL = (0.5, -0.17), (-0.075, 0.5)


def draw_dashboard(comparison: Comparison) -> Figure:
    """Push, image error, tilt; limits with their prices, room to the limits, and the attainable forces."""
    figure = Figure(figsize=SIZE_IN)
    figure.set_layout_engine("none")
    grid = figure.subplots(3, 2, gridspec_kw={**MARGINS, "width_ratios": [1.0, 1.0], "height_ratios": [1.0, 1.0, 1.15]})
    flights = {name: getattr(comparison, name) for name in LOOKS}
    _draw_push(grid[0, 0], flights)
    _draw_error(grid[1, 0], flights)
    _draw_tilt(grid[2, 0], flights, comparison)
    draw_prices(grid[0, 1], comparison.now, comparison.last)
    _draw_room(grid[1, 1], flights)
    place = grid[2, 1].get_position()
    grid[2, 1].set_position((place.x0, place.y0, place.width, place.height - CLOCK_ROOM))
    draw_reach(grid[2, 1], flights, LOOKS)
    end = max(float(trace.t[-1]) for trace in flights.values())
    _set_time(end, [*grid[:, 0]])
    _set_time(end, [*grid[:2, 1]])
    for axes in figure.axes:
        # Places that are given need no search through every tick's extent: a third of the drawing.
        axes.set_title(axes.get_title(loc="left"), y=1.0)
        axes.xaxis.set_label_coords(*X_LABEL)
        if axes in grid:
            axes.yaxis.set_label_coords(*Y_LABEL)
        if axes in grid and axes is not grid[0, 1]:
            axes.locator_params(axis="y", nbins=TICKS)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    order = [labels.index(name) for name in (*NAMES.values(), "reference")]
    figure.legend([handles[i] for i in order], [labels[i] for i in order], loc="upper left", ncols=4,
                  bbox_to_anchor=(0.05, 1.0), borderaxespad=0.2)  # fmt: skip
    return figure


def _set_time(end: float, column: list[Axes]) -> None:
    """Whole seconds for all axes of a column, written under the lowest."""
    seconds = list(range(math.floor(end) + 1))
    *upper, lowest = column
    for axes in upper:
        # One artist for all lines of the grid: a tick is five, and half of all that is drawn.
        axes.xaxis.set_major_locator(NullLocator())
        axes.vlines(seconds, 0.0, 1.0, transform=axes.get_xaxis_transform(), zorder=GRID_LAYER,
                    colors=rcParams["grid.color"], linewidths=rcParams["grid.linewidth"])  # fmt: skip
        axes.set_xlim(0.0, end)
    lowest.set_xticks(seconds)
    lowest.set(xlim=(0.0, end), xlabel="time [s]")


def _curve(axes: Axes, flights: dict[str, Trace], values: dict[str, np.ndarray]) -> None:
    for name, trace in flights.items():
        axes.plot(trace.t[::EVERY], values[name][::EVERY], label=NAMES[name], **LOOKS[name])  # type: ignore[arg-type]


def _draw_push(axes: Axes, flights: dict[str, Trace]) -> None:
    _curve(axes, flights, {name: trace.push_true for name, trace in flights.items()})
    now = flights["now"]
    axes.plot(now.t[::EVERY], now.push_reference[::EVERY], **REFERENCE, label="reference")
    top = 1.08 * max(float(trace.push_true.max()) for trace in flights.values())
    axes.set(title="push on the board", ylabel="push [N]", ylim=(-0.04 * top, max(top, 1.0)))


def _draw_error(axes: Axes, flights: dict[str, Trace]) -> None:
    errors = {name: trace.line_error_px[:, 0] for name, trace in flights.items()}
    _curve(axes, flights, errors)
    axes.axhline(0.0, color="#333333", linewidth=0.6)
    late = [errors[name][trace.t > SETTLING_S] for name, trace in flights.items()]
    greatest = max([4.0, *(float(np.nanmax(np.abs(part))) for part in late if np.isfinite(part).any())])
    axes.set(
        title="guiding edge in the picture, at the tip", ylabel="error [px]", ylim=(-1.1 * greatest, 1.1 * greatest)
    )


def _draw_tilt(axes: Axes, flights: dict[str, Trace], comparison: Comparison) -> None:
    tilts = {name: tilt_deg(trace) for name, trace in flights.items()}
    _curve(axes, flights, tilts)
    limits = comparison.setting.pilot.controller.limits
    greatest = max(float(tilts[name][trace.t > SETTLING_S].max(initial=0.2)) for name, trace in flights.items())
    if limits.tilt_barrier and limits.tilt_deg < 1.5 * greatest:
        axes.axhline(limits.tilt_deg, color="#b3261e", linewidth=0.9, linestyle=(0, (5, 2)))
        axes.annotate("bound on roll and on pitch", (0.01, limits.tilt_deg), xycoords=("axes fraction", "data"),
                      ha="left", va="bottom", fontsize=7, color="#b3261e")  # fmt: skip
    axes.set(title="tilt of the vehicle", ylabel="tilt [°]", ylim=(0.0, 1.15 * greatest))


def _draw_room(axes: Axes, flights: dict[str, Trace]) -> None:
    _curve(axes, flights, {name: thrust_room(trace) for name, trace in flights.items()})
    axes.axhline(0.0, color="#b3261e", linewidth=0.9)
    axes.set(title="margin to the attainable wrench set: room of the nearest rotor", ylabel="room [N]")
    axes.set_ylim(-0.5, None)
