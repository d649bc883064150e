"""Objectives of the search: push, path, tilt, yaw and thrust rate, each a mean over the flights of a trial."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from sim.evaluate.figures import FIGURES


@dataclass(frozen=True)
class Objective:
    """A figure to minimise."""

    name: str
    failed: float  # value of a flight that does not complete, in SI: far beyond any completed one
    worse: float = 1.1  # greatest ratio to the shipped preset that may replace it; seeds alone change it by a tenth

    @property
    def label(self) -> str:
        """Words with unit."""
        return FIGURES[self.name].label

    @property
    def scale(self) -> float:
        """Factor from SI to the unit of the label."""
        return FIGURES[self.name].scale


OBJECTIVES = (
    Objective("force_rms_n", 3.0),
    Objective("path_rms_m", 0.05),
    Objective("tilt_peak_deg", 20.0),
    Objective("yaw_peak_deg", 20.0),
    # It wears motors and costs no accuracy; a quarter more is an eighth of the limit of 500 N/s.
    Objective("jitter_n_s", 1000.0, worse=1.25),
)


@dataclass(frozen=True)
class Score:
    """Quality of a preset."""

    values: tuple[float, ...]  # mean of every objective
    failed: float  # fraction of flights that did not complete; 1 for a preset with an oscillating contact


def score(rows: Iterable[Mapping[str, Any]]) -> Score:
    """Means over flights; a failed flight, or one without the figure, counts with the objective's `failed`."""
    rows = list(rows)
    values = tuple(sum(_value(row, each) for row in rows) / len(rows) for each in OBJECTIVES)
    return Score(values, sum(not row["completed"] for row in rows) / len(rows))


def refused() -> Score:
    """Score of a refused preset."""
    return Score(tuple(each.failed for each in OBJECTIVES), 1.0)


def _value(row: Mapping[str, Any], objective: Objective) -> float:
    value = row.get(objective.name)
    good = row["completed"] and value is not None and math.isfinite(value)
    return min(float(value), objective.failed) if good else objective.failed  # type: ignore[arg-type]
