"""Figures of stored flights, as in a run folder; box plots and maps over flights, as in the report of a sweep."""

from __future__ import annotations

from collections.abc import Callable

import polars as pl
from matplotlib.figure import Figure as Canvas

from sim.evaluate.figures import Figure, figure_of
from sim.experiments.figures.common import Drawn, Results, stored_trace
from sim.experiments.spec import FigureSpec
from sim.experiments.variants import VARIANTS
from sim.figures import FIGURES
from sim.sweep.figures.boxes import draw_boxes
from sim.sweep.figures.levels import varied
from sim.sweep.figures.maps import draw_figure_maps
from sim.sweep.spec import LAWS
from sim.sweep.statistics import select


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
    spec: FigureSpec, results: Results, draw: Callable[[pl.DataFrame, Figure, list[str]], Canvas], suffix: str
) -> Drawn:
    drawn: Drawn = {}
    for variant in spec.variants:
        flown = select(results.table, spec.where, variant=variant).filter(pl.col("completed"))
        name, columns = spec.name + (f"-{variant}" if len(spec.variants) > 1 else "") + suffix, varied(flown)
        for metric in (panel.metric for panel in spec.panels if panel.metric in flown.columns and columns):
            words = f"{spec.caption}: {VARIANTS[variant].words}" if len(spec.variants) > 1 else spec.caption
            drawn[f"{name}-{metric}"] = (words, draw(flown, figure_of(metric), columns))
    return drawn
