"""Shared by the figures: rows, stored logs, boxes, legend."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sim.experiments.spec import Experiment
from sim.figures.style import law_colour
from sim.flight.flight_log import load_run
from sim.flight.trace import Trace
from sim.sweep.parts import PARAM

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


def select(table: pl.DataFrame, where: Mapping[str, Any] | None = None, **more: Any) -> pl.DataFrame:
    """Rows with a law, a variant and parameter values."""
    for name, value in {**(where or {}), **more}.items():
        column = name if name in ("law", "variant") else PARAM + name
        if column not in table.columns:
            return table.clear()
        table = table.filter(pl.col(column) == value)
    return table


def completed(rows: pl.DataFrame, metric: str) -> np.ndarray:
    """Values of a metric in the flights that ended as planned."""
    return rows.filter(pl.col("completed"))[metric].drop_nulls().to_numpy()


def stored_trace(results: Results, rows: pl.DataFrame) -> Trace | None:
    """Log of the first of the rows that has one."""
    names = rows["log"].drop_nulls()
    if not names.len():
        return None
    return next(iter(load_run(results.folder / names[0]).values()))


def draw_box(axes: Axes, values: np.ndarray, place: float, width: float, law: str) -> None:
    """Box plot of one law at a place along x."""
    boxes = axes.boxplot(
        [values],
        positions=[place],
        widths=width,
        patch_artist=True,
        manage_ticks=False,
        medianprops={"color": "#222222"},
        flierprops={"markersize": 3, "marker": "."},
    )
    boxes["boxes"][0].set(facecolor=law_colour(law), alpha=0.5, linewidth=0.6)


def note_empty(axes: Axes, text: str) -> None:
    """Write why an axis has no data."""
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", color="#777777")


def legend_below(figure: Figure, columns: int, **style: Any) -> None:
    """One legend for all axes, below them; it explains crosses if there are any."""
    entries: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if any(line.get_gid() == CRASH for axes in figure.axes for line in axes.lines):
        mark = Line2D([], [], marker="x", linestyle="none", color="#555555", markersize=5)
        entries["did not end as planned (at the top: beyond the axis)"] = mark
    if entries:
        figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=columns, **style)
