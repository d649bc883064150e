"""What the surface looks like: the board's colour, sampled where it is, and the paint's, known to the strategy."""

from __future__ import annotations

import ctypes
import math

import numpy as np

from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.light import STEP, LightField, fit_light
from ibvs_qp.vision.native import native, place

#: Share of a new sample in the board's running colour.
_BLEND = 0.2
#: Samples whose median is taken; more cost time and change nothing.
_JUDGED = 500
#: Bits per channel of the label table, the shift that leaves them, and the board's drift that renews it.
_TABLE_BITS, _TABLE_SHIFT, _TABLE_DRIFT = 5, 3, 1.5
_TABLE_STEPS = np.array((1 << 2 * _TABLE_BITS, 1 << _TABLE_BITS, 1), np.float32)
_SUM = np.ones(3, np.float32)
#: Even light: one level, that of the reference. No channel is brighter than white.
_EVEN, _WHITE = (0,), 255.0
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
        self._table, self._table_board = np.zeros(0, np.uint8), np.zeros(3, np.float32)
        self._tables: dict[int, np.ndarray] = {}
        self._joined: tuple[int, ...] = ()
        self.light: LightField | None = None

    def learn(self, samples: np.ndarray) -> None:
        """Sample the board: median of the unpainted colours among (n, 3) samples; few samples change nothing.

        In uneven light `learn_light` samples it.
        """
        if self._given is not None or self.light is not None:
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

    def learn_light(
        self,
        samples: np.ndarray,
        places: np.ndarray,
        shape: tuple[int, int],
        intrinsics: tuple[float, float, float, float],
    ) -> bool:
        """Find how the light falls on the board; True where it is uneven.

        Args:
            samples: Colours on the board by depth, RGB (n, 3).
            places: Where they lie, normalised, (n, 2).
            shape: (height, width) of the picture [px].
            intrinsics: Of the picture [px].
        """
        if self.board is None:
            return False
        if self.paint is not None:
            bare = self._distance(samples.astype(np.float32), self.paint) > self._gate**2
            samples, places = samples[bare], places[bare]
        fixed = self._given is not None
        found = fit_light(samples, places, self.board, self._gate, shape, intrinsics, self.light, anchored=fixed)
        self.light = None if found is None else found[0]
        if found is not None and not fixed:
            self.board = found[1]
        return found is not None

    def levels_at(self, u: np.ndarray, v: np.ndarray) -> np.ndarray | None:
        """Level of light at pixels, for `label`; None where the light is even."""
        return None if self.light is None else self.light.levels_at(u, v)

    @property
    def levels(self) -> np.ndarray | None:
        """Level of light in every cell of the picture, uint8 (rows, columns); None where the light is even."""
        return None if self.light is None else self.light.levels

    def label(self, colors: np.ndarray, levels: np.ndarray | None = None) -> np.ndarray:
        """OTHER, BOARD or PAINT for colours uint8 (..., 3) in light of some level; all OTHER for an unknown board."""
        if self.board is None:
            return np.zeros(colors.shape[:-1], np.uint8)
        library = native()
        if library is not None:
            colors, labels = np.ascontiguousarray(colors), np.empty(colors.shape[:-1], np.uint8)
            lit = None if levels is None else np.ascontiguousarray(np.broadcast_to(levels, labels.shape))
            parts = (lit, self.table(), labels)
            count = ctypes.c_long(labels.size)
            library.labels_of(place(colors), count, *(place(part) for part in parts))
            return labels
        # single precision holds the place exactly, and has the only fast product
        places = ((colors >> _TABLE_SHIFT).astype(np.float32) @ _TABLE_STEPS).astype(np.intp)
        return self.table().take(places if levels is None else places + (levels.astype(np.intp) << 3 * _TABLE_BITS))

    def table(self) -> np.ndarray:
        """Labels of all colours in steps of eight grey levels, red first, uint8 (levels * 32768,); one level if even.

        The board must be known.
        """
        assert self.board is not None
        if np.abs(self.board - self._table_board).max() > _TABLE_DRIFT:
            self._tables.clear()
        steps = _EVEN if self.light is None else self.light.steps
        if not self._tables:
            self._table_board, self._joined = self.board.copy(), ()
        if self._joined != steps:
            for step in steps:
                if step not in self._tables:
                    self._tables[step] = self._make_table(math.exp(STEP * step))
            tables = [self._tables[step] for step in steps]
            self._table, self._joined = tables[0] if len(tables) == 1 else np.concatenate(tables), steps
        return self._table

    def _make_table(self, light: float) -> np.ndarray:
        """Labels of all colours in one light: thousands of colours are looked up per picture."""
        library, gate = native(), np.float32((self._gate * light) ** 2)
        board, paint = (
            None if color is None else np.minimum(np.float32(light) * color, np.float32(_WHITE))
            for color in (self._table_board, self.paint if self.paint_distinct else None)
        )
        if library is None:
            return _table_with_numpy(board, paint, gate)
        table = np.empty(1 << 3 * _TABLE_BITS, np.uint8)
        library.label_table(place(board), place(paint), ctypes.c_float(gate), place(table))
        return table

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


def _table_with_numpy(board: np.ndarray, paint: np.ndarray | None, gate: np.floating) -> np.ndarray:
    """Label table where there is no machine code."""
    to_board = _distances(board)
    table = (to_board < gate).view(np.uint8)  # true is BOARD, false OTHER
    if paint is not None:
        to_paint = _distances(paint)
        table[(to_paint < gate) & (to_paint < to_board)] = PAINT
    return table


def _distances(reference: np.ndarray) -> np.ndarray:
    """Squared RGB distance of all colours of the label table from one, float32 (32768,)."""
    level = (np.arange(1 << _TABLE_BITS, dtype=np.float32) + np.float32(0.5)) * np.float32(1 << _TABLE_SHIFT)
    red, green, blue = ((level - part) ** 2 for part in reference)
    return (red[:, None, None] + green[:, None] + blue).reshape(-1)
