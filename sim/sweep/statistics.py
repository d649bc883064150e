"""What a table of runs says: medians with bootstrap intervals per cell, and paired differences between the laws."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import polars as pl
from scipy.stats import bootstrap

from sim.sweep.parts import HEAD, PARAM

#: Confidence of every interval, and number of resamples.
CONFIDENCE, RESAMPLES = 0.95, 999
#: Seed of the resampling: the same table has the same intervals.
_SEED = 20


def median_interval(values: np.ndarray) -> dict[str, float]:
    """Median with its percentile bootstrap interval; of a single value, or equal ones, the value itself.

    Args:
        values: Figures of the flights of one cell; what is not finite is left out.

    Returns:
        ``median``, ``low``, ``high``; NaN of nothing.
    """
    good = np.asarray(values, float)
    good = good[np.isfinite(good)]
    if not len(good):
        return {"median": math.nan, "low": math.nan, "high": math.nan}
    middle = float(np.median(good))
    if len(good) < 2 or np.ptp(good) == 0.0:
        return {"median": middle, "low": middle, "high": middle}
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
    """Columns that hold figures."""
    return [name for name in table.columns if name not in HEAD and not name.startswith(PARAM)]


def parameters(row: dict[str, Any]) -> dict[str, Any]:
    """Parameters of a row, without those that its cell does not have."""
    return {
        name.removeprefix(PARAM): value for name, value in row.items() if name.startswith(PARAM) and value is not None
    }


def split(table: pl.DataFrame, keys: Sequence[str]) -> list[tuple[dict[str, Any], pl.DataFrame]]:
    """Groups of rows alike in some columns and in all parameters, in the order of the table."""
    columns = [*keys, *(name for name in table.columns if name.startswith(PARAM))]
    groups = table.group_by(columns, maintain_order=True)
    return [(dict(zip(columns, values, strict=True)), rows) for values, rows in groups]


def cells(table: pl.DataFrame) -> list[dict[str, Any]]:
    """Cells of the contract: law, variant, params, n, completed, and every figure with its interval."""
    names, result = figure_names(table), []
    for key, rows in split(table, ("experiment", "law", "variant")):
        metrics = {name: median_interval(rows[name].to_numpy()) for name in names if rows[name].drop_nulls().len()}
        result.append(
            {
                "experiment": key["experiment"],
                "law": key["law"],
                "variant": key["variant"],
                "params": parameters(key),
                "n": rows.height,
                "completed": int(rows["completed"].sum()),
                "metrics": metrics,
            }
        )
    return result


def paired_differences(table: pl.DataFrame, names: Sequence[str] | None = None) -> list[dict[str, Any]]:
    """Analytic law minus QP law, seed by seed, per variant and parameters: median with interval.

    An interval without zero says that the sign of the difference is no accident of the seeds; a positive difference
    of an error means that the QP law is better.

    Args:
        table: Rows of both laws.
        names: Figures to compare; None takes all.
    """
    wanted = list(names or figure_names(table))
    result = []
    for key, rows in split(table, ("experiment", "variant")):
        both = rows.filter(pl.col("law") == "qp").join(
            rows.filter(pl.col("law") == "paper"), on="seed", suffix=".paper", maintain_order="left"
        )
        if not both.height:
            continue
        figures = {}
        for name in wanted:
            difference = (both[f"{name}.paper"] - both[name]).cast(pl.Float64).to_numpy()
            if np.isfinite(difference).any():
                figures[name] = median_interval(difference)
        result.append(
            {
                "experiment": key["experiment"],
                "variant": key["variant"],
                "params": parameters(key),
                "n": both.height,
                "differences": figures,
            }
        )
    return result


def same_cell(params: dict[str, Any], wanted: dict[str, Any]) -> bool:
    """Whether a cell has the wanted values of the wanted parameters."""
    return all(name in params and params[name] == value for name, value in wanted.items())


def cell_name(cell: dict[str, Any]) -> str:
    """Law, variant and parameters of a cell as one text."""
    return f"{cell['law']} {cell['variant']} {json.dumps(cell['params'])}"
