"""Numbers and cells of the results page as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import polars as pl

from sim.experiments.spec import Column, Experiment
from sim.sweep.statistics import spread


def rounded(value: float, digits: int) -> str:
    """A number with `digits` decimals, without the sign of a rounded zero; a dash if it is not finite."""
    if not np.isfinite(value):
        return "–"
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0.0 else text


def interval(value: Mapping[str, float] | None, column: Column, count: int) -> str:
    """Median of so many flights in the unit of a column, with its bootstrap interval, or minimum and maximum of few."""
    if value is None or not np.isfinite(value["median"]):
        return "–"
    middle, low, high = (rounded(column.scale * value[name], column.digits) for name in ("median", "low", "high"))
    return middle if low == high or "–" in (low, high) else f"{middle} ({spread(low, high, count)})"


def entry(value: Any) -> str:
    """Value of a parameter."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value).replace("_", " ")


def cell(experiment: Experiment, params: Mapping[str, Any]) -> str:
    """Parameters of a cell, e.g. "hold, wall 1500 N/m"."""
    return ", ".join(_parameter(experiment.params.get(name, name), name, value) for name, value in params.items())


def _parameter(heading: str, name: str, value: Any) -> str:
    if name == "kind":
        return entry(value)
    if isinstance(value, bool):
        return heading if value else f"not {heading}"
    if heading.count("[") == 1 and heading.endswith("]"):
        words, unit = heading[:-1].split(" [")
        return f"{words} {entry(value)} {unit}"
    return f"{heading.split(' [')[0]} {entry(value)}"


def varying(listed: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Parameters of each cell without those that are equal in all cells."""
    varied = {name for params in listed for name in params if len({str(each.get(name)) for each in listed}) > 1}
    return [{name: value for name, value in params.items() if name in varied} for params in listed]


def headings(columns: Sequence[Column]) -> list[str]:
    """Labels of columns with their units."""
    return [column.label + (f" [{column.unit}]" if column.unit else "") for column in columns]


def measured(experiment: Experiment, table: pl.DataFrame) -> list[Column]:
    """Columns of an experiment whose metric is in the table."""
    return [column for column in experiment.columns if column.metric in table.columns]


def value_of(metrics: Mapping[str, Any], column: Column, params: Mapping[str, Any]) -> Any:
    """Value of a column in a cell; None if the column does not apply there."""
    return metrics.get(column.metric) if column.where.items() <= params.items() else None
