"""Common parts of the sections of the results page: capped tables, groups, and headings of the effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import polars as pl

from sim.evaluate.table import markdown
from sim.experiments.relevance import Effect
from sim.experiments.spec import Experiment

Flown = Sequence[tuple[Experiment, pl.DataFrame]]
T = TypeVar("T")
K = TypeVar("K")

#: Headings of the effects, QP law first.
HEADINGS = {
    Effect.FIRST: "QP better",
    Effect.SECOND: "analytic better",
    Effect.IRRELEVANT: "does not matter",
    Effect.OPEN: "undecided",
    Effect.FEW: "too few pairs",
}
#: Most rows of one table of the page; tables.md has all.
MOST_ROWS = 15


def capped(heads: Sequence[str], rows: Sequence[Sequence[str]], most: int = MOST_ROWS) -> str:
    """A Markdown table of the first rows, and how many more there are."""
    more = f"\n{len(rows) - most} more rows are in [tables.md](tables.md).\n" if len(rows) > most else ""
    return markdown(heads, rows[:most]) + more


def world_of(params: dict[str, Any]) -> str:
    """World of a cell; a dash if its experiment flies in one world only."""
    return str(params.get("world", "–"))


def grouped(items: Sequence[T], key: Callable[[T], K]) -> dict[K, list[T]]:
    """Items by key, in their order."""
    groups: dict[K, list[T]] = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return groups
