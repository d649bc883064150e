"""Objectives of the search: push, path, tilt, yaw and thrust rate, each a mean over the flights of a trial."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from sim.evaluate.table import Figure


@dataclass(frozen=True)
class Objective(Figure):
    """A figure to minimise."""

    # value of a flight that does not complete, in the unit of the column: far beyond any completed one
    failed: float = math.inf
    worse: float = 1.1  # greatest ratio to the shipped preset that may replace it; seeds alone change it by a tenth


OBJECTIVES = (
    Objective("force_rms_n", "push error, rms", unit="N", failed=3.0),
    Objective("path_rms_m", "path error, rms", 1e3, "mm", failed=0.05),
    Objective("tilt_peak_deg", "tilt, peak", unit="deg", failed=20.0),
    Objective("yaw_peak_deg", "yaw, peak", unit="deg", failed=20.0),
    # It wears motors and costs no accuracy; a quarter more is an eighth of the limit of 500 N/s.
    Objective("jitter_n_s", "thrust rate, rms", unit="N/s", failed=1000.0, worse=1.25),
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
    value = row.get(objective.column)
    good = row["completed"] and value is not None and math.isfinite(value)
    return min(float(value), objective.failed) if good else objective.failed  # type: ignore[arg-type]
