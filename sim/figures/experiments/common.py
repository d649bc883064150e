"""What the figures of experiments share: kept logs, selection of rows, points with intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
from matplotlib.axes import Axes

from sim.figures.style import law_colour
from sim.flight_log import load_run
from sim.sweep.parts import PARAM
from sim.sweep.statistics import median_interval
from sim.trace import Trace

if TYPE_CHECKING:
    from sim.experiments.base import Results


def select(table: pl.DataFrame, *, law: str | None = None, variant: str | None = None, **params: Any) -> pl.DataFrame:
    """Rows of a law, a variant and parameter values."""
    for name, value in {"law": law, "variant": variant}.items():
        if value is not None:
            table = table.filter(pl.col(name) == value)
    for name, value in params.items():
        if PARAM + name not in table.columns:
            return table.clear()
        table = table.filter(pl.col(PARAM + name) == value)
    return table


def kept_trace(results: Results, rows: pl.DataFrame) -> Trace | None:
    """Log of the first of the rows that has one."""
    names = rows["log"].drop_nulls()
    if not names.len():
        return None
    return next(iter(load_run(results.folder / names[0]).values()))


def plot_medians(
    axes: Axes, rows: pl.DataFrame, x: str, y: str, law: str, *, scale: float = 1.0, shift: float = 0.0, **style: Any
) -> None:
    """Median and interval of a figure over a parameter, with the single flights as faint dots.

    Args:
        axes: Where.
        rows: Rows of one law and variant.
        x: Parameter.
        y: Figure.
        law: Gives the colour.
        scale: Factor of the figure.
        shift: Offset of the points along x, so that laws do not cover each other.
        style: Passed to the line; ``label`` and so on.
    """
    if not rows.height or y not in rows.columns:
        return
    colour = law_colour(law)
    places, middles, low, high = [], [], [], []
    for (place,), group in rows.group_by([PARAM + x], maintain_order=True):
        values = scale * group[y].drop_nulls().to_numpy()
        if not len(values):
            continue
        interval = median_interval(values)
        places.append(float(place) + shift)  # type: ignore[arg-type]
        middles.append(interval["median"])
        low.append(interval["median"] - interval["low"])
        high.append(interval["high"] - interval["median"])
        axes.plot(np.full(len(values), places[-1]), values, ".", color=colour, alpha=0.35, markersize=3, zorder=1)
    order = np.argsort(places)
    take = [np.array(column, float)[order] for column in (places, middles, low, high)]
    axes.errorbar(
        take[0],
        take[1],
        yerr=np.vstack(take[2:]),
        color=colour,
        capsize=2,
        **{"marker": "o", "markersize": 3.5, **style},
    )
