"""Figures of the QP against every other law and variant, cell by cell and seed by seed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import polars as pl

from sim.evaluate.figures import figure_of
from sim.experiments.spec import Column, Experiment
from sim.experiments.variants import VARIANTS
from sim.flight.trace import law_name
from sim.sweep.statistics import differences, exact_interval, needed, parameters, split

#: Metric of the flights that only one law completes.
COMPLETED = "completed"
#: Figures that move together: a cell counts each group once. A figure in no group is one by itself.
GROUPS = {
    "path": ("path_rms_straight_m", "path_rms_corner_m", "path_rms_m", "path_max_m", "height_error_rms_m"),
    "push": ("force_rms_straight_n", "force_rms_corner_n", "force_rms_n", "force_error_rms_n", "force_std_n",
             "push_mean_n", "delivered_share", "reach_share"),
    "slide": ("speed_error_share", "stuck_share", "slide_held"),
    "attitude": ("tilt_rms_deg", "tilt_peak_deg", "yaw_rms_deg", "yaw_peak_deg"),
    "touch": ("touch_peak_n", "settle_s", "bounces", "force_peak_n", "push_peak_ratio"),
    "disturbance": ("recovery_s", "fault_path_peak_m", "fault_force_peak_n"),
    "rotor loss": ("survived_s", "push_spike_n"),
}  # fmt: skip


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
        params: Parameters of the cell.
        opponent: Law and variant.
        metric: Figure, or `COMPLETED`.
        words: Figure and unit, or the flights that only one law completes.
        worse: Median of how much worse the QP is, in that unit.
        interval: Its exact interval.
        least: Least difference that matters.
        pairs: Seeds with both figures.
    """

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


def opponent_name(law: str, variant: str) -> str:
    """Name of a law with its variant."""
    names = {"mpc": "prediction over 0.3 s", "standard": law_name(law)}
    return names.get(variant, f"{law_name(law)}, {variant}")


def comparisons(experiment: Experiment, table: pl.DataFrame) -> list[Comparison]:
    """Every figure in every cell of the QP against every other law and variant in it.

    The QP has the variant that the opponent is compared with: an allocator without reach check against the QP without
    it, a part left out against the whole.
    """
    found = []
    for key, rows in split(table, ("experiment",)):
        flown = {(str(law), str(variant)): part for (law, variant), part in rows.group_by("law", "variant")}
        for law, variant in sorted(flown):
            own = _compared_with(law, variant)
            mine = next((flown["qp", each] for each in own if ("qp", each) in flown), None)
            if mine is not None:
                name, theirs = opponent_name(law, variant), flown[law, variant]
                found += _against(parameters(key), name, mine, theirs, experiment.columns)
    return found


def _compared_with(law: str, variant: str) -> tuple[str, ...]:
    """Variants of the QP for an opponent: the first that flew the cell counts."""
    if (law, variant) == ("qp", "standard"):
        return ()
    known = VARIANTS[variant]
    same = () if law == "qp" or known.gains_of else (variant,)
    return (*same, *known.against)


def grouped(found: Iterable[Comparison]) -> dict[tuple[str, str, str], frozenset[Outcome]]:
    """Outcomes of every group of figures by opponent, cell and group: better, worse, both, or neither.

    Too few flights that only one law completes are no difference: all seeds of a cell are flown.
    """
    groups: dict[tuple[str, str, str], set[Outcome]] = {}
    for each in found:
        group = next((name for name, metrics in GROUPS.items() if each.metric in metrics), each.metric)
        few = each.metric == COMPLETED and each.outcome is Outcome.FEW
        outcome = Outcome.NEITHER if few else each.outcome
        groups.setdefault((each.opponent, str(each.params), group), set()).add(outcome)
    return {key: _joint(outcomes) for key, outcomes in groups.items()}


def _joint(outcomes: set[Outcome]) -> frozenset[Outcome]:
    decided = outcomes & {Outcome.WON, Outcome.LOST}
    return frozenset(decided or (outcomes & {Outcome.NEITHER}) or outcomes)


def _against(
    params: dict[str, Any], opponent: str, mine: pl.DataFrame, theirs: pl.DataFrame, columns: Sequence[Column]
) -> list[Comparison]:
    """Figures of one cell of the QP against one opponent; ends count by the seeds that only one law completes.

    A figure that the cell does not have, or without a direction, is left out.
    """
    cell = {"params": params, "opponent": opponent}
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
        least=figure_of(column.metric).least[0],
        pairs=int(found["pairs"]),
    )
