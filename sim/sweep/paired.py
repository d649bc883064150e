"""Differences of flights that share a seed: median, bootstrap interval, and an exact one that says what is sure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import polars as pl
from scipy.stats import binom

from sim.sweep.statistics import CONFIDENCE, figure_names, median_interval, parameters, split


def exact_interval(values: np.ndarray) -> tuple[float, float]:
    """Interval of the median from order statistics: it covers at least as often as it says, whatever the distribution.

    [x_(k), x_(n+1-k)] with the largest k for which a fair coin falls on one side fewer than k times in n with at most
    half of what is left of the confidence: the inverse of the sign test.

    Args:
        values: Differences; what is not finite is left out.

    Returns:
        Lower and upper end; NaN of fewer than six values, of which none is sure at 95 %.

    Source: Conover, Practical Nonparametric Statistics, section 3.2.
    """
    good = np.sort(np.asarray(values, float)[np.isfinite(values)])
    rank = int(binom.ppf((1.0 - CONFIDENCE) / 2.0, len(good), 0.5)) if len(good) else 0
    return (float(good[rank - 1]), float(good[-rank])) if rank else (math.nan, math.nan)


def needed() -> int:
    """Fewest pairs that can make a difference sure."""
    return math.ceil(1.0 - math.log2(1.0 - CONFIDENCE))


def sign(figure: dict[str, float]) -> int:
    """+1 or -1 for a surely positive or negative difference, 0 for one that may be none or has too few pairs."""
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
        if np.isfinite(values).any():
            low, high = exact_interval(values)
            pairs = int(np.count_nonzero(np.isfinite(values)))
            figures[name] = {**median_interval(values), "pairs": pairs, "sure_low": low, "sure_high": high}
    failed = [int((~both[name]).sum()) for name in ("completed", "completed.second")]
    return {"flown": both.height, "n": done.height, "failed": failed, "differences": figures}


def paired_differences(table: pl.DataFrame, names: Sequence[str] | None = None) -> list[dict[str, Any]]:
    """Analytic law minus QP law, seed by seed, per variant and parameters.

    Only flights that both laws ended as planned are compared: what a crash cut short measures nothing. A positive
    difference of an error means that the QP law is better.

    Args:
        table: Rows of both laws.
        names: Figures to compare; None takes all.
    """
    result = []
    for key, rows in split(table, ("experiment", "variant")):
        laws = {law: rows.filter(pl.col("law") == law) for law in ("qp", "paper")}
        found = differences(laws["qp"], laws["paper"], list(names or figure_names(table)))
        if found["flown"]:
            cell = {"experiment": key["experiment"], "variant": key["variant"], "params": parameters(key)}
            result.append(cell | found)
    return result


def variant_differences(
    table: pl.DataFrame, references: Mapping[str, Sequence[str]], names: Sequence[str] | None = None
) -> list[dict[str, Any]]:
    """Each variant minus the one it is judged against, per law and parameters, seed by seed.

    Args:
        table: Rows of some variants.
        references: For each variant what it is judged against; the first that flew in the same cell.
        names: Figures to compare; None takes all.
    """
    result = []
    for key, rows in split(table, ("experiment", "law")):
        flown = {str(name): part for (name,), part in rows.group_by("variant", maintain_order=True)}
        for variant, part in flown.items():
            against = next((name for name in references.get(variant, ()) if name in flown and name != variant), None)
            if against is None:
                continue
            found = differences(flown[against], part, list(names or figure_names(table)))
            if found["flown"]:
                cell = {"experiment": key["experiment"], "law": key["law"], "variant": variant, "against": against}
                result.append(cell | {"params": parameters(key)} | found)
    return result
