"""What the surface looks like: the board's colour, sampled where it is, and the paint's, known to the strategy."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.appearance.label_tables import LabelTables
from ibvs_qp.vision.appearance.light import LightField, fit_light
from ibvs_qp.vision.appearance.light_samples import is_even
from ibvs_qp.vision.kernels.colors import board_color, light_of, painted_light
from ibvs_qp.vision.kernels.labels import BOARD, OTHER, PAINT, UNKNOWN, labels_of, like_colors
from ibvs_qp.vision.picture.grid import CoarseGrid

__all__ = ["BOARD", "OTHER", "PAINT", "SurfaceColors"]

#: Share of a new sample in the board's running colour.
_BLEND = 0.2
#: Even light: one level, that of the reference.
_EVEN = (0,)
#: Colours nearer to each other than this share of the gate cannot be told apart.
_DISTINCT = 0.8
#: Fewer samples tell nothing of the board, or of the paint.
_LEAST_BOARD, _LEAST_PAINT = 8, 12
#: Light on the paint nearer than this to that in which it was named needs no correction [ln]: the gate holds it.
_AS_NAMED = 0.08
_NO_LEVELS = np.empty(0, np.uint8)


class SurfaceColors:
    """Decides whether a colour is the board's, the paint's or neither."""

    def __init__(self, board: tuple[int, int, int] | None, paint: tuple[int, int, int] | None, gate: float) -> None:
        """Take the known colours (RGB 0..255) and the distance within which a colour matches."""
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
        """Sample the board: median of the unpainted colours of the surface's samples; few samples change nothing.

        In uneven light `learn_light` samples it.

        Args:
            colors: Colours of the grid's samples, uint8 (rows, columns, 3).
            component: Samples of the surface, bool (rows, columns).
        """
        if self._given is not None or self.light is not None:
            return
        surface = np.ascontiguousarray(component, bool).reshape(-1)
        count, median = board_color(_flat(colors), surface, _or_empty(self.paint), _or_empty(self.board), self._gate)
        if count >= _LEAST_BOARD:
            self.board = median if self.board is None else self.board + _BLEND * (median - self.board)

    def surely_even(self, colors: np.ndarray, places: np.ndarray) -> bool:
        """Whether light has been even and is, by colours uint8 (rows, columns, 3) at flat places on the surface.

        False also where only `learn_light` can tell.
        """
        if self.light is not None or self.board is None:
            return False
        _, _, tinted, even = light_of(_taken(colors, places), self.board, _or_empty(self.paint), self._gate)
        return is_even(int(np.count_nonzero(even)), int(np.count_nonzero(tinted)))

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
        fixed, paint = self._given is not None, _or_empty(self.paint)
        found = fit_light(
            samples, places, self.board, self._gate, shape, intrinsics, self.light, paint=paint, anchored=fixed
        )
        self.light = None if found is None else found[0]
        if found is not None and not fixed:
            self.board = found[1]
        return found is not None

    def learn_paint(self, grid: CoarseGrid, colors: np.ndarray, places: np.ndarray) -> None:
        """Learn how bright the paint is.

        Args:
            grid: Where the samples lie.
            colors: Colours of the samples, uint8 (rows, columns, 3).
            places: Flat places on the surface beside the brush, (n,); a wall behind it may have the paint's colour.
        """
        if self.board is None or self._named is None:
            return
        samples = _taken(colors, places)
        if self.light is not None:
            light = self.light.at(grid.design[:, :2].take(places, axis=0))
            samples = samples / np.exp(light).astype(np.float32)[:, None]
        count, found = painted_light(samples, self._named, self.board, self._gate)
        if count >= _LEAST_PAINT:
            self.paint = self._named if abs(math.log(found)) < _AS_NAMED else np.float32(found) * self._named

    def forget_light(self) -> None:
        """Forget how the light falls: its cells are those of one picture size."""
        self.light = None

    def levels_at(self, u: np.ndarray, v: np.ndarray) -> np.ndarray | None:
        """Level of light at pixels, for `label`; None where the light is even."""
        return None if self.light is None else self.light.levels_at(u, v)

    @property
    def levels(self) -> np.ndarray:
        """Level of light in every cell of the picture, as kernels take them, uint8 (n,); empty where it is even."""
        return _NO_LEVELS if self.light is None else self.light.levels.reshape(-1)

    def label(self, colors: np.ndarray, levels: np.ndarray | None = None) -> np.ndarray:
        """OTHER, BOARD or PAINT for colours uint8 (..., 3) in light of some level; all OTHER for an unknown board."""
        if self.board is None:
            return np.zeros(colors.shape[:-1], np.uint8)
        lit = _NO_LEVELS if levels is None else np.broadcast_to(levels, colors.shape[:-1]).flatten()
        return labels_of(_flat(colors), lit, self.table()).reshape(colors.shape[:-1])

    def table(self) -> np.ndarray:
        """Labels of all colours, one table after the other for every level of light; the board must be known."""
        assert self.board is not None
        steps = _EVEN if self.light is None else self.light.steps
        return self._tables.of(self.board, self.paint if self.paint_distinct else None, steps)

    def like_around(self, grid: CoarseGrid, colors: np.ndarray, seed: tuple[int, int], radius: int) -> np.ndarray:
        """Labels of samples by the colour around a seed: BOARD for what looks like it, uint8 (rows, columns)."""
        return self.like(colors, self._around(grid, colors, [seed], radius)[0])

    def like(self, colors: np.ndarray, color: np.ndarray) -> np.ndarray:
        """Labels of colours uint8 (..., 3): BOARD for what looks like one (3,), uint8 (...)."""
        color = np.ascontiguousarray(color, np.float32)
        paint = UNKNOWN if self.paint is None or _apart(self.paint, color) <= self._gate**2 else self.paint
        return like_colors(_flat(colors), color, paint, self._gate).reshape(colors.shape[:-1])

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
        windows = np.sort(_flat(colors).take(grid.windows(seeds, radius), axis=0), axis=1)
        return windows[:, windows.shape[1] // 2].astype(np.float32)

    @property
    def paint_distinct(self) -> bool:
        """Whether paint and board are both known and differ."""
        if self.board is None or self.paint is None:
            return False
        return _apart(self.paint, self.board) > (_DISTINCT * self._gate) ** 2


def _or_empty(color: np.ndarray | None) -> np.ndarray:
    """A colour as kernels take it: empty if unknown."""
    return UNKNOWN if color is None else color


def _flat(colors: np.ndarray) -> np.ndarray:
    """Colours (..., 3) as kernels take them: in one list, (n, 3)."""
    return np.ascontiguousarray(colors).reshape(-1, 3)


def _taken(colors: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Colours uint8 (rows, columns, 3) at flat places (n,), float32 (n, 3)."""
    return _flat(colors).take(places, axis=0).astype(np.float32)


def _apart(one: np.ndarray, two: np.ndarray) -> float:
    """Squared distance of two colours (3,)."""
    (red, green, blue), (other_red, other_green, other_blue) = one.tolist(), two.tolist()
    return (red - other_red) ** 2 + (green - other_green) ** 2 + (blue - other_blue) ** 2
