"""What every colour means in every light: thousands of colours are looked up per picture."""

from __future__ import annotations

import ctypes
import math

import numpy as np

from ibvs_qp.vision.light import STEP
from ibvs_qp.vision.native import native, place

#: Labels of a colour.
OTHER, BOARD, PAINT = 0, 1, 2
#: Bits per channel of a table, the shift that leaves them, entries of one table.
_BITS, _SHIFT, TABLE_SIZE = 5, 3, 1 << 15
_STEPS = np.array((1 << 2 * _BITS, 1 << _BITS, 1), np.float32)
#: Drift of the board that renews the tables, and the brightest that a channel can be [grey levels].
_DRIFT, _WHITE = 1.5, 255.0


class LabelTables:
    """Labels of all colours in steps of eight grey levels, one table for each level of light, kept while they hold."""

    def __init__(self, gate: float) -> None:
        """Take the distance within which a colour matches, in the light of the reference."""
        self._gate = gate
        self._board: np.ndarray | None = None
        self._paint: np.ndarray | None = None
        self._tables: dict[int, np.ndarray] = {}
        self._joined, self._steps = np.zeros(0, np.uint8), ()

    def of(self, board: np.ndarray, paint: np.ndarray | None, steps: tuple[int, ...]) -> np.ndarray:
        """Labels in several levels of light, red first, uint8 (levels * 32768,).

        Args:
            board: Colour of the board in the light of the reference, (3,).
            paint: The same of the paint, or None where it cannot be told from the board.
            steps: Logarithm of the light of every level, in steps of `light.STEP`.
        """
        if _differ(paint, self._paint) or _differ(board, self._board):
            self._board, self._paint, self._steps = board.copy(), paint, ()
            self._tables.clear()
        if self._steps != steps:
            for step in steps:
                if step not in self._tables:
                    self._tables[step] = self._made(math.exp(STEP * step))
            tables = [self._tables[step] for step in steps]
            self._joined, self._steps = tables[0] if len(tables) == 1 else np.concatenate(tables), steps
        return self._joined

    def _made(self, light: float) -> np.ndarray:
        """One table; gates shrink and grow with the light, as all differences of colours do."""
        gate, library = np.float32((self._gate * light) ** 2), native()
        board, paint = (
            None if color is None else np.minimum(np.float32(light) * color, np.float32(_WHITE))
            for color in (self._board, self._paint)
        )
        assert board is not None
        if library is None:
            return _made_with_numpy(board, paint, gate)
        table = np.empty(TABLE_SIZE, np.uint8)
        library.label_table(place(board), place(paint), ctypes.c_float(float(gate)), place(table))
        return table


def _differ(one: np.ndarray | None, two: np.ndarray | None) -> bool:
    """Whether two colours, known or not, differ by more than a drift."""
    if one is None or two is None:
        return one is not two
    return one is not two and bool(np.abs(one - two).max() > _DRIFT)


def places_in_table(colors: np.ndarray) -> np.ndarray:
    """Places of colours uint8 (..., 3) in a table, (...)."""
    # single precision holds the place exactly, and has the only fast product
    return ((colors >> _SHIFT).astype(np.float32) @ _STEPS).astype(np.intp)


def _made_with_numpy(board: np.ndarray, paint: np.ndarray | None, gate: np.floating) -> np.ndarray:
    """A table where there is no machine code."""
    to_board = _distances(board)
    table = (to_board < gate).view(np.uint8)  # true is BOARD, false OTHER
    if paint is not None:
        to_paint = _distances(paint)
        table[(to_paint < gate) & (to_paint < to_board)] = PAINT
    return table


def _distances(reference: np.ndarray) -> np.ndarray:
    """Squared RGB distance of all colours of a table from one, float32 (32768,)."""
    level = (np.arange(1 << _BITS, dtype=np.float32) + np.float32(0.5)) * np.float32(1 << _SHIFT)
    red, green, blue = ((level - part) ** 2 for part in reference)
    return (red[:, None, None] + green[:, None] + blue).reshape(-1)
