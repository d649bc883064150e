"""A table of numbers that grows row by row."""

from __future__ import annotations

import numpy as np

#: Rows allocated at a time.
BLOCK_ROWS = 1024


class Columns:
    """Named columns of one or more numbers each.

    Args:
        widths: Numbers per row of each column, in the order of a row.
        dtype: Type of the stored numbers.
    """

    def __init__(self, widths: dict[str, int], dtype: type = np.float64) -> None:
        self._dtype, self._width = dtype, sum(widths.values())
        ends = np.cumsum([0, *widths.values()]).tolist()
        self._places = {name: slice(*ends[k : k + 2]) for k, name in enumerate(widths)}
        self._blocks: list[np.ndarray] = []
        self._count = 0

    def __len__(self) -> int:
        """Rows so far."""
        return self._count

    def add(self, *parts: np.ndarray) -> None:
        """Append a row: its numbers in the order of the columns, split into 1-D arrays at will."""
        row = self._count % BLOCK_ROWS
        if row == 0:
            self._blocks.append(np.empty((BLOCK_ROWS, self._width), self._dtype))
        np.concatenate(parts, out=self._blocks[-1][row])
        self._count += 1  # last: an interrupt before it drops the row

    def arrays(self) -> dict[str, np.ndarray]:
        """Every column so far, (N,) or (N, width)."""
        return {name: self._column(place) for name, place in self._places.items()}

    def _column(self, place: slice) -> np.ndarray:
        parts = [block[:, place] for block in self._blocks] or [np.empty((0, place.stop - place.start), self._dtype)]
        column = np.concatenate(parts)[: self._count]
        return column[:, 0] if column.shape[1] == 1 else column
