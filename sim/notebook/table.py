"""Markdown tables of the notebooks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from sim.evaluate.table import markdown

#: Text of a missing value.
MISSING = "–"


def number(value: float | None, form: str = ".2f", missing: str = MISSING) -> str:
    """Format a number; None, NaN and infinity become `missing`."""
    return format(value, form) if value is not None and math.isfinite(value) else missing


def table(header: Sequence[str], rows: Iterable[Sequence[object]], left: int = 1) -> str:
    """Build a markdown table.

    Args:
        header: Titles of the columns.
        rows: Cells of every row; numbers have the format of `number`.
        left: How many columns, from the first, are aligned left; the others are aligned right.
    """
    texts = ([number(cell) if isinstance(cell, float) else str(cell) for cell in line] for line in rows)
    return markdown(header, texts, range(left)).rstrip()
