"""What the surface looks like: the board's colour, sampled where it is, and the paint's, known to the strategy."""

from __future__ import annotations

import ctypes
from functools import cached_property

import numpy as np

from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.native import native, place

#: Share of a new sample in the board's running colour.
_BLEND = 0.2
#: Samples whose median is taken; more cost time and change nothing.
_JUDGED = 500
#: Bits per channel of the label table, the shift that leaves them, and the board's drift that renews it.
_TABLE_BITS, _TABLE_SHIFT, _TABLE_DRIFT = 5, 3, 1.5
_TABLE_STEPS = np.array((1 << 2 * _TABLE_BITS, 1 << _TABLE_BITS, 1), np.float32)
_SUM = np.ones(3, np.float32)
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
        library = native()
        if library is not None:
            colors, labels = np.ascontiguousarray(colors), np.empty(colors.shape[:-1], np.uint8)
            parts = (self.table(), labels)
            count = ctypes.c_long(labels.size)
            library.labels_of(place(colors), count, *(place(part) for part in parts))
            return labels
        # single precision holds the place exactly, and has the only fast product
        return self.table().take(((colors >> _TABLE_SHIFT).astype(np.float32) @ _TABLE_STEPS).astype(np.intp))

    def table(self) -> np.ndarray:
        """Labels of all colours in steps of eight grey levels, red first, uint8 (32768,); the board must be known."""
        assert self.board is not None
        if len(self._table) == 0 or np.abs(self.board - self._table_board).max() > _TABLE_DRIFT:
            self._make_table(self.board)
        return self._table

    def _make_table(self, board: np.ndarray) -> None:
        """Labels of all colours in steps of eight grey levels: thousands of colours are looked up per picture."""
        library, self._table_board = native(), board.copy()
        if library is None:
            self._table = self._table_with_numpy(board)
            return
        self._table = np.empty(1 << 3 * _TABLE_BITS, np.uint8)
        paint = self.paint if self.paint_distinct else None
        library.label_table(place(self._table_board), place(paint), ctypes.c_float(self._gate**2), place(self._table))

    def _table_with_numpy(self, board: np.ndarray) -> np.ndarray:
        """The same where there is no machine code."""
        to_board = _distances(board)
        table = (to_board < self._gate**2).view(np.uint8)  # true is BOARD, false OTHER
        if self.paint_distinct:
            places, to_paint = self._paint_colors
            table[places[to_paint < to_board.take(places)]] = PAINT
        return table

    @cached_property
    def _paint_colors(self) -> tuple[np.ndarray, np.ndarray]:
        """Places in the label table that look like paint, and how far they are from it."""
        assert self.paint is not None
        to_paint = _distances(self.paint)
        places = np.flatnonzero(to_paint < self._gate**2)
        return places, to_paint.take(places)

    def like_around(self, grid: CoarseGrid, colors: np.ndarray, seed: tuple[int, int], radius: int) -> np.ndarray:
        """Labels of samples by the colour around a seed: BOARD for what looks like it, uint8 (rows, columns)."""
        [around] = self._around(grid, colors, [seed], radius)
        library = native()
        if library is not None:
            return self._like_natively(library, colors, around)
        return self._like_with_numpy(colors, around)

    def _like_natively(self, library: ctypes.CDLL, colors: np.ndarray, around: np.ndarray) -> np.ndarray:
        paint, apart = self.paint, self._gate**2
        if paint is not None and float(self._distance(paint, around)) <= apart:
            paint = None
        colors, labels = np.ascontiguousarray(colors), np.empty(colors.shape[:-1], np.uint8)
        gate, count = ctypes.c_float(apart), ctypes.c_long(labels.size)
        library.like_colors(place(colors), count, *(place(part) for part in (around, paint)), gate, place(labels))
        return labels

    def _like_with_numpy(self, colors: np.ndarray, around: np.ndarray) -> np.ndarray:
        """The same where there is no machine code."""
        samples = colors.reshape(-1, 3).astype(np.float32)
        labels = (self._distance(samples, around) < self._gate**2).view(np.uint8)
        if self.paint is not None and float(self._distance(self.paint, around)) > self._gate**2:
            labels[(self._distance(samples, self.paint) < self._gate**2) & (labels == OTHER)] = PAINT
        return labels.reshape(colors.shape[:-1])

    def bare(
        self, grid: CoarseGrid, colors: np.ndarray, seeds: list[tuple[int, int]], radius: int
    ) -> list[tuple[int, int]]:
        """Those of the seeds that do not lie on paint; all of them if every one does, or if the paint is unknown."""
        if self.paint is None or not seeds:
            return seeds
        painted = self._distance(self._around(grid, colors, seeds, radius), self.paint) < self._gate**2
        return [seed for seed, paint in zip(seeds, painted.tolist(), strict=True) if not paint] or seeds

    @staticmethod
    def _around(grid: CoarseGrid, colors: np.ndarray, seeds: list[tuple[int, int]], radius: int) -> np.ndarray:
        """Median colours of the samples around seeds, float32 (n, 3)."""
        windows = np.sort(colors.reshape(-1, 3).take(grid.windows(seeds, radius), axis=0), axis=1)
        return windows[:, windows.shape[1] // 2].astype(np.float32)

    @property
    def paint_distinct(self) -> bool:
        """Whether paint and board are both known and differ."""
        if self.board is None or self.paint is None:
            return False
        return float(self._distance(self.paint, self.board)) > (_DISTINCT * self._gate) ** 2

    @staticmethod
    def _distance(colors: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Squared RGB distance, (...)."""
        # differences of rows of three cost many times as much as the two products
        return np.square(colors) @ _SUM + (colors @ (-2.0 * reference) + float(reference @ reference))


def _distances(reference: np.ndarray) -> np.ndarray:
    """Squared RGB distance of all colours of the label table from one, float32 (32768,)."""
    level = (np.arange(1 << _TABLE_BITS, dtype=np.float32) + np.float32(0.5)) * np.float32(1 << _TABLE_SHIFT)
    red, green, blue = ((level - part) ** 2 for part in reference)
    return (red[:, None, None] + green[:, None] + blue).reshape(-1)
