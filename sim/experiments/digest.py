"""The table of results in the README, from the table of a full run; ``readme.toml`` lists its lines.

``python -m sim.experiments.digest docs/experiments/all.parquet README.md`` renews it.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from ibvs_qp.config.settings import load_toml
from sim.evaluate.table import markdown
from sim.experiments.spec import Column
from sim.experiments.wording import rounded
from sim.sweep.spec import LAWS
from sim.sweep.statistics import median_interval, select

#: Marks around the table.
BEGIN, END = "<!-- experiments: generated -->", "<!-- end of experiments -->"


@dataclass(frozen=True, kw_only=True)
class Line(Column):
    """A line: one metric over the flights of both laws in the cells of `where`."""

    experiment: str  # name of the experiment
    variant: str = "standard"  # variant of the controller
    published: str = "–"  # value in the literature
    also: tuple[Column, ...] = ()  # further metrics behind it; their labels hold "{}" for the number
    # if given, the number of flights, failed ones included, that reach this value replaces the median
    at_least: float | None = None


@dataclass(frozen=True, kw_only=True)
class Lines:
    """Content of ``readme.toml``."""

    lines: tuple[Line, ...]


LINES = load_toml(Lines, Path(__file__).with_name("readme.toml")).lines


def digest(table: pl.DataFrame, lines: Sequence[Line] = LINES) -> str:
    """Markdown table of the lines that have flights in a table of all experiments."""
    heads = ("", "QP", "analytic law", "published", "flights, QP and analytic", "command: `ibvs-qp`")
    cells = []
    for line in lines:
        rows = select(table.filter(pl.col("experiment") == line.experiment), line.where, variant=line.variant)
        if rows.height:
            laws = [rows.filter(pl.col("law") == law) for law in LAWS]
            count = ", ".join(str(each.height) if each.height else "–" for each in laws)
            values = (_value(each, line) for each in laws)
            cells.append((line.label, *values, line.published, count, f"`experiment {line.experiment}`"))
    return markdown(heads, cells)


def _value(rows: pl.DataFrame, line: Line) -> str:
    """Median with its interval over the flights that ended as planned, and the number of other flights."""
    if not rows.height:
        return "–"
    if line.at_least is not None:
        return f"{int((rows[line.metric].fill_null(0.0) >= line.at_least).sum())} of {rows.height}"
    done = rows.filter(pl.col("completed"))
    failed = [f"fails in {rows.height - done.height} of {rows.height}"] if done.height < rows.height else []
    values = line.scale * done[line.metric].drop_nulls().to_numpy()
    if not values.size:
        return "".join(failed) or "–"
    middle, low, high = (rounded(value, line.digits) for value in median_interval(values).values())
    parts = [middle if low == high else f"{middle} ({low} to {high})"]
    for column in line.also:
        more = done[column.metric].drop_nulls().to_numpy()
        if more.size:
            parts.append(column.label.format(rounded(column.scale * float(np.median(more)), column.digits)))
    return "; ".join(parts + failed)


def put_into(text: str, table: str) -> str:
    """A text with a new table between `BEGIN` and `END`.

    Raises:
        ValueError: When the marks are missing.
    """
    head, tail = text.index(BEGIN) + len(BEGIN), text.index(END)
    return f"{text[:head]}\n{table}{text[tail:]}"


if __name__ == "__main__":
    data, page = map(Path, sys.argv[1:3])
    page.write_text(put_into(page.read_text(encoding="utf-8"), digest(pl.read_parquet(data))), encoding="utf-8")
