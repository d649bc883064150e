"""Differences of flights with the same seed: median, bootstrap interval, and an exact interval for significance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import polars as pl
from scipy.stats import quantile_test

from sim.sweep.statistics import CONFIDENCE, figure_names, median_interval, parameters, split


def exact_interval(values: np.ndarray) -> tuple[float, float]:
    """Interval of the median from order statistics: the inverse of the sign test, valid for any distribution.

    Args:
        values: Differences; values that are not finite are dropped.

    Returns:
        Lower and upper end; NaN of fewer than `needed` values.
    """
    good = np.asarray(values, float)
    interval = quantile_test(good[np.isfinite(good)], p=0.5).confidence_interval(CONFIDENCE)
    return float(interval.low), float(interval.high)


def difference(values: np.ndarray) -> dict[str, float]:
    """Median of differences with its bootstrap interval, ``low`` and ``high``, and its exact one, ``sure_...``."""
    low, high = exact_interval(values)
    return {**median_interval(values), "sure_low": low, "sure_high": high}


def sign(figure: dict[str, float]) -> int:
    """+1 or -1 for a significantly positive or negative difference, else 0."""
    return int(figure["sure_low"] > 0.0) - int(figure["sure_high"] < 0.0)


def differences(first: pl.DataFrame, second: pl.DataFrame, names: Sequence[str]) -> dict[str, Any]:
    """Second minus first, seed by seed, over flights that both ended as planned.

    Args:
        first: Flights of one cell.
        second: Flights of another with the same seeds.
        names: Figures.

    Returns:
        ``flown`` seeds of both, ``n`` of them ended as planned by both, ``failed`` flights of each, and by figure
        ``differences``: ``median``, ``low``
        and ``high`` of the bootstrap, ``pairs``, and ``sure_low`` and ``sure_high`` of the exact interval.
    """
    both = first.join(second, on="seed", suffix=".second", maintain_order="left")
    done = both.filter(pl.col("completed") & pl.col("completed.second"))
    figures = {}
    for name in names:
        values = (done[f"{name}.second"] - done[name]).cast(pl.Float64).fill_null(math.nan).to_numpy()
        if pairs := int(np.isfinite(values).sum()):
            figures[name] = {**difference(values), "pairs": pairs}
    failed = [int((~both[name]).sum()) for name in ("completed", "completed.second")]
    return {"flown": both.height, "n": done.height, "failed": failed, "differences": figures}


def paired_differences(table: pl.DataFrame, names: Sequence[str] | None = None) -> list[dict[str, Any]]:
    """Analytic law minus QP law, seed by seed, per variant and parameters.

    Only flights that both laws ended as planned are compared. A positive difference of an error means that the QP law
    is better.

    Args:
        table: Rows of both laws.
        names: Figures to compare; None takes all.
    """
    result = []
    for key, rows in split(table, ("experiment", "variant")):
        qp, paper = (rows.filter(pl.col("law") == law) for law in ("qp", "paper"))
        found = differences(qp, paper, names or figure_names(table))
        if found["flown"]:
            cell = {"experiment": key["experiment"], "variant": key["variant"], "params": parameters(key)}
            result.append(cell | found)
    return result
