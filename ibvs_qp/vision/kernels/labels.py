"""Labels of colours: tables of what every colour means in every level of light.

A table has the label of all colours in steps of eight grey levels, red first; tables of several levels of light follow
one another. An empty array of levels stands for even light, an empty colour for an unknown one.
"""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels.compile import inner, kernel

#: Labels of a colour.
OTHER, BOARD, PAINT = 0, 1, 2
#: An unknown colour.
UNKNOWN = np.empty(0, np.float32)
#: Side of a cell of the picture with one level of light, as a power of two [px].
CELL_BITS = 4
#: Entries of one table, as a power of two, and steps of a channel.
TABLE_BITS, _SIDE = 15, 32


@inner
def label_of(table: np.ndarray, level: int, red: int, green: int, blue: int) -> int:
    """Label of a colour in light of some level."""
    return table[(level << TABLE_BITS) | (red >> 3) << 10 | (green >> 3) << 5 | blue >> 3]


@inner
def level_at(levels: np.ndarray, width: int, u: int, v: int) -> int:
    """Level of light at a pixel, of cells (rows * columns,); 0 in even light."""
    if levels.size == 0:
        return 0
    columns = (width + (1 << CELL_BITS) - 1) >> CELL_BITS
    return levels[(v >> CELL_BITS) * columns + (u >> CELL_BITS)]


@inner
def squared_distance(red: float, green: float, blue: float, reference: np.ndarray) -> float:
    """Squared RGB distance of a colour from a reference, array or tuple, all float32."""
    red, green, blue = red - reference[0], green - reference[1], blue - reference[2]
    return red * red + green * green + blue * blue


@inner
def known(color: np.ndarray) -> tuple[np.float32, np.float32, np.float32]:
    """A colour by its channels, infinitely far from all others if unknown."""
    if color.size:
        return color[0], color[1], color[2]
    return np.float32(np.inf), np.float32(np.inf), np.float32(np.inf)


@kernel("u1[::1](f4[::1], f4[::1], f8)")
def label_table(board: np.ndarray, paint: np.ndarray, gate: float) -> np.ndarray:
    """One table: what is within the gate of the paint [grey levels] and not nearer to the board is paint."""
    table, gate_squared = np.empty((_SIDE, _SIDE, _SIDE), np.uint8), np.float32(gate * gate)
    center = np.arange(_SIDE).astype(np.float32) * np.float32(8.0) + np.float32(4.0)
    board_color, paint_color = known(board), known(paint)
    for red in range(_SIDE):
        for green in range(_SIDE):
            row = table[red, green]
            for blue in range(_SIDE):
                to_board = squared_distance(center[red], center[green], center[blue], board_color)
                to_paint = squared_distance(center[red], center[green], center[blue], paint_color)
                painted = (to_paint < gate_squared) & (to_paint < to_board)  # no branches: vectorised
                row[blue] = PAINT if painted else BOARD if to_board < gate_squared else OTHER
    return table.reshape(-1)


@kernel("u1[::1](u1[:, ::1], f4[::1], f4[::1], f8)")
def like_colors(colors: np.ndarray, board: np.ndarray, paint: np.ndarray, gate: float) -> np.ndarray:
    """Labels of colours (n, 3) by what is within the gate of the board's, else of the paint's [grey levels], (n,)."""
    labels, gate_squared = np.empty(len(colors), np.uint8), np.float32(gate * gate)
    board_color, paint_color = known(board), known(paint)
    for i in range(len(colors)):
        red, green, blue = np.float32(colors[i, 0]), np.float32(colors[i, 1]), np.float32(colors[i, 2])
        painted = squared_distance(red, green, blue, paint_color) < gate_squared
        like = squared_distance(red, green, blue, board_color) < gate_squared
        labels[i] = BOARD if like else PAINT if painted else OTHER
    return labels


@kernel("u1[::1](u1[:, ::1], u1[::1], u1[::1])")
def labels_of(colors: np.ndarray, levels: np.ndarray, table: np.ndarray) -> np.ndarray:
    """Labels of colours (n, 3), each in light of its level (n,)."""
    labels = np.empty(len(colors), np.uint8)
    for i in range(len(colors)):
        level = np.int64(levels[i]) if levels.size else 0
        labels[i] = label_of(table, level, np.int64(colors[i, 0]), np.int64(colors[i, 1]), np.int64(colors[i, 2]))
    return labels


@kernel("void(u1[:, :, ::1], i2[:, ::1], u1[::1], u1[::1], u1[::1])")
def sample_labels(
    rgb: np.ndarray, places: np.ndarray, levels: np.ndarray, table: np.ndarray, labels: np.ndarray
) -> None:
    """Labels of the colours at places (n, 2) of a picture (H, W, 3)."""
    width = rgb.shape[1]
    for i in range(len(places)):
        u, v = np.int64(places[i, 0]), np.int64(places[i, 1])
        color = rgb[v, u]
        labels[i] = label_of(
            table, np.int64(level_at(levels, width, u, v)), np.int64(color[0]), np.int64(color[1]), np.int64(color[2])
        )
