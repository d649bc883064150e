"""The page's account of both laws: how often which is surely better, and in what the analytic law is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import polars as pl

from sim.experiments.balance import Paired, balance
from sim.experiments.base import LAWS, Experiment
from sim.experiments.wording import cell, figure, markdown, varying
from sim.sweep.paired import needed
from sim.sweep.statistics import CONFIDENCE

_HEADS = (
    "experiment",
    "flights done, QP",
    "flights done, analytic",
    "comparisons",
    "QP surely better",
    "no sure difference",
    "analytic surely better",
    "too few pairs to tell",
)


def account(flown: Sequence[tuple[Experiment, pl.DataFrame]]) -> str:
    """Counts per experiment, then every figure in which the analytic law is surely better.

    Args:
        flown: Experiments with their tables.
    """
    rows, losses, compared = [], [], 0
    for experiment, table in flown:
        paired = list(balance(experiment, table))
        count = {winner: sum(entry.winner == winner for entry in paired) for winner in ("qp", "", "paper", "few")}
        enough = len(paired) - count["few"]
        compared += enough
        numbers = (enough, count["qp"], count[""], count["paper"], count["few"])
        rows.append([experiment.name, *_done(table), *map(str, numbers)])
        telling = varying([entry.params for entry in paired])
        losses += [
            _loss(experiment, entry, params)
            for entry, params in zip(paired, telling, strict=True)
            if entry.winner == "paper"
        ]
    text = (
        "Figures of cells that both laws flew with the same seeds, over the flights that both ended as planned. Surely "
        f"better: the exact {100.0 * CONFIDENCE:g} % interval of the median difference (order statistics, the inverse "
        f"of the sign test) excludes zero; it takes {needed()} pairs, and fewer can never say so. Comparisons with "
        f"enough pairs: {compared}; if the laws were alike, up to "
        f"{(1.0 - CONFIDENCE) * compared:.0f} of them would look sure by chance alone.\n\n"
    )
    text += markdown(_HEADS, rows)
    if losses:
        text += "\nThe analytic law with clipping is surely better in (analytic minus QP):\n\n" + "\n".join(losses)
        text += "\n"
    return text


def _done(table: pl.DataFrame) -> list[str]:
    """Flights that ended as planned, of the variants that both laws flew."""
    variants = [set(table.filter(pl.col("law") == law)["variant"]) for law in LAWS]
    shared = table.filter(pl.col("variant").is_in(sorted(set.intersection(*variants))))
    both = [shared.filter(pl.col("law") == law)["completed"] for law in LAWS]
    return [f"{int(column.sum())} of {column.len()}" for column in both]


def _loss(experiment: Experiment, entry: Paired, params: dict[str, Any]) -> str:
    column = entry.column
    words = figure(entry.difference, column, plus=True, ends=("sure_low", "sure_high"))
    where = ", ".join(part for part in (entry.variant, cell(experiment, params)) if part)
    unit = f" {column.unit}" if column.unit else ""
    return f"- {experiment.name}, {where}: {column.label} {words}{unit}, {entry.pairs} pairs"
