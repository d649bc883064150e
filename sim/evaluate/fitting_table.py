"""A table that fits its console: text wraps, numbers stay whole, columns without room follow below."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderResult
from rich.table import Column, Table

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
