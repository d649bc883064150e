"""Figures of the experiments, drawn from tables and stored logs only."""

from __future__ import annotations

from collections.abc import Callable

from sim.experiments.figures.bars import draw_bars
from sim.experiments.figures.boxes import draw_noise_boxes, draw_spread
from sim.experiments.figures.common import Drawn, Results
from sim.experiments.figures.curves import draw_curves, draw_rows
from sim.experiments.figures.demonstration import draw_demonstrations
from sim.experiments.figures.fault import draw_fault
from sim.experiments.figures.force_hold import draw_force_hold
from sim.experiments.figures.force_map import draw_gain_map
from sim.experiments.figures.path import draw_path_error
from sim.experiments.figures.wrench_set import draw_wrench_sets
from sim.experiments.spec import FigureSpec

#: Functions that draw a figure of a kind; they leave out figures without data.
KINDS: dict[str, Callable[[FigureSpec, Results], Drawn]] = {
    "bars": draw_bars,
    "curves": draw_curves,
    "demonstration": draw_demonstrations,
    "error along the path": draw_path_error,
    "fault": draw_fault,
    "force hold": draw_force_hold,
    "gain map": draw_gain_map,
    "noise boxes": draw_noise_boxes,
    "rows": draw_rows,
    "spread": draw_spread,
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
