"""What the surface looks like: the board's colour, sampled where it is, and the paint's, known to the strategy."""

from __future__ import annotations

import ctypes

import numpy as np

from ibvs_qp.vision.board_samples import board_median, squared_distances
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.label_tables import BOARD, OTHER, PAINT, TABLE_SIZE, LabelTables, places_in_table
from ibvs_qp.vision.light import LightField, fit_light
from ibvs_qp.vision.light_samples import gates_of, is_even
from ibvs_qp.vision.native import native, place
from ibvs_qp.vision.native_colors import even_natively, seeds_natively
from ibvs_qp.vision.paint_light import paint_as_lit, paint_seen_natively

__all__ = ["BOARD", "OTHER", "PAINT", "SurfaceColors"]

#: Share of a new sample in the board's running colour.
_BLEND = 0.2
#: Even light: one level, that of the reference.
_EVEN = (0,)
#: Colours nearer to each other than this share of the gate cannot be told apart.
_DISTINCT = 0.8


class SurfaceColors:
    """Decides whether a colour is the board's, the paint's or neither."""

    def __init__(self, board: tuple[int, int, int] | None, paint: tuple[int, int, int] | None, gate: float) -> None:
        """Take the known colours (RGB 0..255) and the distance within which a colour matches."""
        self._given = None if board is None else np.asarray(board, np.float32)
        self._named = None if paint is None else np.asarray(paint, np.float32)
        self._gate = gate
        self.reset()

    def reset(self) -> None:
        """Forget the sampled colour of the board."""
        self.board = None if self._given is None else self._given.copy()
        self.paint = self._named
        self._tables = LabelTables(self._gate)
        self.light: LightField | None = None

    def learn(self, colors: np.ndarray, component: np.ndarray) -> None:
        """Sample the board: median of the unpainted colours of the surface's samples; few samples change nothing.

        In uneven light `learn_light` samples it.

        Args:
            colors: Colours of the grid's samples, uint8 (rows, columns, 3).
            component: Samples of the surface, bool (rows, columns).
        """
        if self._given is not None or self.light is not None:
            return
        median = board_median(colors, component, self.paint, self.board, self._gate)
        if median is not None:
            self.board = median if self.board is None else self.board + _BLEND * (median - self.board)

    def surely_even(self, colors: np.ndarray, places: np.ndarray) -> bool:
        """Whether light has been even and is, by colours uint8 (rows, columns, 3) at flat places on the surface.

        False also where only `learn_light` can tell.
        """
        library = native()
        if library is None or self.light is not None or self.board is None:
            return False
        return is_even(*even_natively(library, colors, places, self.paint, self.board, gates_of(self._gate))[::-1])

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
            bare = squared_distances(samples.astype(np.float32), self.paint) > self._gate**2
            samples, places = samples[bare], places[bare]
        fixed = self._given is not None
        found = fit_light(samples, places, self.board, self._gate, shape, intrinsics, self.light, anchored=fixed)
        self.light = None if found is None else found[0]
        if found is not None and not fixed:
            self.board = found[1]
        return found is not None

    def learn_paint(self, grid: CoarseGrid, colors: np.ndarray, places: np.ndarray) -> None:
        """See how bright the paint is, among colours uint8 (rows, columns, 3) at flat places beside the brush, (n,)."""
        if self.board is None or self._named is None:
            return
        library = native()
        if library is not None and self.light is None:
            seen = paint_seen_natively(library, colors, places, self._named, self.board, self._gate)
        else:
            samples = colors.reshape(-1, 3).take(places, axis=0).astype(np.float32)
            if self.light is not None:
                light = self.light.at(grid.design[:, :2].take(places, axis=0))
                samples = samples / np.exp(light).astype(np.float32)[:, None]
            seen = paint_as_lit(samples, self._named, self.board, self._gate)
        self.paint = self.paint if seen is None else seen

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
        places = places_in_table(colors)
        return self.table().take(places if levels is None else places + levels.astype(np.intp) * TABLE_SIZE)

    def table(self) -> np.ndarray:
        """Labels of all colours, one table after the other for every level of light; the board must be known."""
        assert self.board is not None
        steps = _EVEN if self.light is None else self.light.steps
        return self._tables.of(self.board, self.paint if self.paint_distinct else None, steps)

    def like_around(self, grid: CoarseGrid, colors: np.ndarray, seed: tuple[int, int], radius: int) -> np.ndarray:
        """Labels of samples by the colour around a seed: BOARD for what looks like it, uint8 (rows, columns)."""
        [around] = self._around(grid, colors, [seed], radius)
        library = native()
        if library is not None:
            return self._like_natively(library, colors, around)
        return self._like_with_numpy(colors, around)

    def _like_natively(self, library: ctypes.CDLL, colors: np.ndarray, around: np.ndarray) -> np.ndarray:
        paint, apart = self.paint, self._gate**2
        if paint is not None and _apart(paint, around) <= apart:
            paint = None
        colors, labels = np.ascontiguousarray(colors), np.empty(colors.shape[:-1], np.uint8)
        gate, count = ctypes.c_float(apart), ctypes.c_long(labels.size)
        library.like_colors(place(colors), count, *(place(part) for part in (around, paint)), gate, place(labels))
        return labels

    def _like_with_numpy(self, colors: np.ndarray, around: np.ndarray) -> np.ndarray:
        """The same where there is no machine code."""
        samples = colors.reshape(-1, 3).astype(np.float32)
        labels = (squared_distances(samples, around) < self._gate**2).view(np.uint8)
        if self.paint is not None and _apart(self.paint, around) > self._gate**2:
            labels[(squared_distances(samples, self.paint) < self._gate**2) & (labels == OTHER)] = PAINT
        return labels.reshape(colors.shape[:-1])

    def bare(
        self, grid: CoarseGrid, colors: np.ndarray, seeds: list[tuple[int, int]], radius: int
    ) -> list[tuple[int, int]]:
        """Those of the seeds that do not lie on paint; all of them if every one does, or if the paint is unknown."""
        if self.paint is None or not seeds:
            return seeds
        around = self._around(grid, colors, seeds, radius)
        return [
            seed for seed, color in zip(seeds, around, strict=True) if _apart(color, self.paint) >= self._gate**2
        ] or seeds

    @staticmethod
    def _around(grid: CoarseGrid, colors: np.ndarray, seeds: list[tuple[int, int]], radius: int) -> np.ndarray:
        """Median colours of the samples around seeds, float32 (n, 3)."""
        library, places = native(), grid.windows(seeds, radius)
        if library is not None:
            return seeds_natively(library, colors, places)
        windows = np.sort(colors.reshape(-1, 3).take(places, axis=0), axis=1)
        return windows[:, windows.shape[1] // 2].astype(np.float32)

    @property
    def paint_distinct(self) -> bool:
        """Whether paint and board are both known and differ."""
        if self.board is None or self.paint is None:
            return False
        return _apart(self.paint, self.board) > (_DISTINCT * self._gate) ** 2


def _apart(one: np.ndarray, two: np.ndarray) -> float:
    """Squared distance of two colours (3,)."""
    (red, green, blue), (other_red, other_green, other_blue) = one.tolist(), two.tolist()
    return (red - other_red) ** 2 + (green - other_green) ** 2 + (blue - other_blue) ** 2
