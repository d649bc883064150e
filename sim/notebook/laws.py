"""Notebook 03: the program in the paper's profile against the paper's law, and figures of both laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.figure import Figure

from ibvs_qp.controller import HybridController
from sim.evaluate.window import board_tip, phase_window, tilt_deg
from sim.figures.style import REFERENCE, law_colour, law_name, legend_below, new_figure
from sim.flight.trace import Trace
from sim.notebook.common import (
    BLUE,
    CONTACT,
    FORCES,
    GREEN,
    LIMITED,
    MOMENTS,
    ORANGE,
    shade,
    wrench_curves,
)
from sim.notebook.internals import Tick, paper_profile, record_tick
from sim.notebook.wall_flights import RecordedFlight

#: Lambda from which a tick counts as full contact, and below which as free flight.
FULL, FREE = 0.999, 0.001
#: Smaller differences are rounding [N]; filters have settled after this time [s].
ROUNDING_N, BEGIN_S = 1e-9, 0.3
#: Curves over time by label, from a trace.
CURVES: dict[str, Callable[[Trace], np.ndarray]] = {
    "push [N]": lambda trace: trace.push_true,
    "height [mm]": lambda trace: 1e3 * (board_tip(trace)[:, 1] - trace.scene.paint.edge_margin_m),
    "tilt [deg]": tilt_deg,
    "roll [deg]": lambda trace: np.degrees(trace.euler[:, 0]),
    "yaw [deg]": lambda trace: np.degrees(trace.euler[:, 2]),
}


def agreement(ticks: Sequence[Tick], weights: Sequence[float], every: int = 5) -> dict[str, np.ndarray]:
    """Replay ticks through the program at several weights of the line rows and compare with the analytic law.

    Args:
        ticks: Of one flight, in order.
        weights: Of the line rows.
        every: Ticks between comparisons.

    Returns:
        Largest thrust difference [N], median and worst over the ticks, (weights, 2): "free" in free flight, "contact"
        in full contact with the law as printed, "selected" with the pushing direction removed from L before its
        inversion; and "weight", (weights,).
    """
    rows: dict[str, list] = {"free": [], "contact": [], "selected": []}
    for weight in weights:
        controller, found = HybridController(paper_profile(weight)), {name: [] for name in rows}
        for index, tick in enumerate(ticks):
            controller.step(*tick)
            record = record_tick(controller) if index % every == 0 else None
            if record is None or not record.lines:
                continue
            printed, selected = (np.abs(record.program.free - law).max() for law in (record.law_free, record.selected))
            if record.contact_weight < FREE:
                found["free"].append(printed)
            elif record.contact_weight > FULL:
                found["contact"].append(printed)
                found["selected"].append(selected)
        for name, values in found.items():
            rows[name].append((np.median(values), max(values)) if values else (np.nan, np.nan))
    return {"weight": np.array(weights), **{name: np.array(values) for name, values in rows.items()}}


def draw_agreement(found: dict[str, np.ndarray]) -> Figure:
    """Thrust difference over the weight of the line rows: full lines the worst tick, dots the median."""
    figure = new_figure(3.0)
    axes = figure.subplots()
    for name, label, colour in (
        ("free", "free flight", BLUE),
        ("contact", "contact, as printed: $S\\,L^\\dagger$", ORANGE),
        ("selected", "contact, selected first: $(L S)^\\dagger$", GREEN),
    ):
        middle, worst = found[name].T
        axes.plot(found["weight"], worst, "o-", color=colour, markersize=3.5, label=label)
        axes.plot(found["weight"], middle, ":", color=colour)
    axes.set(xscale="log", yscale="log", xlabel="weight of the line rows over all other targets",
             ylabel="thrust difference [N]", title="Program minus law, same set-points, no limits")  # fmt: skip
    axes.legend()
    return figure


def draw_difference(flight: RecordedFlight) -> Figure:
    """Thrust difference of the two laws tick by tick, and the corresponding wrench difference."""
    figure = new_figure(4.6)
    thrusts, forces, moments = grid = figure.subplots(3, 1, sharex=True)
    for label, difference, colour in (
        ("as commanded", flight.qp - flight.law, "#333333"),
        ("without limits", flight.qp_free - flight.law_free, ORANGE),
    ):
        worst = np.maximum(np.abs(difference).max(axis=1), ROUNDING_N)
        thrusts.plot(flight.t, worst, color=colour, label=label, linewidth=0.8)
    wrench = (flight.qp - flight.law) @ flight.effectiveness.T
    wrench_curves(forces, flight.t, wrench, FORCES)
    wrench_curves(moments, flight.t, wrench, MOMENTS)
    _shade(grid, flight)
    title = "QP minus analytic law; blue: contact, orange: active limit"
    thrusts.set(yscale="log", ylabel="thrusts [N]", title=title, xlim=(min(BEGIN_S, flight.t[-1] / 2), flight.t[-1]))
    forces.set(ylabel="forces [N]", ylim=(-1.0, 1.0))
    moments.set(ylabel="moments [N m]", xlabel="time [s]", ylim=(-0.1, 0.1))
    for axes in grid:
        axes.legend(loc="lower right" if axes is thrusts else "upper right", ncols=3, fontsize=7)
    figure.align_ylabels(grid)
    return figure


def draw_given_up(flight: RecordedFlight) -> Figure:
    """Wrench lost to the limits by each law, against its own unlimited thrusts at the same ticks."""
    figure = new_figure(4.2)
    grid = figure.subplots(2, 2, sharex=True, sharey="row")
    for (forces, moments), law, note in zip(grid.T, ("qp", "paper"), ("flown", "computed, not flown"), strict=True):
        wrench_curves(forces, flight.t, flight.wrench_given_up(law), FORCES)
        wrench_curves(moments, flight.t, flight.wrench_given_up(law), MOMENTS)
        forces.set_title(f"{law_name(law)}, {note}")
        moments.set_xlabel("time [s]")
    _shade(grid.ravel(), flight)
    contact = flight.t[flight.contact_weight > 0.5]
    if len(contact):
        grid[0, 0].set_xlim(contact[0] - 0.1, flight.t[-1])
    grid[0, 0].set_ylabel("unallocated forces [N]")
    grid[1, 0].set_ylabel("unallocated moments [N m]")
    grid[0, 0].legend(loc="center right", ncols=3, fontsize=7)
    grid[1, 0].legend(loc="lower right", ncols=3, fontsize=7)
    figure.align_ylabels(grid[:, 0])
    return figure


def _shade(grid: np.ndarray, flight: RecordedFlight) -> None:
    for axes in grid:
        shade(axes, flight.t, flight.contact_weight > 0.5, CONTACT)
        shade(axes, flight.t, flight.limited, LIMITED, 0.06)


def draw_flown(flights: dict[str, Trace], panels: Sequence[str]) -> Figure:
    """Flights in the same axes from the press on: dashes with a switch off, a cross at a crash."""
    figure = new_figure(0.7 + 1.25 * len(panels))
    grid = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, panel in zip(grid, panels, strict=True):
        for name, trace in flights.items():
            shown, values = trace.t >= np.nan_to_num(phase_window(trace, "press")[0]), CURVES[panel](trace)
            style = {"color": law_colour(trace.law), "linestyle": "--" if "without" in name else "-"}
            axes.plot(trace.t[shown], values[shown], label=name, **style)
            if trace.reason.startswith("crash"):
                axes.plot(trace.t[-1], values[-1], "x", color=style["color"], markersize=7)
            if panel == "push [N]":
                axes.axhline(trace.scene.paint.push_n, **REFERENCE)
        axes.set_ylabel(panel)
    grid[-1].set_xlabel("time [s]")
    grid[-1].margins(x=0.0)
    legend_below(figure)
    figure.align_ylabels(grid)
    return figure
