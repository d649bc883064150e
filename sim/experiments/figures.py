"""Figures of the experiments, drawn from tables and stored logs only."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from allocation import WrenchFacets, control_effectiveness, level_polygon
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from sim.evaluate.figures import Figure as Measured
from sim.evaluate.figures import figure_of
from sim.evaluate.window import phase_window
from sim.experiments.spec import Experiment, FigureSpec, Line, Panel
from sim.experiments.variants import VARIANTS
from sim.figures import FIGURES
from sim.figures.style import REFERENCE, law_colour, law_name, legend_below, new_figure, note_empty
from sim.flight.flight_log import load_run
from sim.flight.trace import Trace
from sim.sweep.figures.levels import varied
from sim.sweep.figures.maps import draw_boxes, draw_figure_maps
from sim.sweep.parts import PARAM
from sim.sweep.spec import LAWS
from sim.sweep.statistics import completed, median_interval, select

#: Caption and figure by file name.
Drawn = dict[str, tuple[str, Figure]]
#: Group identifier of the crosses of failed flights among the lines of an axis.
CRASH = "crash"
#: Line of a bound.
BOUND = {"color": "#555555", "linestyle": (0, (6, 3))}


@dataclass(frozen=True)
class Results:
    """Data of the figures of an experiment."""

    experiment: Experiment
    table: pl.DataFrame  # one row per flight
    folder: Path  # of the stored logs


def stored_trace(results: Results, rows: pl.DataFrame) -> Trace | None:
    """Log of the first of the rows that has one."""
    names = rows["log"].drop_nulls()
    if not names.len():
        return None
    return next(iter(load_run(results.folder / names[0]).values()))


def legend_with_crosses(figure: Figure, columns: int = 3, **style: Any) -> None:
    """One legend for all axes, below them; it explains crosses if there are any."""
    if any(line.get_gid() == CRASH for axes in figure.axes for line in axes.lines):
        label = "did not end as planned (at the top: beyond the axis)"
        figure.axes[-1].plot([], [], "x", color="#555555", markersize=5, label=label)
    legend_below(figure, None, columns, **style)


#: Height of a cross without value or beyond the axis, and of a triangle above `top`, as fractions of the axis.
_CRASH_HEIGHT, _BEYOND_HEIGHT = 0.97, 0.975


def plot_medians(
    axes: Axes,
    rows: pl.DataFrame,
    x: str,
    y: str,
    color: str,
    *,
    scale: float = 1.0,
    shift: float = 0.0,
    top: float = np.inf,
    **style: Any,
) -> None:
    """Median and interval of a metric over a parameter; single flights as faint dots.

    A flight that did not end as planned enters neither: it is a cross, at its value or at the top of the axis.

    Args:
        axes: Axes to draw on.
        rows: Rows of one law and variant.
        x: Parameter.
        y: Metric.
        color: Colour.
        scale: Factor of the metric.
        shift: Offset of the points along x, so that lines do not overlap; a relative one on a logarithmic axis.
        top: Highest value shown; an open triangle marks values above.
        style: Passed to the line; ``label``, ``linestyle`` and so on.
    """
    if not rows.height or y not in rows.columns:
        return
    logarithmic = axes.get_xscale() == "log"
    points = []
    for (place,), group in rows.group_by([PARAM + x], maintain_order=True):
        at = float(place) * (1.0 + shift) if logarithmic else float(place) + shift  # type: ignore[arg-type]
        failed = group.filter(~pl.col("completed"))[y].to_numpy().astype(float)
        _crosses(axes, scale * failed, at, color, top)
        values = scale * completed(group, y)
        if not len(values):
            continue
        interval = median_interval(values)
        middle = interval["median"]
        points.append((at, middle, middle - interval["low"], interval["high"] - middle))
        axes.plot(np.full(len(values), at), values, ".", color=color, alpha=0.35, markersize=3, zorder=1)
        if np.any(values > top):
            axes.plot(at, _BEYOND_HEIGHT * top, "^", color=color, markerfacecolor="none", markersize=4, clip_on=False)
    places, middles, low, high = np.array(sorted(points), float).reshape(-1, 4).T
    line = {"marker": "o", "markersize": 3.5, **style}
    axes.errorbar(places, middles, yerr=np.vstack((low, high)), color=color, capsize=2, **line)


def _crosses(axes: Axes, values: np.ndarray, at: float, color: str, top: float) -> None:
    """A cross per failed flight; at the top of the axis if it has no value or lies beyond."""
    mark = {"marker": "x", "linestyle": "none", "color": color, "markersize": 5, "gid": CRASH, "clip_on": False}
    for value in values:
        if np.isfinite(value) and value <= top:
            axes.plot(at, value, **mark)
        else:
            axes.plot(at, _CRASH_HEIGHT, transform=axes.get_xaxis_transform(), **mark)


#: Width of the bars of a value together; values of the parameter are one apart.
_WIDTH = 0.76
#: Opacity of the bars of each variant as a ratio of that of the one before; the first is opaque.
_PALER = 0.6


def draw_bars(spec: FigureSpec, results: Results) -> Drawn:
    """Bars per value of the parameter: one per law, and per variant of the figure with flights of the law."""
    table = select(results.table, spec.where)
    if not table.height:
        return {}
    series = [
        (law, variant) for law in LAWS for variant in spec.variants if select(table, law=law, variant=variant).height
    ]
    bar = _WIDTH / max(len(series), 1)
    values = list(table[PARAM + spec.x].unique(maintain_order=True))
    figure = new_figure(0.9 + 0.3 * len(values))
    grid = figure.subplots(1, len(spec.panels), sharey=True)
    crashed = False
    for axes, panel in zip(grid, spec.panels, strict=True):
        for index, (law, variant) in enumerate(series):
            rows = [select(table, {spec.x: value}, law=law, variant=variant) for value in values]
            found = [median_interval(completed(row, panel.metric)) for row in rows]
            middle, low, high = (
                panel.scale * np.array([entry[part] for entry in found]) for part in ("median", "low", "high")
            )
            places = np.arange(len(values)) + (index - 0.5 * (len(series) - 1)) * bar
            order = spec.variants.index(variant)
            label = law_name(law) + (f", {variant}" if order else "")
            axes.barh(places, middle, height=bar, color=law_colour(law), alpha=_PALER**order, label=label)
            ends = np.vstack((middle - low, high - middle))
            axes.errorbar(middle, places, xerr=ends, fmt="none", ecolor="#333333", capsize=1.5, linewidth=0.8)
            for place, row in zip(places, rows, strict=True):
                failed = int((~row["completed"]).sum())
                if failed:
                    axes.text(0.02, place, f"x {failed}", transform=axes.get_yaxis_transform(), va="center",
                              fontsize=7, color="#222222")  # fmt: skip
                    crashed = True
        axes.set_xlabel(panel.label)
        axes.grid(visible=False, axis="y")
    grid[0].set_yticks(range(len(values)), ["no error" if value == "nothing" else value for value in values])
    grid[0].set_ylim(len(values) - 0.4, -0.6)
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    note = "; x: flights that did not end as planned, left out" if crashed else ""
    return {spec.name: (spec.caption + note, figure)}


#: Line style of the variants, in the order given.
_DASHES = ("-", ":", "--", "-.")
#: Parameters that span a decade.
_LOGARITHMIC = ("stiffness_n_m",)
#: Distance of the two laws along x: relative on a logarithmic axis, else as a fraction of the range.
_APART_LOG, _APART = 0.04, 0.024
#: Distance between the lines of one panel of `draw_rows` along x [N].
_APART_N = 0.28


def draw_curves(spec: FigureSpec, results: Results) -> Drawn:
    """One row of panels with both laws and every variant flown."""
    figure = new_figure(2.9)
    flown = results.table["variant"].unique(maintain_order=True).to_list()
    variants = [*spec.variants, *(variant for variant in flown if variant not in spec.variants)]
    for axes, panel in zip(figure.subplots(1, len(spec.panels), squeeze=False)[0], spec.panels, strict=True):
        _panel(axes, results, panel, spec.x, variants)
        axes.set(xlabel=panel.xlabel or spec.xlabel, ylabel=panel.label)
    legend_with_crosses(figure, fontsize=7.5)
    return {spec.name: (spec.caption, figure)}


def _panel(axes: Axes, results: Results, panel: Panel, x: str, variants: list[str]) -> None:
    table = select(results.table, panel.where)
    values = table[PARAM + x].drop_nulls() if PARAM + x in table.columns else pl.Series([], dtype=pl.Float64)
    places = sorted(float(value) for value in values.unique())
    apart = _APART * (places[-1] - places[0]) if places else 0.0
    if x in _LOGARITHMIC and len(places) > 1:
        axes.set_xscale("log")
        axes.set_xticks(places, [f"{place:g}" for place in places], rotation=45)
        axes.minorticks_off()
        apart = _APART_LOG
    for law, side in (("qp", -0.5), ("paper", 0.5)):
        for variant, dash in zip(variants, _DASHES, strict=False):
            label = law_name(law) + (f", {variant}" if len(variants) > 1 else "")
            plot_medians(
                axes, select(table, law=law, variant=variant), x, panel.metric, law_colour(law), scale=panel.scale,
                shift=side * apart, linestyle=dash, label=label, linewidth=1.0,
            )  # fmt: skip
    if axes.lines:
        _bounds(axes, results, panel, x, places)
        axes.set_ylim(0.0, max(1.12 * float(axes.dataLim.y1), 1e-9))
    else:
        note_empty(axes, "no data")


def _bounds(axes: Axes, results: Results, panel: Panel, x: str, places: list[float]) -> None:
    """Criteria of the QP law as thin lines over the cells that they apply to."""
    step = min(np.diff(places), default=1.0)
    for criterion in results.experiment.every_criterion():
        where = dict(criterion.where)
        at = where.pop(x, None)
        fits = all(panel.where.get(name, value) == value for name, value in where.items())
        if criterion.metric != panel.metric or criterion.variant != "standard" or not fits:
            continue
        low, high = (places[0], places[-1]) if at is None else (float(at) - 0.4 * step, float(at) + 0.4 * step)
        bound = panel.scale * criterion.bound
        axes.plot([low, high], [bound, bound], linewidth=0.7, label="bound", **BOUND)


def draw_rows(spec: FigureSpec, results: Results) -> Drawn:
    """One row of panels per law over the commanded push, with given lines and the reach."""
    table = select(results.table, spec.where)
    if not table.height or table[PARAM + spec.x].n_unique() < 2:
        return {}
    figure = new_figure(5.0)
    grid = figure.subplots(2, len(spec.panels), sharex=True, sharey="col")
    for row, law in zip(grid, ("qp", "paper"), strict=True):
        for axes, panel in zip(row, spec.panels, strict=True):
            for place, line in enumerate(spec.lines):
                shift = _APART_N * (place - (len(spec.lines) - 1) / 2)
                plot_medians(
                    axes, select(table, line.where, law=law, variant=line.variant), spec.x, panel.metric, line.color,
                    scale=panel.scale, shift=shift, top=panel.top, label=line.label, linewidth=1.0,
                )  # fmt: skip
            axes.set_ylabel(panel.label if axes is not row[0] else f"{law_name(law)}\n{panel.label}")
        _reaches(row[0], table, spec.x, spec.lines)
    for axes, panel in zip(grid[0], spec.panels, strict=True):
        axes.set_ylim(0.0, panel.top if math.isfinite(panel.top) else None)
    for axes in grid[-1]:
        axes.set_xlabel(spec.xlabel)
    legend_with_crosses(figure, fontsize=7.5)
    return {spec.name: (spec.caption, figure)}


def _reaches(axes: Axes, table: pl.DataFrame, x: str, lines: tuple[Line, ...]) -> None:
    """The diagonal of delivered as commanded, and the reach of each line."""
    ends = np.array([table[PARAM + x].min(), table[PARAM + x].max()], float)
    axes.plot(ends, ends, **REFERENCE)
    seen = set()
    for line in lines:
        reach = select(table, line.where, variant=line.variant)["reach_n"].drop_nulls()
        if reach.len() and (value := round(float(reach[0]), 1)) not in seen:
            seen.add(value)
            axes.axhline(value, color="#888888", linewidth=0.8)
            axes.text(ends[0], value, f" reach {value:g} N", va="bottom", fontsize=7, color="#666666")


def draw_flights(spec: FigureSpec, results: Results) -> Drawn:
    """The figures `draw` of the first stored flight of each law."""
    traces = {}
    for law in LAWS:
        rows = select(results.table, spec.where, law=law, variant=spec.variants[0])
        if (trace := stored_trace(results, rows)) is not None and len(trace.t):
            traces[law] = trace
    drawn = {name: FIGURES[name] for name in spec.draw if traces}
    return {f"{spec.name}-{name}": (f"{spec.caption}: {words}", draw(traces)) for name, (words, draw) in drawn.items()}


def draw_spread(spec: FigureSpec, results: Results) -> Drawn:
    """Box plots of the panels' metrics over every parameter that varies."""
    return _over_parameters(spec, results, draw_boxes, "")


