"""What each part of the controller is worth: variants against what they switch off, seed by seed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import polars as pl

from sim.experiments.base import Column, Experiment
from sim.experiments.variants import REFERENCES
from sim.experiments.wording import cell, figure, folded, headed, markdown, of, rounded, shown, varying
from sim.figures.style import law_name
from sim.sweep.paired import needed, sign, variant_differences


def worth(flown: Sequence[tuple[Experiment, pl.DataFrame]]) -> str:
    """A table per experiment that flew variants, and a sentence on those that change nothing.

    Args:
        flown: Experiments with their tables.
    """
    text = (
        "Variant minus what it is judged against, same law, same seeds, over the flights that both ended as planned; "
        f"**bold** as above, from {needed()} pairs on. A positive difference of an error means that the part helps. "
        "*Done* counts the flights of the variant and of its reference that ended as planned, out of the seeds that "
        "both flew.\n"
    )
    for experiment, table in flown:
        columns = shown(experiment, table)
        found = variant_differences(table, REFERENCES, [column.metric for column in columns])
        found = [entry for entry in found if not folded(experiment, entry["params"])]
        if not found:
            continue
        found.sort(key=lambda entry: list(REFERENCES).index(entry["variant"]))
        told = varying([entry["params"] for entry in found])
        text += f"\n**{experiment.title}**\n\n"
        text += markdown(
            ("variant", "against", "law", "cell", "done", "pairs", *headed(columns)),
            [_row(experiment, entry, params, columns) for entry, params in zip(found, told, strict=True)],
        )
        text += _idle(found, columns)
    return text


def _row(experiment: Experiment, entry: dict[str, Any], params: dict[str, Any], columns: Sequence[Column]) -> list[str]:
    reference, variant = entry["failed"]
    flown = entry["flown"]
    done = f"{flown - variant} and {flown - reference} of {flown}"
    row = [entry["variant"], entry["against"], law_name(entry["law"]), cell(experiment, params), done]
    return [
        *row,
        str(entry["n"]),
        *(difference(of(entry["differences"], column, entry["params"]), column) for column in columns),
    ]


def difference(found: dict[str, float] | None, column: Column) -> str:
    """A difference with its exact interval, bold when it is sure; the median alone of too few pairs."""
    text = figure(found, column, plus=True, ends=("sure_low", "sure_high"))
    return f"**{text}**" if found is not None and column.better and sign(found) else text


def _idle(found: Sequence[dict[str, Any]], columns: Sequence[Column]) -> str:
    """Which variants leave every judged figure as it is, to the digits shown."""
    lines = []
    for name, law in dict.fromkeys((entry["variant"], entry["law"]) for entry in found):
        entries = [entry for entry in found if (entry["variant"], entry["law"]) == (name, law)]
        if any(sum(entry["failed"]) for entry in entries):
            continue
        moved = [
            (abs(change) * 10.0**column.digits, change, column)
            for column in columns
            for entry in entries
            if column.better and column.metric in entry["differences"]
            for change in (column.scale * entry["differences"][column.metric]["median"],)
        ]
        steps, most, column = max(moved, key=lambda entry: entry[0], default=(np.inf, np.nan, None))
        if column is not None and steps <= _IDLE_STEPS:
            change = f"{rounded(most, column.digits + 1, plus=True)} {column.unit}".rstrip()
            pairs = sum(entry["n"] for entry in entries)
            lines.append(
                f"- *{name}*, {law_name(law)}: does nothing here; over {pairs} pairs no median moves by more than one "
                f"step of the last digit shown (the most: {column.label} {change})."
            )
    return "\n" + "\n".join(lines) + "\n" if lines else ""


#: A variant does nothing when no median moves by more than this many steps of the last digit shown.
_IDLE_STEPS = 1.0
