"""Numbers, cells and tables of the results page in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import polars as pl

from sim.experiments.base import Column, Experiment


def rounded(value: float, digits: int, plus: bool = False) -> str:
    """A number with so many decimals, without the sign of what rounds to zero; a dash for none."""
    if not np.isfinite(value):
        return "–"
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0.0 else f"{value:+.{digits}f}" if plus else text


def figure(
    value: dict[str, float] | None, column: Column, plus: bool = False, ends: tuple[str, str] = ("low", "high")
) -> str:
    """Median with its interval in the unit of a column."""
    if value is None or not np.isfinite(value["median"]):
        return "–"
    middle, low, high = (
        rounded(column.scale * value[name], column.digits, plus) for name in ("median", ends[0], ends[1])
    )
    return middle if low == high or "–" in (low, high) else f"{middle} ({low} to {high})"


def entry(value: Any) -> str:
    """A parameter's value."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value).replace("_", " ")


def cell(experiment: Experiment, params: dict[str, Any]) -> str:
    """The parameters of a cell: "hold, wall 1500 N/m"."""
    return ", ".join(_parameter(experiment.params.get(name, name), name, value) for name, value in params.items())


def varying(listed: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Each cell's parameters without those that are the same in all cells."""
    told = {name for params in listed for name in params if len({str(each.get(name)) for each in listed}) > 1}
    return [{name: value for name, value in params.items() if name in told} for params in listed]


def _parameter(heading: str, name: str, value: Any) -> str:
    if name == "kind":
        return entry(value)
    if isinstance(value, bool):
        return heading if value else f"not {heading}"
    if heading.count("[") == 1 and heading.endswith("]"):
        words, unit = heading[:-1].split(" [")
        return f"{words} {entry(value)} {unit}"
    return f"{heading.split(' [')[0]} {entry(value)}"


def headed(columns: Sequence[Column]) -> list[str]:
    """Headings of figures, with their units."""
    return [column.label + (f" [{column.unit}]" if column.unit else "") for column in columns]


def markdown(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table, with a line break after it."""
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)]) + "\n"


def shown(experiment: Experiment, table: pl.DataFrame) -> list[Column]:
    """Columns of an experiment that its table holds."""
    return [column for column in experiment.columns if column.metric in table.columns]


def of(figures: Mapping[str, Any], column: Column, params: Mapping[str, Any]) -> Any:
    """What a cell has of a column; None where the column does not apply."""
    return (
        figures.get(column.metric) if all(params.get(name) == value for name, value in column.where.items()) else None
    )


def folded(experiment: Experiment, params: dict[str, Any]) -> bool:
    """Whether a cell is one that the tables fold away."""
    return bool(experiment.folded) and all(params.get(name) == value for name, value in experiment.folded.items())
