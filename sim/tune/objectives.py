"""Objectives of the search: figures of painting and of slides, each a mean over the flights of a trial."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from sim.evaluate.figures import FIGURES, MORE
from sim.sweep.parts import PARAM

#: Tasks of the flights, as parameter `TASK` of their rows.
PAINT, SLIDE, SATURATED = "paint", "slide", "saturated slide"
TASK = "task"


@dataclass(frozen=True)
class Objective:
    """A figure to improve."""

    name: str
    failed: float  # value of a flight that does not complete, in SI: far worse than that of any completed one
    worse: float = 1.1  # greatest ratio to the shipped preset that may replace it; seeds alone change it by a tenth
    tasks: tuple[str, ...] = (PAINT, SLIDE, SATURATED)  # tasks whose flights have it

    @property
    def label(self) -> str:
        """Words with unit."""
        return FIGURES[self.name].label

    @property
    def scale(self) -> float:
        """Factor from SI to the unit of the label."""
        return FIGURES[self.name].scale

    def ratio(self, value: float, base: float) -> float:
        """Ratio of a value to that of the shipped preset, above 1 for a worse one.

        The least difference that matters is added to both, so that the ratio stays finite where a figure is 0. The sign
        of a figure does not count.
        """
        value, base = abs(value), abs(base)
        least = FIGURES[self.name].least[0] / self.scale
        ratio = (value + least) / (base + least)
        return 1.0 / ratio if FIGURES[self.name].better == MORE else ratio


OBJECTIVES = (
    Objective("force_rms_n", 3.0, tasks=(PAINT, SLIDE)),  # a saturated slide has delivered_share
    Objective("path_rms_m", 0.05),
    Objective("place_error_m", 0.05, worse=1.25, tasks=(PAINT,)),  # two strokes a flight: it changes more by luck
    Objective("tilt_peak_deg", 20.0),
    Objective("yaw_peak_deg", 20.0),
    Objective("speed_error_share", 1.0, worse=1.25, tasks=(SLIDE, SATURATED)),
    Objective("stuck_share", 1.0, worse=1.25, tasks=(SLIDE, SATURATED)),
    Objective("delivered_share", 0.1, worse=1.02, tasks=(SLIDE, SATURATED)),
    # It wears motors and costs no accuracy; a quarter more is an eighth of the limit of 500 N/s.
    Objective("jitter_n_s", 1000.0, worse=1.25, tasks=(PAINT,)),
)


@dataclass(frozen=True)
class Score:
    """Quality of a preset."""

    values: tuple[float, ...]  # mean of every objective; NaN for one that no flight has
    failed: float  # fraction of flights that did not complete; 1 for a preset with an oscillating contact


def score(rows: Iterable[Mapping[str, Any]]) -> Score:
    """Means over flights; a failed flight, or one without the figure, counts with the objective's `failed`."""
    rows = list(rows)
    return Score(tuple(_mean(rows, each) for each in OBJECTIVES), sum(not row["completed"] for row in rows) / len(rows))


def refused() -> Score:
    """Score of a refused preset."""
    return Score(tuple(each.failed for each in OBJECTIVES), 1.0)


def ratios(score: Score, shipped: Score) -> list[tuple[Objective, float]]:
    """Ratios of the objectives that both have, above 1 for worse."""
    pairs = zip(OBJECTIVES, score.values, shipped.values, strict=True)
    return [(each, each.ratio(value, base)) for each, value, base in pairs if math.isfinite(value + base)]


def _mean(rows: list[Mapping[str, Any]], objective: Objective) -> float:
    values = [_value(row, objective) for row in rows if row[PARAM + TASK] in objective.tasks]
    return sum(values) / len(values) if values else math.nan


def _value(row: Mapping[str, Any], objective: Objective) -> float:
    value = row.get(objective.name)
    if not row["completed"] or value is None or not math.isfinite(value):
        return objective.failed
    worst = max if FIGURES[objective.name].better == MORE else min
    return worst(abs(float(value)), objective.failed)
