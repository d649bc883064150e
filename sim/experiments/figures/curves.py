"""Metrics over one parameter, medians with intervals: one row of panels for both laws, or one row per law."""

from __future__ import annotations

import math

import numpy as np
import polars as pl
from matplotlib.axes import Axes

from sim.experiments.figures.common import BOUND, Drawn, Results, legend_with_crosses
from sim.experiments.figures.medians import plot_medians
from sim.experiments.spec import FigureSpec, Line, Panel
from sim.figures.style import REFERENCE, law_colour, law_name, new_figure, note_empty
from sim.sweep.parts import PARAM
from sim.sweep.statistics import select

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
