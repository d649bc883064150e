"""Accuracy against time, ticks of a press one by one, and OSQP's settings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

from sim.figures.style import LAW_COLOURS, new_figure
from sim.notebook.solvers.programs import Stretch
from sim.notebook.solvers.race import Result
from sim.notebook.solvers.settings_grid import NEVER, SettingsRow

COLOURS = {
    "OSQP, kept": "#0b6f9e",
    "ours": "#c2410c",
    "active set": "#3a8a4d",
    "qpsolvers": "#8a8a8a",
    "yours": "#7b3fa0",
}
#: Tint of ticks at which a limit binds.
LIMITED = "#f1ead9"
#: Thrust noise that nobody would feel: OSQP's tolerance in flight is judged against it [N].
FELT_N = 1e-2
#: Places of a name beside its dot [points] and its alignment, in order of preference.
_BESIDE = (
    ((0, 8), "left"), ((0, -8), "left"), ((-6, 0), "right"), ((0, 8), "right"), ((0, -8), "right"), ((0, 17), "left"),
    ((0, -17), "left"), ((0, 17), "right"), ((0, -17), "right"), ((0, 26), "left"),
)  # fmt: skip
#: Room between two names [pixels].
_GAP_PX = 8.0
#: Half the height that a line or a dot takes from the names [pixels].
_DOT_PX = 2.0


def draw_race(results: Sequence[Result], tick_us: float = 4000.0) -> Figure:
    """Error of the thrusts (99 % of the ticks) over the time of a tick: dot at the median, line to 99 %."""
    figure = new_figure(4.4)
    axes = figure.subplots()
    for one in results:
        colour = COLOURS[one.contender.family]
        error = float(np.nanpercentile(one.errors_n, 99.0))
        middle, slow = np.percentile(one.times_us, [50.0, 99.0])
        axes.plot([middle, slow], [error, error], color=colour, linewidth=1.0, alpha=0.5)
        big = one.contender.family in ("ours", "yours")
        axes.plot(middle, error, "*" if big else "o", color=colour, markersize=11 if big else 5, zorder=3)
    axes.axhline(FELT_N, color="#999999", linewidth=0.8, linestyle=":")
    axes.axvline(tick_us, color="#999999", linewidth=0.8, linestyle=":")
    axes.text(tick_us, 0.02, " one tick", transform=axes.get_xaxis_transform(), fontsize=7, color="#777777", ha="right",
              rotation=90, va="bottom")  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="time of a tick, median to 99 % [µs]", ylabel="thrust error, 99 % [N]")
    axes.set_title("Lower left is better; below the dotted line nobody could feel the error")
    handles = [Line2D([], [], marker="o", linestyle="", color=colour, label=name) for name, colour in COLOURS.items()]
    shown = {one.contender.family for one in results}
    figure.legend(handles=[each for each in handles if each.get_label() in shown], loc="outside lower center", ncols=5)
    _name(figure, axes, results)
    return figure


def _name(figure: Figure, axes: Axes, results: Sequence[Result]) -> None:
    """Write the names beside the dots where they cover neither each other nor a dot or its line."""
    figure.draw_without_rendering()
    points = [line.get_xydata() for line in axes.lines if line.get_transform() == axes.transData]
    pixels = [axes.transData.transform(np.asarray(each)) for each in points]
    taken = [Bbox((each.min(axis=0) - _DOT_PX, each.max(axis=0) + _DOT_PX)) for each in pixels]
    for one in results:
        error, middle = float(np.nanpercentile(one.errors_n, 99.0)), float(np.median(one.times_us))
        for offset, side in _BESIDE:
            text = axes.annotate(
                one.contender.name,
                (middle, error),
                offset,
                textcoords="offset points",
                fontsize=6.5,
                color=COLOURS[one.contender.family],
                ha=side,
                va="center",
            )
            box = text.get_window_extent()
            if not any(box.overlaps(other) for other in taken) or (offset, side) == _BESIDE[-1]:
                taken.append(box.padded(_GAP_PX, 0.0))
                break
            text.remove()


def draw_ticks(stretch: Stretch, results: Sequence[Result]) -> Figure:
    """Thrust error and iterations tick by tick; tinted where a limit binds."""
    figure = new_figure(3.8)
    grid = figure.subplots(2, 1, sharex=True)
    drawn: list[str] = []
    for one in results:
        shade = 0.5 ** drawn.count(one.contender.family)
        drawn.append(one.contender.family)
        style = {"color": COLOURS[one.contender.family], "alpha": shade, "linewidth": 0.9}
        grid[0].plot(stretch.t, one.errors_n, label=one.contender.name, **style)
        grid[1].plot(stretch.t, one.iterations, **style)
    for axes in grid:
        axes.fill_between(stretch.t, 0, 1, where=stretch.limited.tolist(), transform=axes.get_xaxis_transform(),
                          color=LIMITED, linewidth=0, zorder=0)  # fmt: skip
    grid[0].set(yscale="log", ylabel="thrust error [N]", title="Tinted: a limit binds")
    grid[1].set(ylabel="iterations", xlabel="time of the flight [s]")
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def draw_settings(rows: Sequence[SettingsRow], cap: int) -> Figure:
    """Thrust error and iterations over OSQP's tolerance, per interval of step-size updates."""
    figure = new_figure(2.9)
    grid = figure.subplots(1, 2)
    intervals = sorted({row.interval for row in rows})
    for interval, shade in zip(intervals, np.linspace(0.35, 1.0, len(intervals)), strict=True):
        mine = [row for row in rows if row.interval == interval]
        colour = LAW_COLOURS["paper"] if interval >= NEVER else LAW_COLOURS["qp"]
        words = "never" if interval >= NEVER else f"every {interval} iterations"
        x = [row.tolerance for row in mine]
        grid[0].plot(
            x, [row.error_n for row in mine], "o-", markersize=3, color=colour, alpha=float(shade), label=words
        )
        grid[1].plot(x, [row.iterations_p99 for row in mine], "o-", markersize=3, color=colour, alpha=float(shade))
        grid[1].plot(x, [row.iterations for row in mine], ":", color=colour, alpha=float(shade))
    grid[1].axhline(cap, color="#999999", linewidth=0.8)
    grid[1].text(min(row.tolerance for row in rows), cap, "cap", fontsize=7, va="bottom", color="#777777")
    for axes in grid:
        axes.set(xscale="log", xlabel="tolerance (absolute and relative)")
        axes.invert_xaxis()
    grid[0].set(yscale="log", ylabel="thrust error, 99 % of the ticks [N]", title="Accuracy")
    grid[1].set(ylabel="iterations", title="Cost: 99 % of the ticks; dots: median", ylim=(0, None))
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, title="step size rho is updated", fontsize=7)
    return figure
