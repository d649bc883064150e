"""Sub-pixel fits of predicted lines, all in one call."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels import line_tables as t
from ibvs_qp.vision.kernels.admissible import find_admissible
from ibvs_qp.vision.kernels.compile import kernel
from ibvs_qp.vision.kernels.consensus import consensus, shifted
from ibvs_qp.vision.kernels.edges import find_edges, look_again
from ibvs_qp.vision.kernels.line_colors import copy_contents, step_across
from ibvs_qp.vision.kernels.new_step import new_step
from ibvs_qp.vision.kernels.peaks import preferences
from ibvs_qp.vision.kernels.robust_line import robust_line
from ibvs_qp.vision.kernels.runs import keep_run
from ibvs_qp.vision.kernels.strips import gather
from ibvs_qp.vision.kernels.views import finish, place_in_view

#: A profile's gradient must reach this share of the line's whole step (a sharp edge reaches 0.4).
_STEP_SHARE = 0.12
#: The same of the smallest allowed contrast, for faint lines.
_FAINT_SHARE = 0.3
#: No longer gap than this share of the searched length is bridged.
_BRIDGED_SHARE = 0.3
#: A line with less room in the picture [px] than this share of the number of profiles is left out.
_ROOM_SHARE = 0.125
#: Colour steps smaller than this have no direction [grey levels].
_STEP_MIN = 1e-3


@kernel(
    "void(u1[:, :, ::1], u1[:, ::1], f4[::1], u1[::1], u1[::1], u1[::1], f8[::1], f8[:, ::1],"
    " i8, i8, f8, f8, f8, i8, i8, f8, f8[:, ::1], u1[:, :, :, ::1], f8[:, :, ::1])"
)
def fit_lines(
    rgb: np.ndarray,
    mask: np.ndarray,
    depth: np.ndarray,
    table: np.ndarray,
    levels: np.ndarray,
    demands: np.ndarray,
    camera: np.ndarray,
    queries: np.ndarray,
    reach: int,
    side: int,
    contrast_min: float,
    gate: float,
    bridge: float,
    profiles: int,
    min_profiles: int,
    bias: float,
    lines: np.ndarray,
    sides: np.ndarray,
    pixels: np.ndarray,
) -> None:
    """Fit L predicted lines, each at K profiles: as many as the shortest of them has columns, up to `profiles`.

    Args:
        rgb: Picture, uint8 (H, W, 3).
        mask: Non-zero where the vehicle hides the view, uint8 (H, W).
        depth: Depth of every pixel [m], float32 (H W,); empty if it or the surface is unknown.
        table: Labels of all colours in every level of light, uint8; may be empty if no line demands any.
        levels: Level of light in cells of the picture, uint8; empty where it is even.
        demands: Answers of `ibvs_qp.vision.lines.admissible.FITS`, uint8.
        camera: Camera and surface, a row of `line_tables`.
        queries: The lines, rows of `line_tables`, (L, 14).
        reach: Rows searched on either side of a prediction.
        side: Distance from an edge at which its two sides are looked at [px].
        contrast_min: Least colour step of a line [grey levels].
        gate: Distance within which a profile agrees with a line [px].
        bridge: Longest gap of visible misses that does not end a line [px].
        profiles: Most profiles of a line.
        min_profiles: Least profiles that must agree.
        bias: Standard deviation of a line that no number of profiles makes less [px].
        lines: Filled with the lines, rows of `line_tables`, (L, 20); without a line only `ALIVE` is set.
        sides: Filled with the colours before and behind the lines, uint8 (L, 2, profiles, 3); left alone if empty.
        pixels: Filled with the places of these, (L, profiles, 2) [px]; left alone with the sides.
    """
    views, count = np.empty((len(queries), t.VIEW_COLUMNS)), profiles
    for line in range(len(queries)):
        place_in_view(queries[line], camera, mask.shape[0], mask.shape[1], views[line])
        room = views[line, t.VIEW_LAST] - views[line, t.VIEW_FIRST]
        lines[line, t.ALIVE] = room >= int(_ROOM_SHARE * profiles)
        if lines[line, t.ALIVE] != 0.0:
            count = min(count, int(room) + 1)
    u, row, base = np.empty((len(lines), count)), np.empty((len(lines), count)), np.empty((len(lines), count))
    distance, support = np.empty((len(lines), count)), np.empty((len(lines), count), np.uint8)
    visible, fits = np.empty((len(lines), count), np.uint8), np.empty((len(lines), t.FIT_COLUMNS))
    across, size, preference = 2 * (reach + side) + 1, 2 * reach + 1, preferences(reach)
    colors, hidden = np.empty((len(lines), count, 3 * across), np.uint8), np.empty((count, across), np.uint8)
    predicted, direction, unit = np.empty(count), np.empty(3), np.empty(3, np.float32)
    answers, allowed = np.empty((count, size), np.float32), np.empty((count, size), np.uint8)
    scratch, faint, agreed = np.empty((2, count)), _FAINT_SHARE * contrast_min, True
    for line in range(len(lines)):
        if lines[line, t.ALIVE] == 0.0:
            continue
        query, view, strip, seen, good = queries[line], views[line], colors[line], visible[line], support[line]
        kind, known = int(query[t.KIND]), query[t.KNOWN] != 0.0
        gather(rgb, mask, view, reach + side, u[line], predicted, base[line], strip, hidden, seen)
        find_admissible(
            view, kind, u[line], base[line], strip, hidden, depth, table, levels, mask.shape[1], demands, side, allowed
        )
        direction[0], direction[1], direction[2] = view[t.VIEW_RED], view[t.VIEW_GREEN], view[t.VIEW_BLUE]
        if not known:
            new_step(strip, allowed, side, int(view[t.VIEW_POLARITY]), direction)
        norm = math.sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2])
        for c in range(3):
            unit[c] = np.float32(0.5) * np.float32(direction[c] / max(norm, _STEP_MIN))
        limit = max(_STEP_SHARE * norm, faint)
        if not find_edges(
            view, u[line], base[line], strip, side, unit, limit, preference, allowed, seen, answers, row[line], good
        ):
            board = query[t.BOARD] != 0.0 and depth.size > 0
            look_again(board, base[line], strip, side, limit, faint, preference, allowed, answers, row[line], good)
        alive = shifted(row[line], predicted, good, gate, scratch[0], distance[line])
        agreed = agreed and alive and known
        fits[line, t.FIT_ALIVE] = norm >= _STEP_MIN
    for line in range(len(lines)):
        if lines[line, t.ALIVE] == 0.0:
            continue
        view, fit = views[line], fits[line]
        alive = fit[t.FIT_ALIVE] != 0.0
        # one line far from its prediction has all of them looked for anew
        if not agreed and not consensus(u[line], row[line], support[line], gate, distance[line]):
            alive = False
        length = max(u[line, count - 1] - u[line, 0], 1.0)
        missing = int(min(bridge / length, _BRIDGED_SHARE) * (count - 1))
        held = keep_run(support[line], visible[line], distance[line], alive, gate, missing, min_profiles, fit)
        (
            fit[t.FIT_LEVEL],
            fit[t.FIT_SLOPE],
            fit[t.FIT_CENTER],
            fit[t.FIT_LEVEL_VARIANCE],
            fit[t.FIT_SLOPE_VARIANCE],
            fit[t.FIT_RMS],
        ) = robust_line(u[line], row[line], support[line], held, scratch[0], scratch[1])
        contrast = step_across(colors[line], row[line], base[line], support[line], reach, side, fit)
        enough = fit[t.FIT_ALIVE] != 0.0 and held >= min_profiles
        lines[line, t.ALIVE] = enough and contrast >= contrast_min * contrast_min
        if lines[line, t.ALIVE] == 0.0:
            continue
        finish(view, fit, queries[line, t.THETA], u[line], visible[line], side, bias, lines[line])
        if sides.size:
            copy_contents(
                view, fit, colors[line], u[line], base[line], support[line], reach, side, sides[line], pixels[line]
            )
