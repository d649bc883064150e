"""Effect of each part of the controller: variants against the variant that has the part, seed by seed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import polars as pl

from sim.evaluate.table import law_name, markdown
from sim.experiments.spec import Column, Experiment
from sim.experiments.variants import REFERENCES
from sim.experiments.wording import cell, difference, headings, measured, rounded, value_of, varying
from sim.sweep.paired import needed, variant_differences

#: A variant has no effect if no median moves by more than this many steps of the last decimal shown.
_IDLE_STEPS = 1.0


def worth(flown: Sequence[tuple[Experiment, pl.DataFrame]]) -> str:
    """A table for each experiment with variants, and a sentence on variants without effect."""
    text = (
        "Variant minus its reference with the same law and seeds, over the flights that both ended as planned; "
        f"**bold** as above, from {needed()} pairs on. A positive difference of an error means that the part helps. "
        "*Done* counts the flights of the variant and of its reference that ended as planned, of the seeds that both "
        "flew.\n"
    )
    for experiment, table in flown:
        columns = measured(experiment, table)
        found = variant_differences(table, REFERENCES, [column.metric for column in columns])
        found = [entry for entry in found if not experiment.is_folded(entry["params"])]
        if not found:
            continue
        found.sort(key=lambda entry: list(REFERENCES).index(entry["variant"]))
        shown = varying([entry["params"] for entry in found])
        text += f"\n**{experiment.title}**\n\n"
        text += markdown(
            ("variant", "reference", "law", "cell", "done", "pairs", *headings(columns)),
            [_row(entry, cell(experiment, params), columns) for entry, params in zip(found, shown, strict=True)],
        )
        text += _idle(found, columns)
    return text


def _row(entry: dict[str, Any], where: str, columns: Sequence[Column]) -> list[str]:
    reference, variant = entry["failed"]
    flown = entry["flown"]
    done = f"{flown - variant} and {flown - reference} of {flown}"
    row = [entry["variant"], entry["against"], law_name(entry["law"]), where, done, str(entry["n"])]
    return row + [difference(value_of(entry["differences"], column, entry["params"]), column) for column in columns]


def _idle(found: Sequence[dict[str, Any]], columns: Sequence[Column]) -> str:
    """Variants that leave every metric with a direction unchanged, to the decimals shown."""
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
                f"- *{name}*, {law_name(law)}: no effect here; over {pairs} pairs no median changes by more than one "
                f"step of the last decimal shown (largest change: {column.label} {change})."
            )
    return "\n" + "\n".join(lines) + "\n" if lines else ""
