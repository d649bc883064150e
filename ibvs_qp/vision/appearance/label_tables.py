"""What every colour means in every light: thousands of colours are looked up per picture."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.appearance.light import STEP
from ibvs_qp.vision.kernels.labels import UNKNOWN, label_table

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
        board, paint = (
            UNKNOWN if color is None else np.minimum(np.float32(light) * color, np.float32(_WHITE))
            for color in (self._board, self._paint)
        )
        return label_table(board, paint, self._gate * light)


def _differ(one: np.ndarray | None, two: np.ndarray | None) -> bool:
    """Whether two colours, known or not, differ by more than a drift."""
    if one is None or two is None:
        return one is not two
    return one is not two and bool(np.abs(one - two).max() > _DRIFT)
