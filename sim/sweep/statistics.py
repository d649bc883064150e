"""Statistics of a table of runs: medians with bootstrap intervals per cell, and a mixed model of law and gains."""

from __future__ import annotations

import math
import warnings
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from scipy.stats import bootstrap, quantile_test

from sim.sweep.parts import HEAD, PARAM

#: Confidence of every interval, and number of resamples.
CONFIDENCE, RESAMPLES = 0.95, 999
#: Seed of the resampling: the same table has the same intervals.
_SEED = 20


def needed() -> int:
    """Fewest values of an interval: fewer leave the sign of their median open at this confidence, for any values."""
    return math.ceil(1.0 - math.log2(1.0 - CONFIDENCE))


def spread(low: str, high: str, count: int) -> str:
    """Ends of `median_interval` of so many values as text: those of an interval, or named minimum and maximum."""
    return f"{low} to {high}" if count >= needed() else f"min {low}, max {high}"


def median_interval(values: np.ndarray) -> dict[str, float]:
    """Median with its percentile bootstrap interval; of fewer than `needed` values with their minimum and maximum.

    Args:
        values: Figures of the flights of one cell; values that are not finite are dropped.

    Returns:
        ``median``, ``low``, ``high``; NaN without values.
    """
    good = np.asarray(values, float)
    good = good[np.isfinite(good)]
    if not len(good):
        return {"median": math.nan, "low": math.nan, "high": math.nan}
    middle = float(np.median(good))
    if len(good) < needed() or np.ptp(good) == 0.0:  # a bootstrap interval of two covers half of the medians
        return {"median": middle, "low": float(good.min()), "high": float(good.max())}
    interval = bootstrap(
        (good,),
        np.median,
        confidence_level=CONFIDENCE,
        n_resamples=RESAMPLES,
        method="percentile",
        vectorized=True,
        rng=np.random.default_rng(_SEED),
    ).confidence_interval
    return {"median": middle, "low": float(interval.low), "high": float(interval.high)}


def figure_names(table: pl.DataFrame) -> list[str]:
    """Columns of figures."""
    return [name for name in table.columns if name not in HEAD and not name.startswith(PARAM)]


def parameters(row: dict[str, Any]) -> dict[str, Any]:
    """Parameters of a row, without those that its cell does not have."""
    return {
        name.removeprefix(PARAM): value for name, value in row.items() if name.startswith(PARAM) and value is not None
    }


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


def split(table: pl.DataFrame, keys: Sequence[str]) -> list[tuple[dict[str, Any], pl.DataFrame]]:
    """Groups of rows with equal columns `keys` and equal parameters, in the order of the table."""
    columns = [*keys, *(name for name in table.columns if name.startswith(PARAM))]
    groups = table.group_by(columns, maintain_order=True)
    return [(dict(zip(columns, values, strict=True)), rows) for values, rows in groups]


def false_claims(rows: pl.DataFrame) -> int:
    """Number of flights that the pilot claims and the truth does not complete; older tables have no claims."""
    return rows.filter(pl.col("claimed") & ~pl.col("completed")).height if "claimed" in rows.columns else 0


def cells(table: pl.DataFrame, of_all: Collection[str] = ()) -> list[dict[str, Any]]:
    """Cells of the contract: law, variant, params, n, completed, false claims, figures with interval and count.

    Only flights that ended as planned have figures: a flight cut short by a crash measures nothing.

    Args:
        table: Rows.
        of_all: Figures that failed flights have as well, such as their duration.
    """
    names, result = figure_names(table), []
    for key, rows in split(table, ("experiment", "law", "variant")):
        done = rows.filter(pl.col("completed"))
        columns = {name: (rows if name in of_all else done)[name].drop_nulls() for name in names}
        counts = {name: len(values) for name, values in columns.items() if len(values)}
        metrics = {name: median_interval(columns[name].to_numpy()) for name in counts}
        cell = {name: key[name] for name in ("experiment", "law", "variant")} | {"params": parameters(key)}
        flown = {"n": rows.height, "completed": done.height, "false_claims": false_claims(rows)}
        result.append(cell | flown | {"metrics": metrics, "counts": counts})
    return result


#: Law and gains of a flight by its law and variant; own gains are those of the law.
CROSSED = {
    ("qp", "standard"): (-0.5, -0.5),
    ("qp", "exchanged-gains"): (-0.5, 0.5),
    ("paper", "shared-gains"): (0.5, -0.5),
    ("paper", "standard"): (0.5, 0.5),
}


class Ratio(NamedTuple):
    """A ratio with its 95 % interval by the model."""

    ratio: float
    low: float
    high: float

    def __str__(self) -> str:
        """Ratio and interval as text."""
        return f"{self.ratio:.2f} ({self.low:.2f} to {self.high:.2f})"


def law_and_gains(table: pl.DataFrame, metric: str) -> Mapping[str, Ratio]:
    """Effects of ``law``, ``gains`` and their ``interaction`` on a figure that is above zero.

    Args:
        table: Flights of the four variants of `CROSSED`.
        metric: Figure; flights that did not end as planned, or without it, are left out.

    Source: `statsmodels.regression.mixed_linear_model.MixedLM`, restricted maximum likelihood.
    """
    import pandas as pd
    import statsmodels.formula.api as smf

    rows = []
    for place, (_, cell) in enumerate(split(table, ("experiment",))):
        for row in cell.filter(pl.col("completed")).iter_rows(named=True):
            crossed, value = CROSSED.get((row["law"], row["variant"])), row[metric]
            if crossed is not None and value is not None and value > 0.0:
                rows.append((place, f"{place}.{row['seed']}", *crossed, np.log(value)))
    data = pd.DataFrame(rows, columns=["cell", "seed", "law", "gains", "y"])
    model = smf.mixedlm("y ~ law * gains", data, groups="cell", re_formula="1", vc_formula={"seed": "0 + C(seed)"})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a variance at its bound of zero is no fault here
        fitted = model.fit(reml=True, method="lbfgs")
    if not fitted.converged:
        return {name: Ratio(math.nan, math.nan, math.nan) for name in ("law", "gains", "interaction")}
    ends = fitted.conf_int()
    names = {"law": "law", "gains": "gains", "interaction": "law:gains"}
    return {
        name: Ratio(*(float(np.exp(value)) for value in (fitted.params[term], *ends.loc[term])))
        for name, term in names.items()
    }


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
