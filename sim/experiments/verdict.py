"""Evaluation of the criteria on the table of flights."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from sim.experiments.criteria import Criterion
from sim.experiments.spec import Experiment
from sim.experiments.wording import varying
from sim.sweep.statistics import parameters, select, split

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
