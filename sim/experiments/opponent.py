"""One figure of the QP against an opponent in one cell, seed by seed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import polars as pl

from sim.experiments.relevance import threshold
from sim.experiments.spec import Column
from sim.sweep.paired import differences, exact_interval
from sim.sweep.statistics import needed

#: Metric of the flights that only one law completes.
COMPLETED = "completed"


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
        metric: Figure, or `COMPLETED`.
        words: Figure and unit, or the flights that only one law completes.
        worse: Median of how much worse the QP is, in that unit.
        interval: Its exact interval.
        least: Least difference that matters.
        pairs: Seeds with both figures.
    """

    experiment: str
    params: dict[str, Any]
    opponent: str
    metric: str
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
    def worse_text(self) -> str:
        """How much worse, with the interval."""
        low, high = self.interval
        return f"{self.worse:.3g} ({low:.3g} to {high:.3g})"

    @property
    def cells(self) -> tuple[str, ...]:
        """Experiment, cell, opponent, figure, how much worse with its interval, threshold that matters, pairs."""
        cell = ", ".join(f"{name} {value}" for name, value in self.params.items())
        return self.experiment, cell, self.opponent, self.words, self.worse_text, f"{self.least:.3g}", str(self.pairs)


def against(
    experiment: str,
    params: dict[str, Any],
    opponent: str,
    mine: pl.DataFrame,
    theirs: pl.DataFrame,
    columns: Sequence[Column],
) -> list[Comparison]:
    """Figures of one cell against one opponent; ends of flights count by the seeds that only one law completes.

    Args:
        experiment: Name.
        params: Parameters of the cell.
        opponent: Name of the opponent.
        mine: Flights of the QP.
        theirs: Flights of the opponent.
        columns: Figures; one that the cell has not, or without a direction, is left out.
    """
    cell = {"experiment": experiment, "params": params, "opponent": opponent}
    both = mine.join(theirs, on="seed", suffix=".second")
    ended = (both["completed.second"].cast(float) - both["completed"].cast(float)).to_numpy()
    alone = ended[ended != 0.0]
    found = [
        Comparison(
            **cell,
            metric=COMPLETED,
            words="flights completed by one law alone",
            worse=float(np.median(alone)) if len(alone) else 0.0,
            interval=exact_interval(alone) if len(alone) else (math.nan, math.nan),
            least=0.0,
            pairs=len(alone),
        )
    ]
    shown = [each for each in columns if each.better and each.where.items() <= params.items()]
    shown = [each for each in shown if each.metric in both.columns]
    result = differences(mine, theirs, [column.metric for column in shown])["differences"]
    return found + [_of(column, result[column.metric], cell) for column in shown if column.metric in result]


def _of(column: Column, found: dict[str, float], cell: dict[str, Any]) -> Comparison:
    """A figure in its unit; the difference is that of the opponent to the QP."""
    scale = column.scale * column.better
    ends = sorted((scale * found["sure_low"], scale * found["sure_high"]))
    return Comparison(
        **cell,
        metric=column.metric,
        words=f"{column.label}{', ' if column.unit else ''}{column.unit}",
        worse=scale * found["median"],
        interval=(ends[0], ends[1]),
        least=threshold(column),
        pairs=int(found["pairs"]),
    )
