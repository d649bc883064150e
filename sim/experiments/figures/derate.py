"""Derated and lost rotors: push over time around the event, and what is left of it against the reach."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from sim.evaluate.window import event_time, tilt_deg
from sim.experiments.figures.common import kept_trace, select
from sim.figures.style import law_colour, law_name, new_figure
from sim.sweep.parts import PARAM

if TYPE_CHECKING:
    from sim.experiments.base import Results

BEFORE_S, AFTER_S = 2.0, 7.0


def draw_derate(results: Results) -> dict[str, tuple[str, Figure]]:
    """Time series around a derating and around a loss, both laws."""
    figures = {}
    for kind, caption in (("derate", "One rotor derated while pressing"), ("loss", "One rotor lost while pressing")):
        figure = _around(results, kind)
        if figure is not None:
            figures[f"rotor-{kind}"] = (caption, figure)
    return figures


def _around(results: Results, kind: str) -> Figure | None:
    table = select(results.table, kind=kind, told=True)
    if not table.height:
        return None
    cells = table.select(PARAM + "rotor", PARAM + "share").unique(maintain_order=True).rows()
    # The cells in the middle of the table say most: neither harmless nor hopeless.
    rotor, share = cells[len(cells) // 2]
    flown = select(table, rotor=rotor, share=share)
    figure = new_figure(2.8)
    grid = figure.subplots(1, 3)
    for law in ("paper", "qp"):
        trace = kept_trace(results, select(flown, law=law))
        if trace is None:
            continue
        fault = event_time(trace, "fault")
        t = trace.t - fault
        near = (t > -BEFORE_S) & (t < AFTER_S)
        series = (trace.push_true, tilt_deg(trace), np.degrees(np.unwrap(trace.euler[:, 2])))
        for axes, values in zip(grid, series, strict=True):
            axes.plot(t[near], values[near], color=law_colour(law), label=law_name(law), linewidth=0.9)
            if not near[-1] or t[-1] > AFTER_S:
                continue
            if "crash" in str(trace.reason):
                axes.plot(t[near][-1], values[near][-1], "x", color=law_colour(law), markersize=6)
    for axes, label in zip(grid, ("true push [N]", "tilt [deg]", "yaw [deg]"), strict=True):
        axes.axvline(0.0, color="#888888", linewidth=0.8)
        axes.set(xlabel="time since the event [s]", ylabel=label)
    rotor = str(rotor).replace("_", " ")
    reach = flown["reach_n"].drop_nulls() if "reach_n" in flown.columns else flown["seed"].clear()
    if kind == "derate" and reach.len():
        grid[0].axhline(float(reach[0]), color="#888888", linestyle="--", linewidth=0.8)
        grid[0].set_title(f"{rotor} at {100 * float(share):g} %; dashed: reach left")
    elif kind == "derate":
        grid[0].set_title(f"{rotor} at {100 * float(share):g} %")
    else:
        grid[0].set_title(f"{rotor} stopped; x: crash")
    if grid[0].get_legend_handles_labels()[0]:
        grid[0].legend(loc="best")
    return figure
