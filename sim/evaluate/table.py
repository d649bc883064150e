"""Tables for the terminal and in Markdown."""

from __future__ import annotations

from collections.abc import Collection, Container, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Column, Table

if TYPE_CHECKING:
    from rich.table import Table


#: Longest word of a text that gets a line of its own; longer ones are broken [characters].
LONGEST_WORD = 24
#: Characters between two columns, and those at both edges.
BETWEEN, EDGES = 3, 2


@dataclass
class _Width:
    """Width of a column [characters]: the least that cuts nothing, and the present one."""

    least: int
    now: int


class FittingTable(Table):
    """A table of one-line cells.

    Args:
        title: Above the first part.
    """

    def __init__(self, title: str | None = None) -> None:
        super().__init__(box=box.SIMPLE_HEAD, pad_edge=False, title=title, title_justify="left")

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Render as many tables below each other as the width needs."""
        widths = [_width(console, column) for column in self.columns]
        for number, part in enumerate(_parts(widths, options.max_width)):
            _shrink([widths[i] for i in part], options.max_width)
            table = Table(box=self.box, pad_edge=False, title=None if number else self.title, title_justify="left")
            for i in part:
                column = self.columns[i]
                table.add_column(column.header, justify=column.justify, width=widths[i].now, overflow="fold")
            for row in zip(*(self.columns[i].cells for i in part), strict=True):
                table.add_row(*row)
            yield table


def _width(console: Console, column: Column) -> _Width:
    """Width of a column: text needs that of its longest word, numbers that of their longest cell."""
    heading, *cells = (console.render_str(str(cell)).plain for cell in (column.header, *column.cells))
    whole = cells if column.no_wrap else []
    words = [word for text in (heading, *([] if column.no_wrap else cells)) for word in text.split()]
    least = max([min(cell_len(word), LONGEST_WORD) for word in words] + [cell_len(cell) for cell in whole], default=1)
    return _Width(least, max(least, *(cell_len(text) for text in (heading, *cells))))


def _parts(widths: Sequence[_Width], room: int) -> list[list[int]]:
    """Columns of every part: the first one and equally many others, in the fewest parts that cut nothing."""
    parts = [list(range(len(widths)))]
    for count in range(1, len(widths)):
        parts = [[0, *part.tolist()] for part in np.array_split(np.arange(1, len(widths)), count)]
        if all(_taken([widths[i].least for i in part]) <= room for part in parts):
            break
    return parts


def _taken(widths: Sequence[int]) -> int:
    """Width of a table by those of its columns [characters]."""
    return sum(widths) + BETWEEN * (len(widths) - 1) + EDGES


def _shrink(widths: Sequence[_Width], room: int) -> None:
    """Shorten the widest columns to the room; the first column of a later part keeps its width."""
    for _ in range(_taken([width.now for width in widths]) - room):
        loose = [width for width in widths if width.now > width.least]
        if not loose:
            break
        max(loose, key=lambda width: width.now).now -= 1


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
    from sim.evaluate.table import FittingTable

    table = FittingTable(title)
    left = headings[:1] if text is None else text
    for heading in headings:
        words = heading in left or heading in wrap
        table.add_column(heading, justify="left" if heading in left else "right", no_wrap=not words)
    for row in rows:
        table.add_row(*row)
    return table
