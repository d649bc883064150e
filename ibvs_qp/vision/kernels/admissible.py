"""Where in a strip an edge of its line may lie."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.kernels import line_tables as t
from ibvs_qp.vision.kernels.compile import inner
from ibvs_qp.vision.kernels.labels import label_of, level_at
from ibvs_qp.vision.kernels.strips import clamped

#: A reading farther from the surface than this share of depth is not on it: on the far side of a border, 2.6 sigma of
#: 0.5 % + 0.5 % noise; on the surface's own side, more than real cameras are off by within 4 px of a border (7 %).
_OFF_FAR, _OFF_NEAR = 0.018, 0.08
#: Steps of the table of demands: label behind, depth off the surface before and behind, the surface's side, and kind.
_LABEL_BEHIND, _OFF_BEFORE, _OFF_BEHIND, _SIDE_STEP, _KIND_STEP = 3, 9, 18, 36, 72
#: The kind of line that demands nothing, and that which demands a step of depth as well: the surface's border.
_ANY, _BORDER = 0, 2


@inner
def find_admissible(
    view: np.ndarray,
    kind: int,
    u: np.ndarray,
    base: np.ndarray,
    colors: np.ndarray,
    hidden: np.ndarray,
    depth: np.ndarray,
    table: np.ndarray,
    levels: np.ndarray,
    width: int,
    demands: np.ndarray,
    side: int,
    allowed: np.ndarray,
) -> None:
    """Judge by hidden pixels, and by colour and depth on both sides, at which places an edge of a line may lie.

    Args:
        view: The line in its view, a row of `line_tables`.
        kind: What it demands of its sides.
        u: Columns of the profiles [px], (K,).
        base: Predicted rows in whole pixels, (K,).
        colors: RGB of the strip's pixels, uint8 (K, 3 M).
        hidden: Non-zero where a pixel is hidden or outside the picture, uint8 (K, M).
        depth: Depth of every pixel of the picture [m], float32 (H W,); empty if it or the surface is unknown.
        table: Labels of all colours in every level of light, uint8.
        levels: Level of light in cells of the picture, uint8; empty where it is even.
        width: Of the picture [px].
        demands: Answers of `ibvs_qp.vision.lines.admissible.FITS`, uint8.
        side: Distance of the two sides from an edge [px].
        allowed: Filled with whether an edge may lie at a searched place, uint8 (K, n).
    """
    pixels, row_step, column_step = hidden.shape[1], int(view[t.VIEW_ROW_STEP]), int(view[t.VIEW_COLUMN_STEP])
    lowest, behind = int(view[t.VIEW_HEIGHT]) - 1, view[t.VIEW_BEHIND] != 0.0
    key = _KIND_STEP * kind + _SIDE_STEP * int(behind)
    gate_before, gate_behind = (_OFF_FAR, _OFF_NEAR) if behind else (_OFF_NEAR, _OFF_FAR)
    label, away = np.zeros(pixels, np.int64), np.zeros(pixels)  # of the pixels of a profile
    for k in range(len(u)):
        if kind != _ANY:
            at = row_step * clamped(base[k], 0, lowest) + column_step * int(u[k])
            light = np.int64(level_at(levels, width, at % width, at // width))
            for i in range(pixels):
                red, green, blue = colors[k, 3 * i], colors[k, 3 * i + 1], colors[k, 3 * i + 2]
                label[i] = label_of(table, light, np.int64(red), np.int64(green), np.int64(blue))
        if kind == _BORDER and depth.size:
            along = u[k] * view[t.VIEW_U]
            for i in range(pixels):
                v = base[k] - pixels // 2 + i
                at = row_step * clamped(v, 0, lowest) + column_step * int(u[k])
                relative = depth[at] * (along + v * view[t.VIEW_V] + view[t.VIEW_ONE])
                away[i] = abs(relative - 1.0) if relative > 0.0 else 0.0  # no reading: not known to be off
        for i in range(allowed.shape[1]):
            j = i + 2 * side
            if hidden[k, i] | hidden[k, i + side] | hidden[k, j]:
                allowed[k, i] = 0
            elif kind == _ANY:
                allowed[k, i] = 1
            else:
                off = _OFF_BEFORE * (away[i] > gate_before) + _OFF_BEHIND * (away[j] > gate_behind)
                allowed[k, i] = demands[key + label[i] + _LABEL_BEHIND * label[j] + off]
