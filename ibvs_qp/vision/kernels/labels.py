"""Labels of colours: tables of what every colour means in every level of light.

A table has the label of all colours in steps of eight grey levels, red first; tables of several levels of light follow
one another. An empty array of levels stands for even light.
"""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels.compile import inner, kernel

#: Labels of a colour.
OTHER, BOARD, PAINT = 0, 1, 2
#: Side of a cell of the picture with one level of light, as a power of two [px].
CELL_BITS = 4
#: Entries of one table, as a power of two.
TABLE_BITS = 15


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
