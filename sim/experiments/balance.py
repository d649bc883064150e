"""Comparison of the two laws: in how many metrics each is significantly better."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl

from sim.experiments.spec import Column, Experiment
from sim.experiments.wording import cell, exact, markdown, measured, value_of, varying
from sim.sweep.paired import needed, paired_differences, sign
from sim.sweep.spec import LAWS
from sim.sweep.statistics import CONFIDENCE

#: Winner of a comparison and its heading; "" is neither.
_OUTCOMES = {
    "qp": "QP surely better",
    "": "no sure difference",
    "paper": "analytic surely better",
    "few": "too few pairs to tell",
}


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One metric of one cell under both laws, paired by seed.

    Attributes:
        column: The metric.
        variant: Variant flown.
        params: The cell.
        difference: Analytic law minus QP law, in SI: median, intervals and number of pairs.
        winner: Key of `_OUTCOMES`.
    """

    column: Column
    variant: str
    params: dict[str, Any]
    difference: dict[str, float]
    winner: str


def comparisons(experiment: Experiment, table: pl.DataFrame) -> Iterator[Comparison]:
    """Every metric with a direction, in every cell that both laws flew; folded cells are left out."""
    columns = [column for column in measured(experiment, table) if column.better]
    for entry in paired_differences(table, [column.metric for column in columns]):
        if experiment.is_folded(entry["params"]):
            continue
        for column in columns:
            found = value_of(entry["differences"], column, entry["params"])
            if found is None:
                continue
            winner = {1: "qp", -1: "paper", 0: ""}[-column.better * sign(found)]
            yield Comparison(
                column=column,
                variant=entry["variant"],
                params=entry["params"],
                difference=found,
                winner=winner if found["pairs"] >= needed() else "few",
            )


def balance(flown: Sequence[tuple[Experiment, pl.DataFrame]]) -> str:
    """Counts per experiment, then every metric in which the analytic law is significantly better.

    Args:
        flown: Experiments with their tables.
    """
    rows, losses, compared = [], [], 0
    for experiment, table in flown:
        found = list(comparisons(experiment, table))
        count = {winner: sum(entry.winner == winner for entry in found) for winner in _OUTCOMES}
        enough = len(found) - count["few"]
        compared += enough
        rows.append([experiment.name, *_done(table), *map(str, (enough, *count.values()))])
        for entry, params in zip(found, varying([entry.params for entry in found]), strict=True):
            if entry.winner == "paper":
                losses.append(_loss(experiment, entry, params))
    text = (
        "Figures of cells that both laws flew with the same seeds, over the flights that both ended as planned. Surely "
        f"better: the exact {100.0 * CONFIDENCE:g} % interval of the median difference (order statistics, the inverse "
        f"of the sign test) excludes zero; it takes {needed()} pairs, and fewer can never say so. Comparisons with "
        f"enough pairs: {compared}; if the laws were alike, up to "
        f"{(1.0 - CONFIDENCE) * compared:.0f} of them would look sure by chance alone.\n\n"
    )
    heads = ("experiment", "flights done, QP", "flights done, analytic", "comparisons", *_OUTCOMES.values())
    text += markdown(heads, rows)
    if losses:
        text += "\nThe analytic law with clipping is surely better in (analytic minus QP):\n\n"
        text += "\n".join(losses) + "\n"
    return text


def _done(table: pl.DataFrame) -> list[str]:
    """Flights of each law that ended as planned, of the variants that both laws flew."""
    variants = [set(table.filter(pl.col("law") == law)["variant"]) for law in LAWS]
    shared = table.filter(pl.col("variant").is_in(sorted(set.intersection(*variants))))
    both = [shared.filter(pl.col("law") == law)["completed"] for law in LAWS]
    return [f"{int(column.sum())} of {column.len()}" for column in both]


def _loss(experiment: Experiment, entry: Comparison, params: dict[str, Any]) -> str:
    column = entry.column
    where = ", ".join(part for part in (entry.variant, cell(experiment, params)) if part)
    unit = f" {column.unit}" if column.unit else ""
    words = exact(entry.difference, column)
    return f"- {experiment.name}, {where}: {column.label} {words}{unit}, {entry.difference['pairs']} pairs"
