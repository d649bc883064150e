"""What lies on both sides of segments, at places along them.

Side 0 is the left of the way from a segment's first end to its second one, side 1 the right.
"""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels.compile import inner, kernel
from ibvs_qp.vision.kernels.labels import label_of, level_at


@inner
def place_along(
    segment: np.ndarray, k: int, places: int, margin: float, right: float, down: float
) -> tuple[float, float]:
    """Place k of those along a segment, without a share of it at either end, moved to the right and down [px]."""
    share = margin + (1.0 - 2.0 * margin) * k / (places - 1)
    u = segment[0] + share * (segment[2] - segment[0]) + right
    return u, segment[1] + share * (segment[3] - segment[1]) + down


@inner
def _aside(segment: np.ndarray, side: int, distance: float) -> tuple[float, float]:
    """Way to one side of a segment, to the right and down [px]."""
    run_u, run_v = segment[2] - segment[0], segment[3] - segment[1]
    away = (distance if side == 1 else -distance) / math.hypot(run_u, run_v)
    return -away * run_v, away * run_u


@kernel("void(u1[:, :, ::1], f8[:, ::1], f8, f8, u1[::1], u1[::1], u1[:, :, ::1])")
def labels_beside(
    rgb: np.ndarray,
    segments: np.ndarray,
    margin: float,
    distance: float,
    levels: np.ndarray,
    table: np.ndarray,
    labels: np.ndarray,
) -> None:
    """Labels of the colours on both sides of segments.

    Args:
        rgb: Picture, (H, W, 3).
        segments: End points u1, v1, u2, v2 [px], (n, 4).
        margin: Share of a segment left out at either end.
        distance: From the segment [px].
        levels: Level of light in cells of the picture; empty where it is even.
        table: Labels of all colours in every level of light.
        labels: Receives the labels at K places, the border's beyond the picture, (n, 2, K).
    """
    height, width, _ = rgb.shape
    for i in range(len(segments)):
        for side in range(2):
            right, down = _aside(segments[i], side, distance)
            for k in range(labels.shape[2]):
                u, v = place_along(segments[i], k, labels.shape[2], margin, right, down)
                column, row = min(max(int(np.rint(u)), 0), width - 1), min(max(int(np.rint(v)), 0), height - 1)
                color, level = rgb[row, column], np.int64(level_at(levels, width, column, row))
                labels[i, side, k] = label_of(table, level, np.int64(color[0]), np.int64(color[1]), np.int64(color[2]))


@kernel("void(u1[:, ::1], f8[:, ::1], f8, f8, f8, u1[:, :, ::1])")
def cells_beside(
    cells: np.ndarray, segments: np.ndarray, distance: float, stride: float, offset: float, found: np.ndarray
) -> None:
    """Whether marked cells of a grid lie on both sides of segments.

    Args:
        cells: Non-zero where marked, (rows, columns).
        segments: End points u1, v1, u2, v2 [px], (n, 4).
        distance: From the segment [px].
        stride: Distance of the grid's samples [px].
        offset: Place of the first sample [px].
        found: Receives whether one lies there, at K places, none beyond the grid, (n, 2, K).
    """
    margin = 0.5 / found.shape[2]
    for i in range(len(segments)):
        for side in range(2):
            right, down = _aside(segments[i], side, distance)
            for k in range(found.shape[2]):
                u, v = place_along(segments[i], k, found.shape[2], margin, right, down)
                row, column = int(np.rint((v - offset) / stride)), int(np.rint((u - offset) / stride))
                inside = 0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]
                found[i, side, k] = inside and cells[row, column] != 0
