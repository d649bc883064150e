"""A table of floats that grows row by row: preallocated blocks instead of a small array per entry."""

from __future__ import annotations

import numpy as np

#: Rows of one block: half a minute of flight at the control rate.
BLOCK_ROWS = 8192


class Columns:
    """Named columns, each of one or more numbers.

    Attributes:
        places: Where each column lies in a row.

    Args:
        widths: Numbers per row of each column.
        dtype: Of all of them.
    """

    def __init__(self, widths: dict[str, int], dtype: type = np.float64) -> None:
        self._dtype = dtype
        self.places: dict[str, slice] = {}
        self._width = 0
        for name, width in widths.items():
            self.places[name] = slice(self._width, self._width + width)
            self._width += width
        self._blocks: list[np.ndarray] = []
        self._count = 0

    def __len__(self) -> int:
        """Rows so far."""
        return self._count

    def row(self) -> np.ndarray:
        """The next row, to be filled in, (numbers per row,)."""
        place = self._count % BLOCK_ROWS
        if place == 0:
            self._blocks.append(np.zeros((BLOCK_ROWS, self._width), self._dtype))
        self._count += 1
        return self._blocks[-1][place]

    def arrays(self) -> dict[str, np.ndarray]:
        """Every column so far, (N,) or (N, width)."""
        table = np.concatenate([np.zeros((0, self._width), self._dtype), *self._blocks])[: self._count]
        columns = {name: table[:, place] for name, place in self.places.items()}
        return {
            name: np.ascontiguousarray(column[:, 0] if column.shape[1] == 1 else column)
            for name, column in columns.items()
        }
