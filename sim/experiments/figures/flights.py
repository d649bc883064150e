"""Figures of stored flights, as in a run folder, and box plots over flights, as in the report of a sweep."""

from __future__ import annotations

import polars as pl

from sim.evaluate.figures import figure_of
from sim.experiments.figures.common import Drawn, Results, stored_trace
from sim.experiments.spec import FigureSpec
from sim.figures import FIGURES
from sim.sweep.figures.boxes import draw_boxes
from sim.sweep.figures.levels import varied
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
    flown = select(results.table, spec.where, variant=spec.variants[0]).filter(pl.col("completed"))
    metrics = [panel.metric for panel in spec.panels if panel.metric in flown.columns]
    columns = varied(flown)
    return {
        f"{spec.name}-{metric}": (spec.caption, draw_boxes(flown, figure_of(metric), columns))
        for metric in metrics
        if columns
    }
