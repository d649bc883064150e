"""The balance of the two laws: where the QP is better, where the analytic law is, and where seeds cannot tell."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import polars as pl

from sim.experiments.base import Column, Experiment
from sim.experiments.wording import folded, of, shown
from sim.sweep.paired import needed, paired_differences, sign


@dataclass(frozen=True, kw_only=True)
class Paired:
    """One figure of one cell, both laws, flight by flight.

    Attributes:
        column: The figure.
        variant: Variant flown.
        params: The cell.
        pairs: Flights that both ended as planned and have the figure.
        difference: Analytic law minus QP law: median, bootstrap and exact interval, in SI.
        winner: "qp", "paper", "" when neither is surely better, or "few" when there are too few pairs to tell.
    """

    column: Column
    variant: str
    params: dict[str, Any]
    pairs: int
    difference: dict[str, float]
    winner: str


def balance(experiment: Experiment, table: pl.DataFrame) -> Iterator[Paired]:
    """Every judged figure of an experiment, in every cell that both laws flew; cells that are folded away are not."""
    columns = [column for column in shown(experiment, table) if column.better]
    for entry in paired_differences(table, [column.metric for column in columns]):
        if folded(experiment, entry["params"]):
            continue
        for column in columns:
            found = of(entry["differences"], column, entry["params"])
            if found is None:
                continue
            winner = {1: "qp", -1: "paper", 0: ""}[-column.better * sign(found)]
            yield Paired(
                column=column,
                variant=entry["variant"],
                params=entry["params"],
                pairs=found["pairs"],
                difference=found,
                winner=winner if found["pairs"] >= needed() else "few",
            )
