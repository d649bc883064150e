"""Tables for the terminal and in Markdown."""

from __future__ import annotations

from collections.abc import Collection, Container, Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]], left: Container[int] | None = None) -> str:
    """A Markdown table that ends with a line break.

    Args:
        heads: Headings of the columns.
        rows: Cells of every row.
        left: Indices of the left-aligned columns, the others are numbers; None leaves the alignment open.
    """
    rule = "".join("---|" if left is None else ":--|" if place in left else "--:|" for place in range(len(heads)))
    lines = ["|" + "|".join(f" {cell} " if cell else " " for cell in line) + "|" for line in (heads, *rows)]
    return "\n".join([lines[0], "|" + rule, *lines[1:]]) + "\n"


def plain(value: object) -> str:
    """A value from a file of unknown origin, without markup and without effect on the terminal."""
    from rich.markup import escape

    text = str(value)
    return escape(text if text.isprintable() else repr(text))


def terminal_table(
    headings: Sequence[str],
    rows: Iterable[Sequence[str]],
    title: str | None = None,
    *,
    text: Collection[str] | None = None,
    wrap: Collection[str] = (),
) -> Table:
    """A table for the terminal. It fits the width: text wraps, numbers stay whole, further columns follow below.

    Args:
        headings: Of the columns; those below each other repeat the first.
        rows: Cells of every row.
        title: Above the table.
        text: Headings of left-aligned columns; default: the first. All others are numbers.
        wrap: Headings of right-aligned columns that are text too.
    """
    from sim.evaluate.fitting_table import FittingTable

    table = FittingTable(title)
    left = headings[:1] if text is None else text
    for heading in headings:
        words = heading in left or heading in wrap
        table.add_column(heading, justify="left" if heading in left else "right", no_wrap=not words)
    for row in rows:
        table.add_row(*row)
    return table
