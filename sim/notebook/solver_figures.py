"""Figures of notebook 05: accuracy against time, ticks of a press one by one, and OSQP's settings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

from sim.figures.style import legend_below, new_figure
from sim.notebook.plots import BLUE, GREEN, LIMITED, ORANGE, shade
from sim.notebook.solvers import NEVER, Result

COLOURS = {
    "OSQP, workspace": BLUE, "shipped": "#c2410c", "active set": GREEN, "qpsolvers": "#8a8a8a", "yours": "#7b3fa0",
}  # fmt: skip
#: Thrust error that is small against the noise of the thrusts [N].
SMALL_N = 1e-2
#: Time between two ticks [us].
TICK_US = 4000.0
#: Offsets of a name from its dot [points], in order of preference, and its alignment.
_OFFSETS = [((x, y), side) for y in (8, -8, 17, -17, 26, -26) for x, side in ((0, "left"), (-6, "right"))]
#: Clearance between names, and around dots and lines [pixels].
_GAP_PX, _DOT_PX = 8.0, 2.0


def draw_race(results: Sequence[Result]) -> Figure:
    """Error of the thrusts (99 % of the ticks) over the time of a tick: dot at the median, line to 99 %."""
    figure = new_figure(4.4)
    axes = figure.subplots()
    places = []
    for one in results:
        error = float(np.nanpercentile(one.errors_n, 99.0))
        middle, slow = np.percentile(one.times_us, [50.0, 99.0])
        star, colour = one.contender.family in ("shipped", "yours"), COLOURS[one.contender.family]
        axes.plot([middle, slow], [error, error], color=colour, linewidth=1.0, alpha=0.5)
        axes.plot(middle, error, "*" if star else "o", color=colour, markersize=11 if star else 5, zorder=3)
        places.append((float(middle), error))
    axes.axhline(SMALL_N, color="#999999", linewidth=0.8, linestyle=":")
    axes.axvline(TICK_US, color="#999999", linewidth=0.8, linestyle=":")
    axes.text(TICK_US, 0.02, " one tick", transform=axes.get_xaxis_transform(), fontsize=7, color="#777777", ha="right",
              rotation=90, va="bottom")  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="time of a tick, median to 99 % [µs]", ylabel="thrust error, 99 % [N]")
    axes.set_title("Lower left is better; below the dotted line the error is negligible")
    families = dict.fromkeys(one.contender.family for one in results)
    legend_below(
        figure, [Line2D([], [], marker="o", linestyle="", color=COLOURS[f], label=f) for f in families], columns=5
    )
    _write_names(figure, axes, results, places)
    return figure


def _write_names(figure: Figure, axes: Axes, results: Sequence[Result], places: list[tuple[float, float]]) -> None:
    """Write the names next to their dots without overlaps with each other, dots or lines."""
    figure.draw_without_rendering()
    points = [axes.transData.transform(line.get_xydata()) for line in axes.lines[: 2 * len(results)]]
    taken = [Bbox((each.min(axis=0) - _DOT_PX, each.max(axis=0) + _DOT_PX)) for each in points]
    for one, place in zip(results, places, strict=True):
        style = {"fontsize": 6.5, "color": COLOURS[one.contender.family], "va": "center"}
        for offset, side in _OFFSETS:
            text = axes.annotate(one.contender.name, place, offset, textcoords="offset points", ha=side, **style)
            box = text.get_window_extent()
            if not any(box.overlaps(other) for other in taken) or (offset, side) == _OFFSETS[-1]:
                taken.append(box.padded(_GAP_PX, 0.0))
                break
            text.remove()


def draw_ticks(t: np.ndarray, limited: np.ndarray, results: Sequence[Result]) -> Figure:
    """Thrust error and iterations tick by tick; tinted where a limit is active."""
    figure = new_figure(3.8)
    errors, iterations = figure.subplots(2, 1, sharex=True)
    for index, one in enumerate(results):
        style = {"color": COLOURS[one.contender.family], "alpha": 0.5**index, "linewidth": 0.9}
        errors.plot(t, one.errors_n, label=one.contender.name, **style)
        iterations.plot(t, one.iterations, **style)
    for axes in (errors, iterations):
        shade(axes, t, limited, LIMITED)
    errors.set(yscale="log", ylabel="thrust error [N]", title="Tinted: active limit")
    iterations.set(ylabel="iterations", xlabel="time of the flight [s]")
    legend_below(figure)
    return figure


def draw_settings(grid: pl.DataFrame, cap: int) -> Figure:
    """Thrust error and iterations over OSQP's tolerance, per interval of step-size updates."""
    figure = new_figure(2.9)
    errors, iterations = figure.subplots(1, 2)
    groups = grid.partition_by("interval", as_dict=True, maintain_order=True)
    for ((interval,), rows), shade_of in zip(groups.items(), np.linspace(0.35, 1.0, len(groups)), strict=True):
        style = {"color": ORANGE if interval >= NEVER else BLUE, "alpha": float(shade_of), "markersize": 3}
        label = "never" if interval >= NEVER else f"every {interval} iterations"
        errors.plot(rows["tolerance"], rows["error_n"], "o-", label=label, **style)
        iterations.plot(rows["tolerance"], rows["iterations_p99"], "o-", **style)
        iterations.plot(rows["tolerance"], rows["iterations"], ":", **style)
    iterations.axhline(cap, color="#999999", linewidth=0.8)
    iterations.text(float(grid["tolerance"].to_numpy().min()), cap, "cap", fontsize=7, va="bottom", color="#777777")
    for axes in (errors, iterations):
        axes.set(xscale="log", xlabel="tolerance (absolute and relative)")
        axes.invert_xaxis()
    errors.set(yscale="log", ylabel="thrust error, 99 % of the ticks [N]", title="Accuracy")
    iterations.set(ylabel="iterations", title="Cost: 99 % of the ticks; dots: median", ylim=(0, None))
    legend_below(figure, title="update of the step size rho", fontsize=7)
    return figure
