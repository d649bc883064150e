"""One figure of the QP against an opponent in one cell, seed by seed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import polars as pl

from sim.experiments.losses.flights import base_of
from sim.experiments.relevance import threshold
from sim.experiments.spec import Column, experiment
from sim.sweep.paired import differences, exact_interval
from sim.sweep.statistics import needed, parameters, split


class Outcome(Enum):
    """Of a comparison."""

    LOST = "QP lost"
    WON = "QP won"
    NEITHER = "neither"
    FEW = "too few pairs"


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A figure of the QP and of an opponent over the seeds that both flew.

    Attributes:
        experiment: Name.
        params: Parameters of the cell.
        opponent: Law and variant.
        words: Figure and unit, or the flights that only one law completes.
        worse: Median of how much worse the QP is, in that unit.
        interval: Its exact interval.
        least: Least difference that matters.
        pairs: Seeds with both figures.
    """

    experiment: str
    params: dict[str, Any]
    opponent: str
    words: str
    worse: float
    interval: tuple[float, float]
    least: float
    pairs: int

    @property
    def outcome(self) -> Outcome:
        """Whether the whole exact interval is worse, or better, than the threshold that matters."""
        if self.pairs < needed():
            return Outcome.FEW
        low, high = self.interval
        return Outcome.LOST if low > self.least else Outcome.WON if high < -self.least else Outcome.NEITHER

    @property
    def cells(self) -> tuple[str, ...]:
        """Experiment, cell, opponent, figure, how much worse with its interval, threshold that matters, pairs."""
        cell = ", ".join(f"{name} {value}" for name, value in self.params.items())
        low, high = self.interval
        worse = f"{self.worse:.3g} ({low:.3g} to {high:.3g})"
        return self.experiment, cell, self.opponent, self.words, worse, f"{self.least:.3g}", str(self.pairs)


def comparisons(table: pl.DataFrame) -> list[Comparison]:
    """Every figure of every cell of the QP's flights against every opponent in it.

    An opponent that flies like an earlier one, because their gains differ only where the cell has no use for them, is
    no further comparison.

    Args:
        table: Flights of `sim.experiments.losses.flights.runs_of`.
    """
    found = []
    for key, rows in split(table, ("experiment",)):
        flown: list[pl.DataFrame] = []
        figures = {"seed", "completed"} | {each.metric for each in experiment(key["experiment"]).columns if each.better}
        for (law, variant), theirs in rows.group_by("law", "variant", maintain_order=True):
            base = base_of(str(variant))
            if law == "qp" and not str(variant).endswith("mpc"):
                continue
            mine = rows.filter((pl.col("law") == "qp") & (pl.col("variant") == base))
            if mine.is_empty():
                continue
            flights = theirs.sort("seed").select(pl.lit(base), *sorted(figures & set(theirs.columns)))
            if any(flights.equals(each) for each in flown):
                continue
            flown.append(flights)
            name = str(variant) if law == "qp" else f"analytic law, {variant}"
            found += _against(key["experiment"], parameters(key), name, mine, theirs)
    return found


def _against(
    name: str, params: dict[str, Any], opponent: str, mine: pl.DataFrame, theirs: pl.DataFrame
) -> list[Comparison]:
    """The figures of one cell against one opponent; ends of flights count by the seeds that only one law completes."""
    cell = {"experiment": name, "params": params, "opponent": opponent}
    both = mine.join(theirs, on="seed", suffix=".second")
    ended = (both["completed.second"].cast(float) - both["completed"].cast(float)).to_numpy()
    alone = ended[ended != 0.0]
    found = [
        Comparison(
            **cell,
            words="flights completed by one law alone",
            worse=float(np.median(alone)) if len(alone) else 0.0,
            interval=exact_interval(alone) if len(alone) else (math.nan, math.nan),
            least=0.0,
            pairs=len(alone),
        )
    ]
    shown = [each for each in experiment(name).columns if each.better and each.where.items() <= params.items()]
    columns = [each for each in shown if each.metric in both.columns]
    result = differences(mine, theirs, [column.metric for column in columns])["differences"]
    return found + [_of(column, result[column.metric], cell) for column in columns if column.metric in result]


def _of(column: Column, found: dict[str, float], cell: dict[str, Any]) -> Comparison:
    """A figure in its unit; the difference is that of the opponent to the QP."""
    scale = column.scale * column.better
    ends = sorted((scale * found["sure_low"], scale * found["sure_high"]))
    return Comparison(
        **cell,
        words=f"{column.label}{', ' if column.unit else ''}{column.unit}",
        worse=scale * found["median"],
        interval=(ends[0], ends[1]),
        least=threshold(column),
        pairs=int(found["pairs"]),
    )
