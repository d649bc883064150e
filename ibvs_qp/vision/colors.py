"""What the surface looks like: the board's colour, sampled where it is, and the paint's, known to the strategy."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.grid import CoarseGrid

#: Share of a new sample in the board's running colour.
_BLEND = 0.2
#: Samples whose median is taken; more cost time and change nothing.
_JUDGED = 500
#: Bits per channel of the label table, the shift that leaves them, and the board's drift that renews it.
_TABLE_BITS, _TABLE_SHIFT, _TABLE_DRIFT = 5, 3, 1.5
_TABLE_STEPS = np.array((1 << 2 * _TABLE_BITS, 1 << _TABLE_BITS, 1), np.float32)
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
        self._table = np.zeros(0, np.uint8)
        self._table_board = np.zeros(3, np.float32)

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
        ordered = np.sort(samples[:: max(1, len(samples) // _JUDGED)], axis=0)
        median = ordered[len(ordered) // 2]
        self.board = median if self.board is None else self.board + _BLEND * (median - self.board)

    def label(self, colors: np.ndarray) -> np.ndarray:
        """OTHER, BOARD or PAINT for colours uint8 (..., 3); all OTHER while the board is unknown."""
        if self.board is None:
            return np.zeros(colors.shape[:-1], np.uint8)
        if len(self._table) == 0 or np.abs(self.board - self._table_board).max() > _TABLE_DRIFT:
            self._make_table(self.board)
        # single precision holds the place exactly, and has the only fast product
        return self._table.take(((colors >> _TABLE_SHIFT).astype(np.float32) @ _TABLE_STEPS).astype(np.intp))

    def _make_table(self, board: np.ndarray) -> None:
        """Labels of all colours in steps of eight grey levels: thousands of colours are looked up per picture."""
        to_board = _distances(board)
        table = np.where(to_board < self._gate**2, np.uint8(BOARD), np.uint8(OTHER))
        if self.paint_distinct and self.paint is not None:
            to_paint = _distances(self.paint)
            table[(to_paint < self._gate**2) & (to_paint < to_board)] = PAINT
        self._table, self._table_board = table, board.copy()

    def like_around(self, grid: CoarseGrid, colors: np.ndarray, seed: tuple[int, int], radius: int) -> np.ndarray:
        """Labels of samples by the colour around a seed: BOARD for what looks like it, uint8 (rows, columns)."""
        around = self._around(grid, colors, seed, radius)
        if around is None:
            return np.full(grid.shape, BOARD, np.uint8)
        samples = colors.astype(np.float32)
        labels = np.where(self._distance(samples, around) < self._gate**2, np.uint8(BOARD), np.uint8(OTHER))
        if self.paint is not None and float(self._distance(self.paint, around)) > self._gate**2:
            labels[(labels == OTHER) & (self._distance(samples, self.paint) < self._gate**2)] = PAINT
        return labels

    def bare(
        self, grid: CoarseGrid, colors: np.ndarray, seeds: list[tuple[int, int]], radius: int
    ) -> list[tuple[int, int]]:
        """Those of the seeds that do not lie on paint; all of them if every one does, or if the paint is unknown."""
        if self.paint is None:
            return seeds
        around = [self._around(grid, colors, seed, radius) for seed in seeds]
        limit = self._gate**2
        return [
            seed
            for seed, color in zip(seeds, around, strict=True)
            if color is None or float(self._distance(self.paint, color)) > limit
        ] or seeds

    @staticmethod
    def _around(grid: CoarseGrid, colors: np.ndarray, seed: tuple[int, int], radius: int) -> np.ndarray | None:
        """Median colour of the samples around a seed that the vehicle leaves free, (3,), or None without any."""
        rows, columns = grid.window(seed, radius)
        window = colors[rows, columns][grid.free[rows, columns]]
        return np.sort(window, axis=0)[len(window) // 2].astype(np.float32) if len(window) else None

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


def _distances(reference: np.ndarray) -> np.ndarray:
    """Squared RGB distance of all colours of the label table from one, float32 (32768,)."""
    level = (np.arange(1 << _TABLE_BITS, dtype=np.float32) + np.float32(0.5)) * np.float32(1 << _TABLE_SHIFT)
    red, green, blue = ((level - part) ** 2 for part in reference)
    return (red[:, None, None] + green[:, None] + blue).reshape(-1)
