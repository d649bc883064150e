"""What the figures of experiments share: kept logs, selection of rows, points with intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sim.figures.style import law_colour
from sim.flight.flight_log import load_run
from sim.flight.trace import Trace
from sim.sweep.parts import PARAM
from sim.sweep.statistics import median_interval

if TYPE_CHECKING:
    from sim.experiments.base import Results

#: Marks the crosses of failed flights among the lines of an axis.
CRASH = "crash"


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
    axes: Axes,
    rows: pl.DataFrame,
    x: str,
    y: str,
    law: str,
    *,
    scale: float = 1.0,
    shift: float = 0.0,
    top: float | None = None,
    **style: Any,
) -> None:
    """Median and interval of a figure over a parameter, with the single flights as faint dots.

    A flight that did not end as planned enters neither: it is a cross, at its value or at the top of the axis.

    Args:
        axes: Where.
        rows: Rows of one law and variant.
        x: Parameter.
        y: Figure.
        law: Gives the colour.
        scale: Factor of the figure.
        shift: Offset of the points along x, so that laws do not cover each other; a factor on a logarithmic axis.
        top: Highest value shown; what lies above is an open triangle there.
        style: Passed to the line; ``label``, ``color`` and so on.
    """
    if not rows.height or y not in rows.columns:
        return
    colour = style.pop("color", law_colour(law))
    logarithmic = axes.get_xscale() == "log"
    places, middles, low, high = [], [], [], []
    for (place,), group in rows.group_by([PARAM + x], maintain_order=True):
        at = float(place) * (1.0 + shift) if logarithmic else float(place) + shift  # type: ignore[arg-type]
        _crashes(axes, scale * group.filter(~pl.col("completed"))[y].to_numpy().astype(float), at, colour, top)
        values = scale * group.filter(pl.col("completed"))[y].drop_nulls().to_numpy()
        if not len(values):
            continue
        interval = median_interval(values)
        places.append(at)
        middles.append(interval["median"])
        low.append(interval["median"] - interval["low"])
        high.append(interval["high"] - interval["median"])
        axes.plot(np.full(len(values), at), values, ".", color=colour, alpha=0.35, markersize=3, zorder=1)
        if top is not None and np.any(values > top):
            axes.plot(at, 0.975 * top, "^", color=colour, markerfacecolor="none", markersize=4, clip_on=False)
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


def _crashes(axes: Axes, values: np.ndarray, at: float, colour: str, top: float | None) -> None:
    """A cross per flight that failed; one without the figure, or beyond the axis, is drawn at the axis' top."""
    mark = {"marker": "x", "linestyle": "none", "color": colour, "markersize": 5, "gid": CRASH, "clip_on": False}
    for value in values:
        if np.isfinite(value) and (top is None or value <= top):
            axes.plot(at, value, **mark)
        else:
            axes.plot(at, 0.97, transform=axes.get_xaxis_transform(), **mark)


def legend_below(figure: Figure, columns: int, **style: Any) -> None:
    """One legend for all axes, under them; it says what crosses are, where there are any."""
    entries: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if any(line.get_gid() == CRASH for axes in figure.axes for line in axes.lines):
        mark = Line2D([], [], marker="x", linestyle="none", color="#555555", markersize=5)
        entries["did not end as planned (at the top: beyond the axis)"] = mark
    if entries:
        figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=columns, **style)
