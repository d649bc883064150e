"""Medians with intervals over a parameter; failed flights as crosses."""

from __future__ import annotations

from typing import Any

import numpy as np
import polars as pl
from matplotlib.axes import Axes

from sim.experiments.figures.common import CRASH
from sim.sweep.parts import PARAM
from sim.sweep.statistics import completed, median_interval

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
