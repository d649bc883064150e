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
    """A table for the terminal.

    Args:
        headings: Of the columns.
        rows: Cells of every row.
        title: Above the table.
        text: Headings of left-aligned columns; default: the first. All others are numbers.
        wrap: Headings of the columns whose cells may take several lines.
    """
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title=title, title_justify="left")
    left = headings[:1] if text is None else text
    for heading in headings:
        justify = "left" if heading in left else "right"
        wraps = heading in wrap
        table.add_column(heading, justify=justify, no_wrap=not wraps, overflow="fold" if wraps else "ellipsis")
    for row in rows:
        table.add_row(*row)
    return table
