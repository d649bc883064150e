"""The balance of the two laws: where the QP is better, where the analytic law is, and where seeds cannot tell."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import polars as pl

from sim.experiments.base import Column, Experiment
from sim.sweep.statistics import paired_differences


@dataclass(frozen=True, kw_only=True)
class Paired:
    """One figure of one cell, both laws, flight by flight.

    Attributes:
        column: The figure.
        variant: Variant flown.
        params: The cell.
        pairs: Seeds flown by both.
        median: Analytic law minus QP law, in the figure's unit.
        low: Lower end of its interval.
        high: Upper end.
        winner: "qp", "paper", or "" when the interval holds zero or more is neither better nor worse.
    """

    column: Column
    variant: str
    params: dict[str, Any]
    pairs: int
    median: float
    low: float
    high: float
    winner: str


def balance(experiment: Experiment, table: pl.DataFrame) -> Iterator[Paired]:
    """Every figure that an experiment shows, in every cell that both laws flew more than once."""
    columns = [column for column in experiment.columns if column.metric in table.columns]
    for entry in paired_differences(table, [column.metric for column in columns]):
        if entry["n"] < 2:
            continue
        for column in columns:
            found = entry["differences"].get(column.metric)
            if found is None:
                continue
            sign = -column.better if found["low"] > 0.0 else column.better if found["high"] < 0.0 else 0
            yield Paired(
                column=column,
                variant=entry["variant"],
                params=entry["params"],
                pairs=entry["n"],
                winner={1: "qp", -1: "paper", 0: ""}[sign],
                **{name: column.scale * found[name] for name in ("median", "low", "high")},
            )
