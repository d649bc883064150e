"""The QP against every other law in every cell, seed by seed; figures that move together count once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import polars as pl

from sim.experiments import FAIR
from sim.experiments.relevance import threshold
from sim.experiments.spec import Column, experiment
from sim.sweep.paired import differences, exact_interval
from sim.sweep.statistics import needed, parameters, split

#: The QP as shipped, and its other gains: no opponent.
OWN = (("qp", "standard"), ("qp", "exchanged-gains"))
#: Figures that move together: a cell counts each group once.
GROUPS = {
    "path": ("path_rms_straight_m", "path_rms_corner_m", "path_rms_m"),
    "push": ("force_rms_straight_n", "force_rms_n", "force_std_n", "push_mean_n"),
    "slide": ("speed_error_share", "stuck_share", "slide_held"),
    "attitude": ("tilt_peak_deg", "yaw_peak_deg"),
    "thrust rate": ("jitter_n_s",),
    "disturbance": ("recovery_s", "fault_path_peak_m", "fault_force_peak_n"),
    "rotor loss": ("survived_s", "push_spike_n"),
    "completed": ("completed",),
}


class Outcome(Enum):
    """Of a comparison, or of a group of them."""

    WON = "QP better"
    LOST = "QP worse"
    MIXED = "better and worse"
    NEITHER = "no difference that matters"
    FEW = "too few pairs"


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A figure of the QP and of an opponent over the seeds that both flew.

    Attributes:
        params: Parameters of the cell.
        opponent: Law and variant.
        metric: Figure, or "completed": flights that only one law completes.
        words: Figure and unit.
        worse: Median of how much worse the QP is, in that unit.
        interval: Its exact interval.
        least: Least difference that matters.
        pairs: Seeds with both figures.
    """

    params: dict[str, Any]
    opponent: tuple[str, str]
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
        if math.isnan(self.interval[0]):  # too few flights that only one law completes
            return Outcome.NEITHER
        low, high = self.interval
        return Outcome.LOST if low > self.least else Outcome.WON if high < -self.least else Outcome.NEITHER

    @property
    def group(self) -> str:
        """Name of its group."""
        return next(name for name, metrics in GROUPS.items() if self.metric in metrics)


def comparisons(table: pl.DataFrame) -> list[Comparison]:
    """Every figure of every cell of the QP against every opponent in it."""
    columns = [column for column in experiment(FAIR).columns if column.better]
    found = []
    for key, rows in split(table, ("experiment",)):
        params = parameters(key)
        flown = {(str(law), str(variant)): part for (law, variant), part in rows.group_by("law", "variant")}
        mine = flown[OWN[0]]
        shown = [each for each in columns if each.where.items() <= params.items() and each.metric in rows.columns]
        for opponent in sorted(flown.keys() - set(OWN)):
            found += _against(params, opponent, mine, flown[opponent], shown)
    return found


def _against(
    params: dict[str, Any], opponent: tuple[str, str], mine: pl.DataFrame, theirs: pl.DataFrame, columns: list[Column]
) -> list[Comparison]:
    cell = {"params": params, "opponent": opponent}
    both = mine.join(theirs, on="seed", suffix=".second")
    ended = (both["completed.second"].cast(float) - both["completed"].cast(float)).to_numpy()
    alone = ended[ended != 0.0]
    found = [
        Comparison(
            **cell,
            metric="completed",
            words="flights completed by one law alone",
            worse=float(np.median(alone)) if len(alone) else 0.0,
            interval=exact_interval(alone) if len(alone) >= needed() else (math.nan, math.nan),
            least=0.0,
            pairs=both.height,
        )
    ]
    result = differences(mine, theirs, [column.metric for column in columns])["differences"]
    return found + [_of(column, result[column.metric], cell) for column in columns if column.metric in result]


def _of(column: Column, found: dict[str, float], cell: dict[str, Any]) -> Comparison:
    """A figure in its unit; the difference is that of the opponent to the QP."""
    scale = column.scale * column.better
    low, high = sorted((scale * found["sure_low"], scale * found["sure_high"]))
    return Comparison(
        **cell,
        metric=column.metric,
        words=f"{column.label}{', ' if column.unit else ''}{column.unit}",
        worse=scale * found["median"],
        interval=(low, high),
        least=threshold(column),
        pairs=int(found["pairs"]),
    )


def grouped(found: Iterable[Comparison]) -> dict[tuple[tuple[str, str], str, str], Outcome]:
    """Outcome of every group of figures by opponent, cell and group."""
    groups: dict[tuple[tuple[str, str], str, str], list[Outcome]] = {}
    for each in found:
        groups.setdefault((each.opponent, str(each.params), each.group), []).append(each.outcome)
    return {key: _joint(outcomes) for key, outcomes in groups.items()}


def _joint(outcomes: Sequence[Outcome]) -> Outcome:
    won, lost = Outcome.WON in outcomes, Outcome.LOST in outcomes
    if won or lost:
        return Outcome.MIXED if won and lost else Outcome.WON if won else Outcome.LOST
    return Outcome.NEITHER if Outcome.NEITHER in outcomes else Outcome.FEW
