"""Appearance of the surface: the board's colour, sampled where it is, and the paint's, known to the strategy."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.appearance.light import (
    BRIGHTEST,
    CELL_BITS,
    DIMMEST,
    LIGHT_STEP,
    UNKNOWN,
    LightField,
    fit_light,
    has_hue,
    in_other_light,
    is_shaded,
    squared_distance,
)
from ibvs_qp.vision.compilation import inner, kernel, middle
from ibvs_qp.vision.picture.layout import CoarseGrid
from ibvs_qp.vision.picture.picture import Picture

#: Labels of a colour, and the bit of a label that holds in shadow or glare only.
OTHER, BOARD, PAINT, SHADE = 0, 1, 2, 4
#: Entries of one table, as a power of two, and steps of a channel.
_TABLE_BITS, _SIDE = 15, 32
#: Drift of the board that renews the tables, and the brightest that a channel can be [grey levels].
_DRIFT, _WHITE = 1.5, 255.0
#: A colour is another one in some light if this light is so much weaker or stronger, up to this fraction of the size of
#: the colour and this distance [grey levels].
_DIMMER, _BRIGHTER, _CHROMA, _GREY = 0.68, 1.4, 0.10, 14.0
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


@inner
def label_of(table, level, red, green, blue):
    """Label of a colour in light of some level."""
    return table[(level << _TABLE_BITS) | (red >> 3) << 10 | (green >> 3) << 5 | blue >> 3]


@inner
def level_at(levels, width, u, v):
    """Level of light at a pixel, of cells (rows * columns,); 0 in even light."""
    if levels.size == 0:
        return 0
    columns = (width + (1 << CELL_BITS) - 1) >> CELL_BITS
    return levels[(v >> CELL_BITS) * columns + (u >> CELL_BITS)]


@kernel("u1[::1](u1[:, ::1], u1[::1], u1[::1])")
def labels_of(colors, levels, table):
    """Labels of colours (n, 3), each in light of its level (n,)."""
    labels = np.empty(len(colors), np.uint8)
    for i in range(len(colors)):
        level = np.int64(levels[i]) if levels.size else 0
        labels[i] = label_of(table, level, np.int64(colors[i, 0]), np.int64(colors[i, 1]), np.int64(colors[i, 2]))
    return labels


@inner
def _squared_distance(red, green, blue, reference):
    red, green, blue = red - reference[0], green - reference[1], blue - reference[2]
    return red * red + green * green + blue * blue


@kernel("u1[::1](u1[:, ::1], f4[::1], f4[::1], f8)")
def like_colors(colors, board, paint, gate):
    """Labels of colours (n, 3) within the gate of the board's, else of the paint's [grey levels], (n,)."""
    labels, gate_squared = np.empty(len(colors), np.uint8), np.float32(gate * gate)
    for i in range(len(colors)):
        red, green, blue = np.float32(colors[i, 0]), np.float32(colors[i, 1]), np.float32(colors[i, 2])
        painted = _squared_distance(red, green, blue, paint) < gate_squared
        like = _squared_distance(red, green, blue, board) < gate_squared
        labels[i] = BOARD if like else PAINT if painted else OTHER
    return labels


@kernel("u1[::1](f4[::1], f4[::1], f8)")
def _label_table(board, paint, gate):
    """One table: colours within the gate of the paint [grey levels] and not nearer to the board are paint."""
    table, gate_squared = np.empty((_SIDE, _SIDE, _SIDE), np.uint8), np.float32(gate * gate)
    center = np.arange(_SIDE).astype(np.float32) * np.float32(8.0) + np.float32(4.0)
    for red in range(_SIDE):
        for green in range(_SIDE):
            row = table[red, green]
            for blue in range(_SIDE):
                to_board = _squared_distance(center[red], center[green], center[blue], board)
                to_paint = _squared_distance(center[red], center[green], center[blue], paint)
                painted = (to_paint < gate_squared) & (to_paint < to_board)  # no branches: vectorised
                row[blue] = PAINT if painted else BOARD if to_board < gate_squared else OTHER
    return table.reshape(-1)


@kernel("u1[::1](f4[::1], f4[::1])")
def _shade_table(board, paint):
    """Labels of all colours in shadow and glare: the board's, else the paint's in shadow if it has a hue of its own.

    White light on paint looks like a thin coat of it on a white board, and grey paint like any wall.
    """
    table, one = np.zeros((_SIDE, _SIDE, _SIDE), np.uint8), np.empty(3)
    own = paint[0] < np.inf and has_hue(paint) and not is_shaded(paint, board)
    for red in range(_SIDE):
        for green in range(_SIDE):
            for blue in range(_SIDE):
                one[0], one[1], one[2] = 8.0 * red + 4.0, 8.0 * green + 4.0, 8.0 * blue + 4.0
                if is_shaded(one, board):
                    table[red, green, blue] = BOARD | SHADE
                elif own and in_other_light(one, paint):
                    table[red, green, blue] = PAINT | SHADE
    return table.reshape(-1)


def _differ(one: np.ndarray | None, two: np.ndarray | None) -> bool:
    """Whether two colours, known or not, differ by more than a drift."""
    if one is None or two is None:
        return one is not two
    return one is not two and bool(np.abs(one - two).max() > _DRIFT)


def alike_colors(colors: np.ndarray, color: np.ndarray) -> np.ndarray:
    """Whether colours uint8 (..., 3) are one colour (3,) in some light, bool (...)."""
    found = _alike(np.ascontiguousarray(colors, float).reshape(-1, 3), np.ascontiguousarray(color, float))
    return found.reshape(colors.shape[:-1])


@kernel("b1[::1](f8[:, ::1], f8[::1])")
def _alike(colors, color):
    """The same for colours (n, 3), (n,)."""
    found = np.empty(len(colors), np.bool_)
    for k in range(len(colors)):
        found[k] = is_alike(colors[k, 0], colors[k, 1], colors[k, 2], color)
    return found


@inner
def is_alike(red, green, blue, color):
    """Whether a colour is the colour (3,) in some light."""
    size = max(math.sqrt(color[0] * color[0] + color[1] * color[1] + color[2] * color[2]), 1.0)
    light = (red * color[0] + green * color[1] + blue * color[2]) / (size * size)
    square = red * red + green * green + blue * blue
    offset = max(square - (light * size) ** 2, 0.0)
    gate = _CHROMA * size + _GREY
    if light > _DIMMER and light < _BRIGHTER and offset < gate * gate:
        return True
    away = (light - 1.0) * size
    return offset + away * away < _GREY * _GREY


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
        shadowed: Whether shadows or glare lie on the surface.
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
        self.light: LightField | None = None
        self.shadowed = False
        self._tables: dict[int, np.ndarray] = {}  # by the step of light, of these colours
        self._shade: np.ndarray | None = None  # labels of these colours in shade
        self._tabled: tuple[np.ndarray | None, np.ndarray | None] = (None, None)
        self._joined: dict[bool, tuple[tuple[int, ...], np.ndarray]] = {}  # steps and their tables, by shade

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

    def learn_light(self, picture: Picture, places: np.ndarray, beside_brush: np.ndarray) -> bool:
        """Learn how the light falls on the board, and how bright the paint is in it; whether it is uneven.

        Samples are taken from flat places all over the surface, (n,), and beside the brush, where paint is fresh, (m,).
        """
        if self.board is None:
            return False
        samples = picture.colors.reshape(-1, 3).take(places, axis=0)
        where, fixed = picture.grid.design[:, :2].take(places, axis=0), self._given is not None
        shape, paint = picture.mask.shape, self.paint
        found = fit_light(
            samples, where, self.board, self._gate, shape, picture.intrinsics, self.light, paint=paint, anchored=fixed
        )
        self.light = None if found is None else found[0]
        if found is not None and not fixed:
            self.board = found[1]
        self.learn_paint(picture.grid, picture.colors, beside_brush)
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

    @property
    def levels(self) -> np.ndarray:
        """Level of light in every cell of the picture, as kernels take them, uint8 (n,); empty where it is even."""
        return _NO_LEVELS if self.light is None else self.light.levels.reshape(-1)

    def label(
        self, colors: np.ndarray, u: np.ndarray | None = None, v: np.ndarray | None = None, *, shade: bool = False
    ) -> np.ndarray:
        """OTHER, BOARD or PAINT for colours uint8 (..., 3), all OTHER for an unknown board.

        They are in the light at pixels, columns u and rows v [px], (...), or in that of the reference, and, with shade,
        in the shadows and the glare that lie on the surface.
        """
        shape, levels = colors.shape[:-1], _NO_LEVELS
        if self.board is None:
            return np.zeros(shape, np.uint8)
        if self.light is not None and u is not None and v is not None:
            cells = self.light.levels
            row, column = (
                np.clip(np.asarray(at).astype(np.intp), 0, size - 1) >> CELL_BITS
                for at, size in zip((v, u), self.light.shape, strict=True)
            )
            levels = np.broadcast_to(cells[row, column], shape).flatten()
        labels = labels_of(np.ascontiguousarray(colors).reshape(-1, 3), levels, self.table(shade=shade))
        return (labels & ~np.uint8(SHADE)).reshape(shape)

    def table(self, *, shade: bool = False) -> np.ndarray:
        """Labels of all colours, one table after the other for every level of light, uint8 (levels * 32768,).

        Red comes first; the board must be known. Tables are kept while the colours hold. With shade, other colours have
        the labels, with the bit `SHADE`, that they have in the shadows and the glare that lie on the surface.
        """
        assert self.board is not None
        paint, steps = self.paint if self.paint_distinct else None, _EVEN if self.light is None else self.light.steps
        shade = shade and self.shadowed
        if _differ(paint, self._tabled[1]) or _differ(self.board, self._tabled[0]):
            self._tabled, self._shade = (self.board.copy(), paint), None
            self._joined.clear()
            self._tables.clear()
        if shade not in self._joined or self._joined[shade][0] != steps:
            for step in steps:
                if step not in self._tables:
                    self._tables[step] = self._table_in(math.exp(LIGHT_STEP * step))
            joined = np.concatenate([self._tables[step] for step in steps])
            if shade:
                labels = self._shade
                if labels is None:
                    labels = self._shade = _shade_table(self.board, UNKNOWN if paint is None else paint)
                joined = np.where(joined == OTHER, np.tile(labels, len(steps)), joined)
            self._joined[shade] = steps, joined
        return self._joined[shade][1]

    def _table_in(self, light: float) -> np.ndarray:
        """The table of one level; gates shrink and grow with the light, as all differences of colours do."""
        board, paint = (
            UNKNOWN if color is None else np.minimum(np.float32(light) * color, np.float32(_WHITE))
            for color in self._tabled
        )
        return _label_table(board, paint, self._gate * light)

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