def draw_maps(spec: FigureSpec, results: Results) -> Drawn:
    """Heat maps of the panels' metrics over every pair of parameters that vary, one figure per variant."""
    return _over_parameters(spec, results, draw_figure_maps, "-map")


def _over_parameters(
    spec: FigureSpec, results: Results, draw: Callable[[pl.DataFrame, Measured, list[str]], Figure], suffix: str
) -> Drawn:
    drawn: Drawn = {}
    for variant in spec.variants:
        flown = select(results.table, spec.where, variant=variant).filter(pl.col("completed"))
        name, columns = spec.name + (f"-{variant}" if len(spec.variants) > 1 else "") + suffix, varied(flown)
        for metric in (panel.metric for panel in spec.panels if panel.metric in flown.columns and columns):
            words = f"{spec.caption}: {VARIANTS[variant].words}" if len(spec.variants) > 1 else spec.caption
            drawn[f"{name}-{metric}"] = (words, draw(flown, figure_of(metric), columns))
    return drawn


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


#: Functions that draw a figure of a kind; they leave out figures without data.
KINDS: dict[str, Callable[[FigureSpec, Results], Drawn]] = {
    "bars": draw_bars,
    "boxes": draw_spread,
    "curves": draw_curves,
    "flights": draw_flights,
    "maps": draw_maps,
    "rows": draw_rows,
    "wrench sets": draw_wrench_sets,
}

__all__ = ["KINDS", "Results", "draw"]


def draw(results: Results) -> Drawn:
    """All figures of an experiment: caption and figure by file name."""
    return {
        name: drawn
        for figure in results.experiment.figures
        for name, drawn in KINDS[figure.kind](figure, results).items()
    }
