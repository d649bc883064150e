"""Sub-pixel fits of predicted lines, all in one call."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels import line_tables as t
from ibvs_qp.vision.kernels.admissible import find_admissible
from ibvs_qp.vision.kernels.compile import kernel
from ibvs_qp.vision.kernels.consensus import consensus, shifted
from ibvs_qp.vision.kernels.edges import find_edges, look_again
from ibvs_qp.vision.kernels.line_colors import copy_sides, step_across
from ibvs_qp.vision.kernels.new_step import new_step
from ibvs_qp.vision.kernels.peaks import preferences
from ibvs_qp.vision.kernels.robust_line import robust_line
from ibvs_qp.vision.kernels.runs import keep_run
from ibvs_qp.vision.kernels.strips import gather

#: A profile's gradient must reach this share of the line's whole step (a sharp edge reaches 0.4).
_STEP_SHARE = 0.12
#: The same of the smallest allowed contrast, for faint lines.
_FAINT_SHARE = 0.3
#: No longer gap than this share of the searched length is bridged.
_BRIDGED_SHARE = 0.3
#: Colour steps smaller than this have no direction [grey levels].
_STEP_MIN = 1e-3


@kernel(
    "void(u1[:, :, ::1], u1[:, ::1], f4[::1], u1[::1], u1[::1], u1[::1],"
    " f8[:, ::1], i8, i8, f8, f8, f8, i8,"
    " f8[:, ::1], f8[:, ::1], u1[:, ::1], u1[:, ::1], u1[:, :, :, ::1])"
)
def fit_lines(
    rgb: np.ndarray,
    mask: np.ndarray,
    depth: np.ndarray,
    table: np.ndarray,
    levels: np.ndarray,
    demands: np.ndarray,
    queries: np.ndarray,
    reach: int,
    side: int,
    contrast_min: float,
    gate: float,
    bridge: float,
    min_profiles: int,
    found: np.ndarray,
    u: np.ndarray,
    support: np.ndarray,
    visible: np.ndarray,
    sides: np.ndarray,
) -> None:
    """Fit L predicted lines, each at K profiles.

    Args:
        rgb: Picture, uint8 (H, W, 3).
        mask: Non-zero where the vehicle hides the view, uint8 (H, W).
        depth: Depth of every pixel [m], float32 (H W,); empty if it or the surface is unknown.
        table: Labels of all colours in every level of light, uint8; may be empty if no line demands any.
        levels: Level of light in cells of the picture, uint8; empty where it is even.
        demands: Answers of `ibvs_qp.vision.lines.admissible.FITS`, uint8.
        queries: The lines, (L, 20) of `line_tables`.
        reach: Rows searched on either side of a prediction.
        side: Distance from an edge at which its two sides are looked at [px].
        contrast_min: Least colour step of a line [grey levels].
        gate: Distance within which a profile agrees with a line [px].
        bridge: Longest gap of visible misses that does not end a line [px].
        min_profiles: Least profiles that must agree.
        found: Filled with the fits, (L, FIT_COLUMNS) of `line_tables`.
        u: Filled with the columns of the profiles [px], (L, K).
        support: Filled with the profiles that agree, uint8 (L, K).
        visible: Filled with the profiles that could be seen, uint8 (L, K).
        sides: Filled with the colours before and behind the lines, uint8 (2, L, K, 3); left alone if empty.
    """
    lines, profiles = u.shape
    pixels, size, preference = 2 * (reach + side) + 1, 2 * reach + 1, preferences(reach)
    colors, hidden = np.empty((lines, profiles, 3 * pixels), np.uint8), np.empty((profiles, pixels), np.uint8)
    base, row, distance = np.empty(u.shape), np.empty(u.shape), np.empty(u.shape)
    predicted, direction, unit = np.empty(profiles), np.empty(3), np.empty(3, np.float32)
    answers, allowed = np.empty((profiles, size), np.float32), np.empty((profiles, size), np.uint8)
    scratch, faint, agreed = np.empty((2, profiles)), _FAINT_SHARE * contrast_min, True
    for line in range(lines):
        query, strip, seen, good = queries[line], colors[line], visible[line], support[line]
        gather(rgb, mask, query, reach + side, u[line], predicted, base[line], strip, hidden, seen)
        find_admissible(
            query, u[line], base[line], strip, hidden, depth, table, levels, mask.shape[1], demands, side, allowed
        )
        direction[0], direction[1], direction[2] = query[t.RED], query[t.GREEN], query[t.BLUE]
        if query[t.KNOWN] == 0.0:
            new_step(strip, allowed, side, int(query[t.POLARITY]), direction)
        norm = math.sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2])
        for c in range(3):
            unit[c] = np.float32(0.5) * np.float32(direction[c] / max(norm, _STEP_MIN))
        limit = max(_STEP_SHARE * norm, faint)
        if not find_edges(
            query, u[line], base[line], strip, side, unit, limit, preference, allowed, seen, answers, row[line], good
        ):
            board = query[t.BOARD] != 0.0 and depth.size > 0
            look_again(board, base[line], strip, side, limit, faint, preference, allowed, answers, row[line], good)
        alive = shifted(row[line], predicted, good, gate, scratch[0], distance[line])
        agreed = agreed and alive and query[t.KNOWN] != 0.0
        found[line, t.FIT_ALIVE] = norm >= _STEP_MIN
    for line in range(lines):
        alive = found[line, t.FIT_ALIVE] != 0.0
        # one line far from its prediction has all of them looked for anew
        if not agreed and not consensus(u[line], row[line], support[line], gate, distance[line]):
            alive = False
        length = max(u[line, profiles - 1] - u[line, 0], 1.0)
        missing = int(min(bridge / length, _BRIDGED_SHARE) * (profiles - 1))
        count = keep_run(support[line], visible[line], distance[line], alive, gate, missing, min_profiles, found[line])
        level, slope, center, level_variance, slope_variance, rms = robust_line(
            u[line], row[line], support[line], count, scratch[0], scratch[1]
        )
        found[line, t.FIT_LEVEL], found[line, t.FIT_SLOPE], found[line, t.FIT_CENTER] = level, slope, center
        found[line, t.FIT_LEVEL_VARIANCE], found[line, t.FIT_SLOPE_VARIANCE] = level_variance, slope_variance
        found[line, t.FIT_RMS] = rms
        contrast = step_across(colors[line], row[line], base[line], support[line], reach, side, found[line])
        enough = found[line, t.FIT_ALIVE] != 0.0 and count >= min_profiles
        found[line, t.FIT_ALIVE] = enough and contrast >= contrast_min * contrast_min
        if sides.size:
            copy_sides(colors[line], u[line], base[line], level - slope * center, slope, reach, side, sides, line)
