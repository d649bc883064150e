"""Appearance of the surface: the board's colour, sampled where it is, and the paint's, known to the strategy."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.appearance.labels import (
    BOARD,
    OTHER,
    PAINT,
    UNKNOWN,
    LabelTables,
    labels_of,
    like_colors,
    squared_distance,
)
from ibvs_qp.vision.appearance.light import BRIGHTEST, DIMMEST, LightField, fit_light
from ibvs_qp.vision.medians import middle
from ibvs_qp.vision.picture.grid import CoarseGrid
from ibvs_qp.vision.picture.mask import Intrinsics

__all__ = ["BOARD", "OTHER", "PAINT", "SurfaceColors"]

#: Fraction of a new sample in the board's running colour.
_BLEND = 0.2
#: Samples of the board whose median is taken, up to twice as many; more cost time and change nothing.
_SAMPLES = 500
#: Even light: one level, that of the reference.
_EVEN = (0,)
#: Colours nearer to each other than this fraction of the gate are indistinguishable.
_DISTINCT = 0.8
#: Least samples of the board, and of the paint.
_LEAST_BOARD, _LEAST_PAINT = 8, 12
#: Distance from the paint's tint, fraction of the gate in that light: a mixed edge is farther.
_PAINT_TINT = 0.6
#: Light on the paint nearer than this to that in which it was named needs no correction [ln]: the gate holds it.
_AS_NAMED = 0.08
_NO_LEVELS = np.empty(0, np.uint8)


class SurfaceColors:
    """Classifies colours as the board's, the paint's or neither.

    Args:
        board: Colour of the board, RGB 0..255, or None to sample it.
        paint: Colour of the paint, or None if unknown.
        gate: Distance within which a colour matches [grey levels].

    Attributes:
        board: Colour of the board in the light of the reference, float32 (3,), or None.
        paint: The same of the paint.
        light: How light falls on the surface, None where it is even.
    """

    def __init__(self, board: tuple[int, int, int] | None, paint: tuple[int, int, int] | None, gate: float) -> None:
        self._given = None if board is None else np.asarray(board, np.float32)
        self._named = None if paint is None else np.asarray(paint, np.float32)
        self._gate = float(gate)
        self.reset()

    def reset(self) -> None:
        """Forget the sampled colour of the board."""
        self.board = None if self._given is None else self._given.copy()
        self.paint = self._named
        self._tables = LabelTables(self._gate)
        self.light: LightField | None = None

    def learn(self, colors: np.ndarray, component: np.ndarray) -> None:
        """Sample the board: median of the unpainted colours uint8 (rows, columns, 3) of the surface's samples.

        Few samples change nothing, and in uneven light `learn_light` samples it.
        """
        if self._given is not None or self.light is not None:
            return
        samples, gate = _taken(colors, np.flatnonzero(component)), np.float32(self._gate**2)
        samples = samples[squared_distance(samples, self.paint) > gate]
        if self.board is not None:
            like = samples[squared_distance(samples, self.board) < gate]
            samples = like if len(like) > len(samples) // 4 else samples[:0]
        if (count := len(samples)) < _LEAST_BOARD:
            return
        few = samples[:: max(count // _SAMPLES, 1)].T.copy()
        few.sort()
        median = few[:, few.shape[1] // 2].copy()
        self.board = median if self.board is None else self.board + _BLEND * (median - self.board)

    def learn_light(
        self, samples: np.ndarray, places: np.ndarray, shape: tuple[int, int], intrinsics: Intrinsics
    ) -> bool:
        """Find how the light falls on the board, by colours (n, 3) at normalised places (n, 2); whether it is uneven.

        The picture has a (height, width) [px].
        """
        if self.board is None:
            return False
        fixed = self._given is not None
        found = fit_light(
            samples, places, self.board, self._gate, shape, intrinsics, self.light, paint=self.paint, anchored=fixed
        )
        self.light = None if found is None else found[0]
        if found is not None and not fixed:
            self.board = found[1]
        return found is not None

    def learn_paint(self, grid: CoarseGrid, colors: np.ndarray, places: np.ndarray) -> None:
        """Learn how bright the paint is, by samples of its tint in some light that have not the board's colour.

        They are taken from flat places on the surface beside the brush, (n,); a wall behind it may have that colour.
        """
        if self.board is None or self._named is None:
            return
        samples, paint = _taken(colors, places), self._named
        if self.light is not None:
            light = self.light.at(grid.design[:, :2].take(places, axis=0))
            samples = samples / np.exp(light).astype(np.float32)[:, None]
        red, green, blue = paint
        size = max(red * red + green * green + blue * blue, np.float32(1.0))
        light = (samples[:, 0] * red + samples[:, 1] * green + samples[:, 2] * blue) / size
        tint = np.float32(_PAINT_TINT * self._gate) * light
        painted = (light > DIMMEST) & (light < BRIGHTEST)
        painted &= squared_distance(samples, light[:, None] * paint) < tint * tint
        painted &= squared_distance(samples, self.board) > np.float32(self._gate**2)
        if np.count_nonzero(painted) >= _LEAST_PAINT:
            found = float(np.float32(middle(light[painted].astype(float))))
            self.paint = paint if abs(math.log(found)) < _AS_NAMED else np.float32(found) * paint

    def forget_light(self) -> None:
        """Forget how the light falls: its cells are those of one picture size."""
        self.light = None

    @property
    def levels(self) -> np.ndarray:
        """Level of light in every cell of the picture, as kernels take them, uint8 (n,); empty where it is even."""
        return _NO_LEVELS if self.light is None else self.light.levels.reshape(-1)

    def label(self, colors: np.ndarray, u: np.ndarray | None = None, v: np.ndarray | None = None) -> np.ndarray:
        """OTHER, BOARD or PAINT for colours uint8 (..., 3) at pixels, in their light; all OTHER for an unknown board.

        Args:
            colors: The colours.
            u: Columns of the pixels [px], (...); None for the light of the reference.
            v: Rows of the pixels [px].
        """
        shape, levels = colors.shape[:-1], _NO_LEVELS
        if self.board is None:
            return np.zeros(shape, np.uint8)
        if self.light is not None and u is not None and v is not None:
            levels = np.broadcast_to(self.light.levels_at(u, v), shape).flatten()
        return labels_of(np.ascontiguousarray(colors).reshape(-1, 3), levels, self.table()).reshape(shape)

    def table(self) -> np.ndarray:
        """Labels of all colours, one table after the other for every level of light; the board must be known."""
        assert self.board is not None
        steps = _EVEN if self.light is None else self.light.steps
        return self._tables.of(self.board, self.paint if self.paint_distinct else None, steps)

    def like_around(self, grid: CoarseGrid, colors: np.ndarray, seed: tuple[int, int], radius: int) -> np.ndarray:
        """Labels of samples by the colour around a seed: BOARD for similar ones, uint8 (rows, columns)."""
        return self.like(colors, _around(grid, colors, [seed], radius)[0])

    def like(self, colors: np.ndarray, color: np.ndarray) -> np.ndarray:
        """Labels of colours uint8 (..., 3): BOARD for those similar to one (3,), uint8 (...)."""
        color = np.ascontiguousarray(color, np.float32)
        paint = UNKNOWN if self.paint is None or _apart(self.paint, color) <= self._gate**2 else self.paint
        samples = np.ascontiguousarray(colors).reshape(-1, 3)
        return like_colors(samples, color, paint, self._gate).reshape(colors.shape[:-1])

    def bare(
        self, grid: CoarseGrid, colors: np.ndarray, seeds: list[tuple[int, int]], radius: int
    ) -> list[tuple[int, int]]:
        """Those of the seeds that do not lie on paint; all of them if every one does, or if the paint is unknown."""
        if self.paint is None or not seeds:
            return seeds
        around = _around(grid, colors, seeds, radius)
        return [
            seed for seed, color in zip(seeds, around, strict=True) if _apart(color, self.paint) >= self._gate**2
        ] or seeds

    @property
    def paint_distinct(self) -> bool:
        """Whether paint and board are both known and differ."""
        if self.board is None or self.paint is None:
            return False
        return _apart(self.paint, self.board) > (_DISTINCT * self._gate) ** 2


def _around(grid: CoarseGrid, colors: np.ndarray, seeds: list[tuple[int, int]], radius: int) -> np.ndarray:
    """Median colours of the samples around seeds, float32 (n, 3)."""
    windows = np.sort(colors.reshape(-1, 3).take(grid.windows(seeds, radius), axis=0), axis=1)
    return windows[:, windows.shape[1] // 2].astype(np.float32)


def _taken(colors: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Colours uint8 (rows, columns, 3) at flat places (n,), float32 (n, 3)."""
    return colors.reshape(-1, 3).take(places, axis=0).astype(np.float32)


def _apart(one: np.ndarray, two: np.ndarray) -> float:
    """Squared distance of two colours (3,)."""
    (red, green, blue), (other_red, other_green, other_blue) = one.tolist(), two.tolist()
    return (red - other_red) ** 2 + (green - other_green) ** 2 + (blue - other_blue) ** 2
