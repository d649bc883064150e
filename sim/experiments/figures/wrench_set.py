"""The attainable forces in level flight, with the forces that were flown inside it."""

from __future__ import annotations

import numpy as np
import polars as pl
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from allocation import WrenchFacets, control_effectiveness, level_polygon
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from sim.evaluate.window import phase_window
from sim.experiments.figures.common import Drawn, Results, stored_trace
from sim.experiments.spec import FigureSpec
from sim.figures.style import law_name, new_figure
from sim.sweep.parts import PARAM
from sim.sweep.statistics import select

#: One dot in so many ticks.
EVERY = 12
#: Lightest colour used, as a fraction of the map's.
LIGHTEST = 0.9
_WORDS = {
    "standard": "with the reach check",
    "no-reach-check": "without the reach check",
    "clipped": "thrusts clipped after a QP without limits",
}


def draw_wrench_sets(spec: FigureSpec, results: Results) -> Drawn:
    """One figure per variant flown."""
    figures: Drawn = {}
    for variant in spec.variants:
        rows = select(results.table, spec.where, variant=variant)
        if rows.height:
            caption = (
                f"Attainable level forces without moment (shaded) and those flown while pressing, {_WORDS[variant]}; "
                "a dot outside has a moment, or less lift than the weight"
            )
            figures[f"wrench-set-{variant}"] = (caption, draw_wrench_set(results, rows))
    return figures


def draw_wrench_set(results: Results, rows: pl.DataFrame) -> Figure:
    """Level, moment-free forces that the rotors can make, and those flown while pressing, per law.

    Dots are the horizontal part of B u with the thrusts after the motor lag; the polygon is the cut of the attainable
    wrench set at full lift and no moment. A flown wrench with a moment may lie outside it.

    Args:
        results: For its logs.
        rows: Flights to show; the first stored log of each push and law is drawn.
    """
    vehicle = VehicleParams()
    limits = vehicle.thrust_min, vehicle.thrust_max
    corners = level_polygon(WrenchFacets(vehicle.geometry), vehicle.mass_kg * GRAVITY, *limits)
    laws = [law for law in ("qp", "paper") if rows.filter(pl.col("law") == law).height]
    figure = new_figure(3.7)
    colours = colormaps["viridis"]
    for axes, law in zip(figure.subplots(1, len(laws), sharex=True, sharey=True, squeeze=False)[0], laws, strict=True):
        axes.fill(corners[:, 1], corners[:, 0], facecolor="#e9eef1", edgecolor="#888888", linewidth=0.8)
        flown = rows.filter(pl.col("law") == law)
        pushes = sorted(flown[PARAM + "push_n"].unique(), reverse=True)  # smaller ones lie on the way to greater ones
        for push, shade in zip(pushes, np.linspace(LIGHTEST, 0.0, max(len(pushes), 1)), strict=True):
            trace = stored_trace(results, flown.filter(pl.col(PARAM + "push_n") == push))
            if trace is not None:
                begin, end = phase_window(trace, "press")
                wrench = trace.thrusts_actual[(trace.t >= begin) & (trace.t <= end)][::EVERY]
                wrench = wrench @ control_effectiveness(vehicle.geometry).T
                axes.plot(wrench[:, 1], wrench[:, 0], ".", color=colours(float(shade)), markersize=2.5,
                          label=f"{push:g} N commanded")  # fmt: skip
        _dress(axes, law_name(law))
    figure.axes[0].set_ylabel("force to the front [N]")
    return figure


def _dress(axes: Axes, title: str) -> None:
    axes.set(title=title, xlabel="force to the right [N]", xlim=(-32, 32), ylim=(-18, 37))
    axes.set_aspect("equal")
    if axes.lines:
        handles, labels = axes.get_legend_handles_labels()
        axes.legend(handles[::-1], labels[::-1], loc="upper left", fontsize=7, markerscale=3, handletextpad=0.2)
