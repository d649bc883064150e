"""Shared by the figures: rows, stored logs, legend."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl
from matplotlib.figure import Figure

from sim.experiments.spec import Experiment
from sim.figures.style import legend_below
from sim.flight.flight_log import load_run
from sim.flight.trace import Trace

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
