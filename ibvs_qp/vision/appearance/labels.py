"""Labels of colours: tables of the label of every colour at every level of light.

A table has the label of all colours in steps of eight grey levels, red first; tables of several levels of light follow
one another. An empty array of levels stands for even light.
"""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.compilation import inner, kernel

#: Labels of a colour.
OTHER, BOARD, PAINT = 0, 1, 2
#: Step between two levels of light [ln]: half of it is a seventh of the gate of a white board.
LIGHT_STEP = 0.03
#: Side of a cell of the picture with one level of light, as a power of two [px].
CELL_BITS = 4
#: Entries of one table, as a power of two, and steps of a channel.
_TABLE_BITS, _SIDE = 15, 32
#: Drift of the board that renews the tables, and the brightest that a channel can be [grey levels].
_DRIFT, _WHITE = 1.5, 255.0
#: A colour is another one in some light if this light is so much weaker or stronger, up to this fraction of the size of
#: the colour and this distance [grey levels].
_DIMMER, _BRIGHTER, _CHROMA, _GREY = 0.68, 1.4, 0.10, 14.0
#: A colour that no other one is near to.
UNKNOWN = np.full(3, np.inf, np.float32)


def squared_distance(colors: np.ndarray, reference: np.ndarray | None) -> np.ndarray:
    """Squared RGB distances of colours (..., 3) from a colour (..., 3), float32; infinite from an unknown one."""
    reference = UNKNOWN if reference is None else reference
    red, green, blue = (colors[..., k] - reference[..., k] for k in range(3))  # not at once: rows of three are slow
    return red * red + green * green + blue * blue


@inner
def label_of(table: np.ndarray, level: int, red: int, green: int, blue: int) -> int:
    """Label of a colour in light of some level."""
    return table[(level << _TABLE_BITS) | (red >> 3) << 10 | (green >> 3) << 5 | blue >> 3]


@inner
def level_at(levels: np.ndarray, width: int, u: int, v: int) -> int:
    """Level of light at a pixel, of cells (rows * columns,); 0 in even light."""
    if levels.size == 0:
        return 0
    columns = (width + (1 << CELL_BITS) - 1) >> CELL_BITS
    return levels[(v >> CELL_BITS) * columns + (u >> CELL_BITS)]


@kernel("u1[::1](u1[:, ::1], u1[::1], u1[::1])")
def labels_of(colors: np.ndarray, levels: np.ndarray, table: np.ndarray) -> np.ndarray:
    """Labels of colours (n, 3), each in light of its level (n,)."""
    labels = np.empty(len(colors), np.uint8)
    for i in range(len(colors)):
        level = np.int64(levels[i]) if levels.size else 0
        labels[i] = label_of(table, level, np.int64(colors[i, 0]), np.int64(colors[i, 1]), np.int64(colors[i, 2]))
    return labels


@inner
def _squared_distance(red: float, green: float, blue: float, reference: np.ndarray) -> float:
    red, green, blue = red - reference[0], green - reference[1], blue - reference[2]
    return red * red + green * green + blue * blue


@kernel("u1[::1](u1[:, ::1], f4[::1], f4[::1], f8)")
def like_colors(colors: np.ndarray, board: np.ndarray, paint: np.ndarray, gate: float) -> np.ndarray:
    """Labels of colours (n, 3) within the gate of the board's, else of the paint's [grey levels], (n,)."""
    labels, gate_squared = np.empty(len(colors), np.uint8), np.float32(gate * gate)
    for i in range(len(colors)):
        red, green, blue = np.float32(colors[i, 0]), np.float32(colors[i, 1]), np.float32(colors[i, 2])
        painted = _squared_distance(red, green, blue, paint) < gate_squared
        like = _squared_distance(red, green, blue, board) < gate_squared
        labels[i] = BOARD if like else PAINT if painted else OTHER
    return labels


@kernel("u1[::1](f4[::1], f4[::1], f8)")
def _label_table(board: np.ndarray, paint: np.ndarray, gate: float) -> np.ndarray:
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


class LabelTables:
    """Tables of all levels of light, kept while they hold.

    Args:
        gate: Distance within which a colour matches, in the light of the reference [grey levels].
    """

    def __init__(self, gate: float) -> None:
        self._gate = gate
        self._board: np.ndarray | None = None
        self._paint: np.ndarray | None = None
        self._tables: dict[int, np.ndarray] = {}
        self._joined, self._steps = np.zeros(0, np.uint8), ()

    def of(self, board: np.ndarray, paint: np.ndarray | None, steps: tuple[int, ...]) -> np.ndarray:
        """Labels in several levels of light, red first, uint8 (levels * 32768,).

        Args:
            board: Colour of the board in the light of the reference, (3,).
            paint: The same of the paint, or None where it looks like the board.
            steps: Logarithm of the light of every level, in steps of `LIGHT_STEP`.
        """
        if _differ(paint, self._paint) or _differ(board, self._board):
            self._board, self._paint, self._steps = board.copy(), paint, ()
            self._tables.clear()
        if self._steps != steps:
            for step in steps:
                if step not in self._tables:
                    self._tables[step] = self._made(math.exp(LIGHT_STEP * step))
            self._joined, self._steps = np.concatenate([self._tables[step] for step in steps]), steps
        return self._joined

    def _made(self, light: float) -> np.ndarray:
        """One table; gates shrink and grow with the light, as all differences of colours do."""
        board, paint = (
            UNKNOWN if color is None else np.minimum(np.float32(light) * color, np.float32(_WHITE))
            for color in (self._board, self._paint)
        )
        return _label_table(board, paint, self._gate * light)


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
def _alike(colors: np.ndarray, color: np.ndarray) -> np.ndarray:
    """The same for colours (n, 3), (n,)."""
    found = np.empty(len(colors), np.bool_)
    for k in range(len(colors)):
        found[k] = is_alike(colors[k, 0], colors[k, 1], colors[k, 2], color)
    return found


@inner
def is_alike(red: float, green: float, blue: float, color: np.ndarray) -> bool:
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
