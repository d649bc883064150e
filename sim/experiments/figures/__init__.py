"""Figures of the experiments, drawn from tables and stored logs only."""

from __future__ import annotations

from collections.abc import Callable

from sim.experiments.figures.bars import draw_bars
from sim.experiments.figures.common import Drawn, Results
from sim.experiments.figures.curves import draw_curves, draw_rows
from sim.experiments.figures.flights import draw_flights, draw_maps, draw_spread
from sim.experiments.figures.wrench_set import draw_wrench_sets
from sim.experiments.spec import FigureSpec

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
