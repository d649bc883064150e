"""What the surface looks like: the board's colour, sampled where it is, and the paint's, known to the strategy."""

from __future__ import annotations

import numpy as np

#: Share of a new sample in the board's running colour.
_BLEND = 0.2
#: Labels of `SurfaceColors.label`.
OTHER, BOARD, PAINT = 0, 1, 2
#: Colours nearer to each other than this share of the gate cannot be told apart.
_DISTINCT = 0.8


class SurfaceColors:
    """Decides whether a colour is the board's, the paint's or neither."""

    def __init__(self, board: tuple[int, int, int] | None, paint: tuple[int, int, int] | None, gate: float) -> None:
        """Take the known colours (RGB 0..255) and the distance within which a colour matches."""
        self._given = None if board is None else np.asarray(board, np.float32)
        self.paint = None if paint is None else np.asarray(paint, np.float32)
        self._gate = gate
        self.reset()

    def reset(self) -> None:
        """Forget the sampled colour of the board."""
        self.board = None if self._given is None else self._given.copy()

    def learn(self, samples: np.ndarray) -> None:
        """Sample the board: median of the unpainted colours among (n, 3) samples; few samples change nothing."""
        if self._given is not None:
            return
        samples = samples.astype(np.float32)
        if self.paint is not None and len(samples):
            samples = samples[self._distance(samples, self.paint) > self._gate**2]
        if self.board is not None and len(samples):
            near = samples[self._distance(samples, self.board) < self._gate**2]
            samples = near if len(near) > len(samples) // 4 else samples[:0]
        if len(samples) < 8:
            return
        median = np.median(samples, axis=0)
        self.board = median if self.board is None else self.board + _BLEND * (median - self.board)

    def label(self, colors: np.ndarray) -> np.ndarray:
        """OTHER, BOARD or PAINT for colours (..., 3); all OTHER while the board is unknown."""
        colors = colors.astype(np.float32, copy=False)
        result = np.zeros(colors.shape[:-1], np.uint8)
        if self.board is None:
            return result
        to_board = self._distance(colors, self.board)
        result[to_board < self._gate**2] = BOARD
        if self.paint_distinct and self.paint is not None:
            to_paint = self._distance(colors, self.paint)
            result[(to_paint < self._gate**2) & (to_paint < to_board)] = PAINT
        return result

    @property
    def paint_distinct(self) -> bool:
        """Whether paint and board are both known and differ."""
        if self.board is None or self.paint is None:
            return False
        return float(self._distance(self.paint, self.board)) > (_DISTINCT * self._gate) ** 2

    @staticmethod
    def _distance(colors: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Squared RGB distance, (...)."""
        offset = colors - reference
        return np.einsum("...i,...i->...", offset, offset)
