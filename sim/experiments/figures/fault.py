"""Push, tilt and yaw over time around a fault: a derated or a lost rotor."""

from __future__ import annotations

import numpy as np
import polars as pl
from matplotlib.axes import Axes

from sim.evaluate.window import event_time, tilt_deg
from sim.experiments.figures.common import Drawn, Results, stored_trace
from sim.experiments.spec import FigureSpec
from sim.figures.style import law_colour, law_name, new_figure
from sim.sweep.parts import PARAM
from sim.sweep.statistics import select

#: Shown before and after the fault [s].
BEFORE_S, AFTER_S = 2.0, 7.0


def draw_fault(spec: FigureSpec, results: Results) -> Drawn:
    """Three time series of both laws for the cell in the middle of the table, neither harmless nor hopeless."""
    table = select(results.table, spec.where)
    if not table.height:
        return {}
    cells = table.select(PARAM + "rotor", PARAM + "share").unique(maintain_order=True).rows()
    rotor, share = cells[len(cells) // 2]
    flown = select(table, rotor=rotor, share=share)
    figure = new_figure(2.8)
    grid = figure.subplots(1, 3)
    for law in ("paper", "qp"):
        trace = stored_trace(results, select(flown, law=law, variant="standard"))
        if trace is None:
            continue
        t = trace.t - event_time(trace, "fault")
        near = (t > -BEFORE_S) & (t < AFTER_S)
        series = (trace.push_true, tilt_deg(trace), np.degrees(np.unwrap(trace.euler[:, 2])))
        for axes, values in zip(grid, series, strict=True):
            axes.plot(t[near], values[near], color=law_colour(law), label=law_name(law), linewidth=0.9)
            if near[-1] and t[-1] <= AFTER_S and "crash" in str(trace.reason):
                axes.plot(t[near][-1], values[near][-1], "x", color=law_colour(law), markersize=6)
    for axes, label in zip(grid, ("true push [N]", "tilt [deg]", "yaw [deg]"), strict=True):
        axes.axvline(0.0, color="#888888", linewidth=0.8)
        axes.set(xlabel="time since the event [s]", ylabel=label)
    _title(grid[0], flown, str(rotor).replace("_", " "), float(share))
    if grid[0].get_legend_handles_labels()[0]:
        grid[0].legend(loc="best")
    return {spec.name: (spec.caption, figure)}


def _title(axes: Axes, flown: pl.DataFrame, rotor: str, share: float) -> None:
    """Name the fault; for a derated rotor draw the reach that is left."""
    if share == 0.0:
        axes.set_title(f"{rotor} stopped; x: crash")
        return
    title = f"{rotor} at {100 * share:g} %"
    reach = flown["reach_n"].drop_nulls() if "reach_n" in flown.columns else pl.Series([])
    if reach.len():
        axes.axhline(float(reach[0]), color="#888888", linestyle="--", linewidth=0.8)
        title += "; dashed: reach left"
    axes.set_title(title)
