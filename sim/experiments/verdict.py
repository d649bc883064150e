"""Whether the QP law holds what an experiment asks of it, and by how much."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl

from sim.experiments.base import Criterion, Experiment
from sim.sweep.parts import PARAM
from sim.sweep.statistics import parameters, split


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One criterion in one cell.

    Attributes:
        criterion: What was asked.
        params: The cell.
        median: Median over its flights, in the criterion's unit; NaN without data.
        worst: Its worst flight.
        held: Flights that hold the bound.
        known: Flights that have the figure; one that failed counts only where the criterion says so.
        n: Flights.
        measured: Whether the table has the figure at all.
    """

    criterion: Criterion
    params: dict
    median: float
    worst: float
    held: int
    known: int
    n: int
    measured: bool = True

    @property
    def met(self) -> bool:
        """Whether every flight has the figure and holds the bound, or their median where the criterion asks no more."""
        if not self.n or self.known < self.n:
            return False
        good = self.median >= self.bound if self.criterion.least else self.median <= self.bound
        return self.held == self.n if self.criterion.every else bool(good)

    @property
    def words(self) -> str:
        """``yes`` or ``no``, and what every flight says where the median speaks for them."""
        if not self.measured:
            return "not measured"
        if self.met and self.held < self.n:
            return f"yes (median; {self.held} of {self.n})"
        return "yes" if self.met else "no"

    @property
    def bound(self) -> float:
        """The bound in the criterion's unit."""
        return self.criterion.scale * self.criterion.bound


def verdicts(experiment: Experiment, table: pl.DataFrame) -> list[Verdict]:
    """Every criterion in every cell of the QP law that it holds for."""
    result = []
    for criterion in experiment.criteria if table.height else ():
        rows = table.filter((pl.col("law") == "qp") & (pl.col("variant") == criterion.variant))
        for name, value in criterion.params.items():
            rows = rows.filter(pl.col(PARAM + name) == value) if PARAM + name in rows.columns else rows.clear()
        for key, cell in split(rows, ("variant",)) if rows.height else ():
            result.append(_judge(criterion, parameters(key), cell))
    return result


def telling(listed: list[Verdict], verdict: Verdict) -> dict:
    """Parameters that tell a verdict's cell from others of the same criterion."""
    alike = [other.params for other in listed if other.criterion == verdict.criterion]
    return {key: value for key, value in verdict.params.items() if len({str(params.get(key)) for params in alike}) > 1}


def _judge(criterion: Criterion, params: dict, cell: pl.DataFrame) -> Verdict:
    values = np.full(cell.height, np.nan)
    if criterion.metric in cell.columns:
        values = criterion.scale * cell[criterion.metric].cast(pl.Float64).fill_null(np.nan).to_numpy().copy()
    if not criterion.failed_too:
        values[~cell["completed"].to_numpy().astype(bool)] = np.nan  # what a crash cut short measures nothing
    good = values[np.isfinite(values)]
    bound = criterion.scale * criterion.bound
    held = np.count_nonzero(good >= bound if criterion.least else good <= bound)
    if not len(good):
        return Verdict(
            criterion=criterion,
            params=params,
            median=np.nan,
            worst=np.nan,
            held=0,
            known=0,
            n=len(values),
            measured=criterion.metric in cell.columns,
        )
    worst = good.min() if criterion.least else good.max()
    return Verdict(
        criterion=criterion,
        params=params,
        median=float(np.median(good)),
        worst=float(worst),
        held=int(held),
        known=len(good),
        n=len(values),
    )
