"""Comparison of the two laws: in how many metrics each is significantly better."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import polars as pl

from sim.evaluate.table import markdown
from sim.experiments.spec import Column, Experiment
from sim.experiments.wording import cell, exact, measured, value_of, varying
from sim.sweep.paired import needed, paired_differences, sign
from sim.sweep.spec import LAWS
from sim.sweep.statistics import CONFIDENCE

#: Outcome of a comparison by the sign of QP being better, and without enough pairs.
_OUTCOMES = {1: "QP significantly better", 0: "no significant difference", -1: "analytic significantly better"}
_FEW = "too few pairs"


def balance(flown: Sequence[tuple[Experiment, pl.DataFrame]]) -> str:
    """Counts per experiment, then every metric in which the analytic law is significantly better."""
    rows, losses, compared = [], [], 0
    for experiment, table in flown:
        found = _comparisons(experiment, table)
        outcomes = [_outcome(column, difference) for _, column, difference in found]
        count = Counter(outcomes)
        enough = len(found) - count[_FEW]
        compared += enough
        counts = [count[outcome] for outcome in (*_OUTCOMES.values(), _FEW)]
        rows.append([experiment.name, *_done(table), *map(str, (enough, *counts))])
        places = varying([entry["params"] for entry, *_ in found])
        for (entry, column, difference), params, outcome in zip(found, places, outcomes, strict=True):
            if outcome == _OUTCOMES[-1]:
                where = ", ".join(part for part in (entry["variant"], cell(experiment, params)) if part)
                words = f"{column.label} {exact(difference, column)} {column.unit}".rstrip()
                losses.append(f"- {experiment.name}, {where}: {words}, {difference['pairs']} pairs\n")
    text = (
        "Metrics of cells that both laws flew with the same seeds, over the flights that both ended as planned. "
        f"Significantly better: the exact {100.0 * CONFIDENCE:g} % interval of the median difference (order "
        f"statistics, the inverse of the sign test) excludes zero, which takes at least {needed()} pairs. Comparisons "
        f"with enough pairs: {compared}; if the laws were equal, up to {(1.0 - CONFIDENCE) * compared:.0f} of them "
        "would look significant by chance.\n\n"
    )
    heads = ("experiment", "flights done, QP", "flights done, analytic", "comparisons", *_OUTCOMES.values(), _FEW)
    text += markdown(heads, rows)
    if losses:
        text += "\nThe analytic law with clipping is significantly better in (analytic minus QP):\n\n" + "".join(losses)
    return text


def _comparisons(experiment: Experiment, table: pl.DataFrame) -> list[tuple[dict[str, Any], Column, dict[str, float]]]:
    """Cell, metric and difference of every metric with a direction, in unfolded cells that both laws flew."""
    columns = [column for column in measured(experiment, table) if column.better]
    return [
        (entry, column, difference)
        for entry in paired_differences(table, [column.metric for column in columns])
        if not experiment.is_folded(entry["params"])
        for column in columns
        if (difference := value_of(entry["differences"], column, entry["params"])) is not None
    ]


def _outcome(column: Column, difference: dict[str, float]) -> str:
    return _OUTCOMES[-column.better * sign(difference)] if difference["pairs"] >= needed() else _FEW


def _done(table: pl.DataFrame) -> list[str]:
    """Flights of each law that ended as planned, of the variants that both laws flew."""
    variants = [set(table.filter(pl.col("law") == law)["variant"]) for law in LAWS]
    shared = table.filter(pl.col("variant").is_in(sorted(set.intersection(*variants))))
    both = [shared.filter(pl.col("law") == law)["completed"] for law in LAWS]
    return [f"{int(column.sum())} of {column.len()}" for column in both]
