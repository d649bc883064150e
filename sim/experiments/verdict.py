"""Evaluation of the criteria on the table of flights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from sim.experiments.spec import Column, Criterion, Experiment
from sim.sweep.statistics import parameters, select, split, spread


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


#: Folder of the tables of `Bound.before`.
GOALS = Path(__file__).with_name("goals")


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One criterion in one cell; values in the unit of the criterion, NaN without data."""

    criterion: Criterion
    params: dict[str, Any]  # the cell
    place: dict[str, Any]  # parameters in which it differs from other cells of the criterion
    median: float  # of its flights
    worst: float  # worst flight
    within: int  # flights within the bound
    known: int  # flights with a value; failed flights count only if the criterion includes them
    n: int  # flights
    measured: bool  # whether the table has the metric

    @property
    def met(self) -> bool:
        """Whether enough flights have a value, and the statistic of the criterion is within the bound."""
        enough = self.criterion.share * self.n
        if not self.n or self.known < enough:
            return False
        if self.criterion.every:
            return self.within >= enough
        return bool(self.median >= self.bound if self.criterion.least else self.median <= self.bound)

    @property
    def words(self) -> str:
        """``yes`` or ``no``, with the count of flights if only the median is within the bound."""
        if not self.measured:
            return "not measured"
        if self.met and self.within < self.n:
            return f"yes ({'' if self.criterion.every else 'median; '}{self.within} of {self.n})"
        return "yes" if self.met else "no"

    @property
    def bound(self) -> float:
        """The bound in the unit of the criterion."""
        return self.criterion.scale * self.criterion.bound


def verdicts(experiment: Experiment, table: pl.DataFrame) -> list[Verdict]:
    """Verdict of each criterion in each cell that it applies to."""
    result = []
    for criterion in experiment.every_criterion() if table.height else ():
        rows = select(table, criterion.where, law=criterion.law, variant=criterion.variant)
        cells = [(parameters(key), cell) for key, cell in split(rows, ("variant",))]
        places = varying([params for params, _ in cells])
        for (params, cell), place in zip(cells, places, strict=True):
            reference = _reference(criterion, params, table) if criterion.is_ratio else None
            result.append(evaluate(criterion, params, cell, place, reference))
    return result


def _reference(criterion: Criterion, params: dict[str, Any], table: pl.DataFrame) -> pl.DataFrame:
    """Reference flights of a ratio that ended as planned."""
    if criterion.before:
        return select(pl.read_csv(GOALS / criterion.before), params)
    where = params | criterion.against
    return select(table, where, law=criterion.law, variant=criterion.variant).filter(pl.col("completed"))


def evaluate(
    criterion: Criterion,
    params: dict[str, Any],
    cell: pl.DataFrame,
    place: dict[str, Any],
    reference: pl.DataFrame | None = None,
) -> Verdict:
    """Evaluate a criterion on the rows of one cell; `place` holds the parameters that name the cell.

    With reference flights the values are ratios to those with the same seeds.
    """
    values = np.full(cell.height, np.nan)
    measured = criterion.metric in cell.columns
    if measured:
        found = cell[criterion.metric].cast(pl.Float64)
        if reference is not None:
            old = reference.select("seed", pl.col(criterion.metric).cast(pl.Float64).alias("old"))
            found = found / cell.select("seed").join(old, on="seed", how="left", maintain_order="left")["old"]
        values = criterion.scale * found.fill_null(np.nan).to_numpy().copy()
    if not criterion.include_failed:
        values[~cell["completed"].to_numpy().astype(bool)] = np.nan  # a crash truncates the measurement
    good = values[np.isfinite(values)]
    bound = criterion.scale * criterion.bound
    return Verdict(
        criterion=criterion,
        params=params,
        place=place,
        median=float(np.median(good)) if len(good) else np.nan,
        worst=float(good.min() if criterion.least else good.max()) if len(good) else np.nan,
        within=int(np.count_nonzero(good >= bound if criterion.least else good <= bound)),
        known=len(good),
        n=len(values),
        measured=measured,
    )
