"""Evaluation of the criteria of the QP law on the table of flights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl

from sim.experiments.criteria import Criterion
from sim.experiments.spec import Experiment
from sim.experiments.wording import varying
from sim.sweep.statistics import parameters, select, split


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
    """Verdict of each criterion in each cell of the QP law that it applies to."""
    result = []
    for criterion in experiment.every_criterion() if table.height else ():
        rows = select(table, criterion.where, law="qp", variant=criterion.variant)
        cells = [(parameters(key), cell) for key, cell in split(rows, ("variant",))]
        places = varying([params for params, _ in cells])
        result += [evaluate(criterion, *cell, place) for cell, place in zip(cells, places, strict=True)]
    return result


def evaluate(criterion: Criterion, params: dict[str, Any], cell: pl.DataFrame, place: dict[str, Any]) -> Verdict:
    """Evaluate a criterion on the rows of one cell; `place` holds the parameters that name the cell."""
    values = np.full(cell.height, np.nan)
    measured = criterion.metric in cell.columns
    if measured:
        values = criterion.scale * cell[criterion.metric].cast(pl.Float64).fill_null(np.nan).to_numpy().copy()
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
