"""A table of numbers that grows row by row: bytes joined as they come, picked apart at the end."""

from __future__ import annotations

import numpy as np

#: Rows kept as they came before they are made an array of the wanted type.
BLOCK_ROWS = 1024


class Columns:
    """Named columns, each of one or more numbers.

    Attributes:
        places: Where each column lies in a row.

    Args:
        widths: Numbers per row of each column.
        dtype: Of all of them once they are stored; rows come in double precision.
    """

    def __init__(self, widths: dict[str, int], dtype: type = np.float64) -> None:
        self._dtype = dtype
        self.places: dict[str, slice] = {}
        self._width = 0
        for name, width in widths.items():
            self.places[name] = slice(self._width, self._width + width)
            self._width += width
        self._blocks: list[np.ndarray] = []
        self._rows: list[bytes] = []

    def __len__(self) -> int:
        """Rows so far."""
        return sum(map(len, self._blocks)) + len(self._rows)

    def add(self, row: bytes) -> None:
        """The next row, all its numbers in double precision."""
        rows = self._rows
        rows.append(row)
        if len(rows) == BLOCK_ROWS:
            self._blocks.append(self._block(rows))
            self._rows = []

    def _block(self, rows: list[bytes]) -> np.ndarray:
        numbers = np.frombuffer(b"".join(rows)).reshape(len(rows), self._width)
        return numbers.astype(self._dtype, copy=False)

    def arrays(self) -> dict[str, np.ndarray]:
        """Every column so far, (N,) or (N, width)."""
        blocks = [*self._blocks, self._block(self._rows)]
        # Straight from the blocks: a table in between would be as many bytes again, of memory never touched before.
        columns = {name: np.concatenate([block[:, place] for block in blocks]) for name, place in self.places.items()}
        return {name: column[:, 0] if column.shape[1] == 1 else column for name, column in columns.items()}
