"""A table of numbers that grows row by row."""

from __future__ import annotations

import numpy as np


class Columns:
    """Named columns of one or more numbers each.

    Args:
        widths: Numbers per row of each column, in the order of a row.
        dtype: Type of the stored numbers.
    """

    def __init__(self, widths: dict[str, int], dtype: type = np.float64) -> None:
        self._widths, self._dtype = widths, dtype
        self._rows: list[np.ndarray] = []

    def __len__(self) -> int:
        """Rows so far."""
        return len(self._rows)

    def add(self, *parts: np.ndarray) -> None:
        """Append a row: its numbers in the order of the columns, split into 1-D arrays at will."""
        self._rows.append(np.concatenate(parts, dtype=self._dtype))

    def rows(self, first: int, end: int) -> list[np.ndarray]:
        """Some rows."""
        return self._rows[first:end]

    def arrays(self) -> dict[str, np.ndarray]:
        """Every column so far, (N,) or (N, width)."""
        return split(np.array(self._rows, self._dtype).reshape(len(self), sum(self._widths.values())), self._widths)


def split(table: np.ndarray, widths: dict[str, int]) -> dict[str, np.ndarray]:
    """Columns of a table by name, (N,) or (N, width)."""
    columns = np.split(table, np.cumsum(list(widths.values()))[:-1], axis=1)
    return {
        name: np.ascontiguousarray(column[:, 0] if width == 1 else column)
        for (name, width), column in zip(widths.items(), columns, strict=True)
    }
