"""What samples of the grid tell of board, light and paint, by machine code: calls the functions of native/board.c."""

from __future__ import annotations

import ctypes
from typing import NamedTuple

import numpy as np

from ibvs_qp.vision.native import place


class Gates(NamedTuple):
    """When a colour is the surface's or the paint's, as `Gates` of native/board.c.

    Attributes:
        apart: Squared distance within which a colour matches [grey levels^2].
        sure: The same however coarse its label [grey levels^2].
        tint: Distance from the tint, in the light of the reference [grey levels].
        dimmest: Least light looked at, times the reference's.
        brightest: Most light looked at.
        cut: A channel this high is cut off [grey levels].
        uneven: Light that differs by less is even.
    """

    apart: float
    sure: float
    tint: float
    dimmest: float
    brightest: float
    cut: float
    uneven: float


def seeds_natively(library: ctypes.CDLL, colors: np.ndarray, windows: np.ndarray) -> np.ndarray:
    """Upper median colours of windows (n, w) of flat places among colours uint8 (..., 3), float32 (n, 3)."""
    colors, medians = np.ascontiguousarray(colors), np.empty((len(windows), 3), np.float32)
    sizes = (ctypes.c_long(size) for size in windows.shape)
    library.seed_colors(place(colors), place(windows), *sizes, place(medians))
    return medians


def board_natively(
    library: ctypes.CDLL,
    colors: np.ndarray,
    component: np.ndarray,
    paint: np.ndarray | None,
    board: np.ndarray | None,
    apart: float,
    judged: int,
) -> tuple[int, np.ndarray]:
    """How many samples show the board, and their median colour, float32 (3,); arguments as for `SurfaceColors.learn`.

    Raises:
        MemoryError: When memory ran out.
    """
    colors, component = np.ascontiguousarray(colors), np.ascontiguousarray(component)
    median = np.empty(3, np.float32)
    sizes = ctypes.c_long(component.size), ctypes.c_float(apart), ctypes.c_long(judged)
    count = library.board_samples(
        place(colors), place(component), sizes[0], place(paint), place(board), *sizes[1:], place(median)
    )
    if count < 0:
        raise MemoryError("no memory for samples of the board")
    return count, median


def even_natively(
    library: ctypes.CDLL,
    colors: np.ndarray,
    places: np.ndarray,
    paint: np.ndarray | None,
    board: np.ndarray,
    gates: Gates,
) -> tuple[int, int]:
    """Samples with the surface's tint in some light, and those with its colour in the reference's."""
    colors, counts = np.ascontiguousarray(colors), np.empty(2, np.int32)
    table, count = np.array(gates, np.float32), ctypes.c_long(len(places))
    parts = (paint, board, table, counts)
    library.even_light(place(colors), place(places), count, *(place(part) for part in parts))
    tinted, even = counts.tolist()
    return tinted, even


def paint_natively(
    library: ctypes.CDLL, colors: np.ndarray, places: np.ndarray, paint: np.ndarray, board: np.ndarray, gates: Gates
) -> tuple[int, float]:
    """Samples with the paint's tint in some light, and the median of that light.

    Raises:
        MemoryError: When memory ran out.
    """
    colors, found = np.ascontiguousarray(colors), np.empty(1, np.float32)
    table, size = np.array(gates, np.float32), ctypes.c_long(len(places))
    parts = (paint, board, table, found)
    count = library.painted_light(place(colors), place(places), size, *(place(part) for part in parts))
    if count < 0:
        raise MemoryError("no memory for samples of the paint")
    return count, float(found[0])
