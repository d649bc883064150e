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
from sim.experiments.comparison import SHIPPED, best_allocator, rivals
from sim.experiments.spec import Column
from sim.experiments.wording import rounded
from sim.sweep.statistics import median_interval, select, spread

#: Marks around the table.
BEGIN, END = "<!-- experiments: generated -->", "<!-- end of experiments -->"


@dataclass(frozen=True, kw_only=True)
class Line(Column):
    """A line: one metric over the flights of the QP and of the analytic law in the cells of `where`."""

    experiment: str  # name of the experiment
    variant: str = "standard"  # variant of the controller
    published: str = "–"  # value in the literature, where it is comparable
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
    heads = ("", "QP", "analytic law (clip)", "its best allocator", "published", "flights", "`ibvs-qp experiment`")
    cells = []
    for line in lines:
        rows = select(table.filter(pl.col("experiment") == line.experiment), line.where)
        qp, flown = select(rows, law="qp", variant=line.variant), rivals(rows, line.variant)
        if not qp.height:
            continue
        count = str(max(each.height for each in (qp, *flown.values())))
        best = _best(flown, line) if len(flown) > 1 else ""
        clip = _value(flown[SHIPPED], line) if SHIPPED in flown else "–"
        other = f"{best}: {_value(flown[best], line)}" if best not in ("", SHIPPED) else best or "–"
        cells.append((line.label, _value(qp, line), clip, other, line.published, count, line.experiment))
    return markdown(heads, cells)


def _best(flown: dict[str, pl.DataFrame], line: Line) -> str:
    """The allocator of the best value of a line."""
    if line.at_least is None:
        return best_allocator(flown, line)
    return max(flown, key=lambda name: _reached(flown[name], line) / flown[name].height)


def _reached(rows: pl.DataFrame, line: Line) -> int:
    """Number of flights, failed ones included, whose metric is at least that of the line."""
    return int((rows[line.metric].cast(pl.Float64).fill_null(0.0) >= line.at_least).sum())


def _value(rows: pl.DataFrame, line: Line) -> str:
    """Median with its interval over the flights that ended as planned, and the number of other flights."""
    if not rows.height:
        return "–"
    if line.at_least is not None:
        return f"{_reached(rows, line)} of {rows.height}"
    done = rows.filter(pl.col("completed"))
    failed = [f"fails in {rows.height - done.height} of {rows.height}"] if done.height < rows.height else []
    values = line.scale * done[line.metric].drop_nulls().to_numpy()
    if not values.size:
        return "".join(failed) or "–"
    middle, low, high = (rounded(value, line.digits) for value in median_interval(values).values())
    parts = [middle if low == high else f"{middle} ({spread(low, high, values.size)})"]
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
