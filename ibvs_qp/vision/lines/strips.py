"""Strips of pixels across predicted lines, and where each profile of a strip has its edge."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np

from ibvs_qp.vision.appearance.colors import BOARD, OTHER, PAINT, SHADE, label_of, level_at
from ibvs_qp.vision.compilation import inner, upper_median

#: Demands of a line on its two sides: none, paint beside board, border of the surface.
ANY, PAINT_EDGE, BORDER = range(3)
#: Why a segment ends: the picture does, the vehicle hides the rest, no more was looked at, or the line really ends.
ENDS = ("picture", "mask", "span", "end")
BY_PICTURE, BY_MASK, BY_SPAN, BY_END = range(4)

#: A predicted line.
QUERY = np.dtype(
    [
        ("rho", "f8"),  # normalised
        ("theta", "f8"),  # [rad]
        ("span", "f8", 2),  # range along x (level lines) or y (upright ones) to look at, normalised
        ("seen", "f8", 2),  # range in which it was seen last
        ("known", "?"),  # whether its colour step is known
        ("step", "f8", 3),  # this step along the normal
        ("polarity", "i8"),  # of a new line along the normal, 0 if unknown
        ("demand", "i8"),  # on its sides
        ("surface_side", "i8"),  # along the normal
        ("border", "?"),  # whether it is the border of the surface
    ],
    align=True,
)
#: The same line v = slope u + level [px] in the view in which it is level: an upright one has rows and columns swapped.
VIEW = np.dtype(
    [
        ("upright", "?"),
        ("row_step", "i8"),  # flat distances of the view's pixels
        ("column_step", "i8"),
        ("height", "i8"),  # [px]
        *((name, "f8") for name in ("fx", "fy", "cx", "cy", "slope", "level")),
        *((name, "f8") for name in ("first", "last")),  # columns to look at
        *((name, "?") for name in ("cut_first", "cut_last")),  # whether the picture goes on before and behind them
        ("seen", "f8", 2),  # columns in which it was seen last
        ("sign", "f8"),  # +1 if its normal points along +v, else -1
        ("surface_behind", "?"),
        ("step", "f8", 3),  # along +v
        ("polarity", "f8"),  # along +v
        ("plane", "f8", 3),  # 1/Z = p u + q v + r of the surface
    ],
    align=True,
)
#: A fitted line.
LINE = np.dtype(
    [
        ("alive", "?"),  # whether there is one: nothing else is valid otherwise
        ("rho", "f8"),
        ("theta", "f8"),
        ("covariance", "f8", (2, 2)),  # of (rho, theta)
        ("segment", "f8", (2, 2)),  # its ends, normalised
        ("ends", "i8", 2),  # why it ends there, as places in `ENDS`
        ("inlier_share", "f8"),  # fraction of the run's profiles that agree
        ("count", "i8"),  # how many agree
        ("rms_px", "f8"),
        ("length_px", "f8"),
        ("step", "f8", 3),  # colour step along the normal
    ],
    align=True,
)
#: A reading farther from the surface than this fraction of depth is not on it: on the far side of a border, 2.6 sigma
#: of 0.5 % + 0.5 % noise; on the surface's own side, more than real cameras are off by within 4 px of a border (7 %).
_OFF_FAR, _OFF_OWN = 0.018, 0.08
#: Turns a gradient's peak into the size of the step: a blur of 0.7 px leaves 0.4 of it.
_PEAK_TO_STEP = np.float32(2.5)
#: Profiles that define the step: gradients above this fraction of the median one.
_CLEAR = np.float32(0.5)
#: Fraction of the visible profiles, where the line was seen last, below which first sight is not enough.
_ENOUGH = 0.5
#: A neighbour's gradient counts at least this fraction of the peak, so that the logarithm stays tame.
_FLOOR = np.float32(0.05)
#: The peak lies at most this far from the strongest whole place [px].
_FARTHEST = np.float32(0.7)
#: Least peak, and the curvature that is no peak at all.
_TINY, _FLAT = np.float32(1e-6), np.float32(-2e-6)
#: Width of the preference for the predicted place, fraction of the strip.
_PREFERENCE = 0.6


class Pixels(NamedTuple):
    """The picture for the line fit."""

    rgb: np.ndarray  # colour, uint8 (H, W, 3)
    mask: np.ndarray  # non-zero where the vehicle hides the view, uint8 (H, W)
    depth: np.ndarray  # depth [m], float32 (H W,); empty if it or the surface is unknown
    table: np.ndarray  # labels of all colours in every level of light, uint8; may be empty if no line demands any
    levels: np.ndarray  # level of light in cells of the picture, uint8; empty where it is even
    camera: tuple[float, float, float, float]  # (fx, fy, cx, cy) [px]
    plane: tuple[float, float, float]  # (a, b, c) of the surface, zero if unknown


class Search(NamedTuple):
    """How lines are searched and fitted."""

    reach: int  # rows searched on either side of a prediction
    side: int  # distance from an edge at which its two sides are looked at [px]
    contrast_min: float  # least colour step of a line [grey levels]
    gate: float  # distance within which a profile agrees with a line [px]
    bridge: float  # longest gap of visible misses that does not end a line [px]
    profiles: int  # most profiles of a line
    min_profiles: int  # least profiles that must agree
    bias: float  # standard deviation of a line that no number of profiles makes less [px]


class Strip(NamedTuple):
    """K profiles of M = 2 (reach + side) + 1 pixels across a line, around the predicted rows of its view."""

    colors: np.ndarray  # RGB of the pixels, uint8 (K, 3 M)
    hidden: np.ndarray  # non-zero where a pixel is hidden or outside the picture, uint8 (K, M)
    visible: np.ndarray  # whether the middle of a profile is neither, uint8 (K,)
    good: np.ndarray  # whether a profile supports the line, uint8 (K,)
    u: np.ndarray  # columns of the profiles [px], growing, (K,)
    predicted: np.ndarray  # predicted rows [px], (K,)
    base: np.ndarray  # the same in whole pixels, (K,)
    row: np.ndarray  # rows of the edges [px], (K,)
    distance: np.ndarray  # of the edges from their consensus [px], (K,)


_U1, _F8, _I8 = nb.u1, nb.f8, nb.i8
#: Types of these for the signature of a kernel.
QUERIES, LINES = (nb.from_dtype(record)[::1] for record in (QUERY, LINE))
PIXELS = nb.types.NamedTuple(
    (
        _U1[:, :, ::1], _U1[:, ::1], nb.f4[::1], _U1[::1], _U1[::1], nb.types.UniTuple(_F8, 4),
        nb.types.UniTuple(_F8, 3),
    ),
    Pixels,
)  # fmt: skip
SEARCH = nb.types.NamedTuple((_I8, _I8, _F8, _F8, _F8, _I8, _I8, _F8), Search)


@inner
def clamped(value, lowest, highest):
    """Whole number within limits, the lowest one if the value is not a number."""
    if value >= highest:
        return highest
    return int(value) if value > lowest else lowest


@inner
def gradient(colors, k, at):
    """Central difference of one channel at a place of profile k [grey levels per px]."""
    return np.float32(0.5) * (np.float32(colors[k, at + 3]) - np.float32(colors[k, at - 3]))


@inner
def gather(pixels, view, far, strip):
    """Read the pixels of a strip, up to `far` from its middle; beyond the border they are repeated and hidden."""
    rgb, mask, colors, hidden, visible = pixels.rgb, pixels.mask, strip.colors, strip.hidden, strip.visible
    u, predicted, base = strip.u, strip.predicted, strip.base
    height, upright, slope, level = view.height, view.upright, view.slope, view.level
    begin, span, share = view.first + 0.5, view.last - view.first, 1.0 / (len(u) - 1)
    for k in range(len(u)):
        column = math.floor(begin + span * (k * share))
        row = slope * column + level
        middle = clamped(np.rint(row), -2 * far, height + 2 * far)
        u[k], predicted[k], base[k] = column, row, middle
        along, first = int(column), middle - far
        for i in range(hidden.shape[1]):
            across = min(max(first + i, 0), height - 1)
            x, y = (across, along) if upright else (along, across)
            colors[k, 3 * i] = rgb[y, x, 0]
            colors[k, 3 * i + 1] = rgb[y, x, 1]
            colors[k, 3 * i + 2] = rgb[y, x, 2]
            hidden[k, i] = mask[y, x] if across == first + i else 255
        visible[k] = (hidden[k, far - 2] | hidden[k, far] | hidden[k, far + 2]) == 0


@inner
def find_admissible(pixels, view, demand, strip, side, allowed):
    """Fill in whether an edge may lie at a searched place, uint8 (K, n): by colour and depth on both sides of it."""
    depth, table, levels, width = pixels.depth, pixels.table, pixels.levels, pixels.mask.shape[1]
    colors, hidden, u, base, count = strip.colors, strip.hidden, strip.u, strip.base, strip.hidden.shape[1]
    row_step, column_step, lowest = view.row_step, view.column_step, view.height - 1
    p, q, r = view.plane[0], view.plane[1], view.plane[2]
    own, far = (2 * side, 0) if view.surface_behind else (0, 2 * side)  # the surface's side of a place, and the other
    label, away = np.zeros(count, np.int64), np.zeros(count)  # of the pixels of a profile
    for k in range(len(u)):
        if demand != ANY:
            at = row_step * clamped(base[k], 0, lowest) + column_step * int(u[k])
            light = np.int64(level_at(levels, width, at % width, at // width))
            for i in range(count):
                red, green, blue = colors[k, 3 * i], colors[k, 3 * i + 1], colors[k, 3 * i + 2]
                label[i] = label_of(table, light, np.int64(red), np.int64(green), np.int64(blue))
        if demand == BORDER and depth.size:
            along = u[k] * p
            for i in range(count):
                v = base[k] - count // 2 + i
                at = row_step * clamped(v, 0, lowest) + column_step * int(u[k])
                relative = depth[at] * (along + v * q + r)
                away[i] = abs(relative - 1.0) if relative > 0.0 else 0.0  # no reading: not known to be off
        for i in range(allowed.shape[1]):
            if hidden[k, i] | hidden[k, i + side] | hidden[k, i + 2 * side]:
                allowed[k, i] = 0
            elif demand == ANY:
                allowed[k, i] = 1
            elif demand == PAINT_EDGE:
                allowed[k, i] = (label[i + own] & ~SHADE == BOARD) & (label[i + far] & ~SHADE == PAINT)
            else:  # a wall may have the colour of board or paint, but not their depth; lines on the board have both
                most = _OFF_FAR if label[i + own] & SHADE else _OFF_OWN  # a grey wall is a white board in shade
                on = (label[i + own] != OTHER) & (away[i + own] <= most)
                beyond = (label[i + far] == OTHER) | (label[i + far] & SHADE != 0)
                allowed[k, i] = on & (beyond | (away[i + far] > _OFF_FAR))


@inner
def typical_step(colors, allowed, side, polarity, direction):
    """Fill in the typical strongest colour step along +v of a strip [grey levels], (3,); zero without a clear one."""
    profiles = len(colors)
    weights, values, steps = np.empty(profiles, np.float32), np.empty(profiles), np.empty((profiles, 3), np.float32)
    for k in range(profiles):
        best, most = _strongest_step(colors, allowed, k, side, polarity)
        weights[k] = np.float32(0.5) * np.float32(most)  # differences are twice the gradients
        values[k] = weights[k]
        for c in range(3):
            steps[k, c] = gradient(colors, k, 3 * (best + side) + c)
    least = _CLEAR * np.float32(upper_median(values, profiles))
    for c in range(3):
        count = 0
        for k in range(profiles):
            if weights[k] > least:
                values[count] = steps[k, c]
                count += 1
        direction[c] = _PEAK_TO_STEP * np.float32(upper_median(values, count)) if count else 0.0


@inner
def _strongest_step(colors, allowed, k, side, polarity):
    """Place and size of the largest difference of any channel of profile k."""
    best, most = 0, np.int64(0)
    for i in range(allowed.shape[1]):
        at = 3 * (i + side)  # differences of grey levels have a sign: int() of them would not
        red = np.int64(colors[k, at + 3]) - np.int64(colors[k, at - 3])
        green = np.int64(colors[k, at + 4]) - np.int64(colors[k, at - 2])
        blue = np.int64(colors[k, at + 5]) - np.int64(colors[k, at - 1])
        if polarity == 0:
            size = max(max(abs(red), abs(green)), abs(blue))
        else:
            size = max(max(polarity * red, polarity * green), polarity * blue)
        if size > most and allowed[k, i]:
            best, most = i, size
    return best, most


@inner
def preferences(reach):
    """Weight of every place of a strip: the predicted one in the middle counts most, float32 (2 reach + 1,)."""
    weights = np.empty(2 * reach + 1, np.float32)
    for i in range(2 * reach + 1):
        offset = (i - reach) / max(_PREFERENCE * reach, 1.0)
        weights[i] = math.exp(-0.5 * (offset * offset))
    return weights


@inner
def find_edges(view, strip, side, unit, limit, preference, allowed, answers):
    """Sub-pixel row of every profile's strongest answer, and whether it may be an edge of the line.

    Answers, float32 (K, n), are the gradients along `unit`, half the direction of the colour step; an edge answers by
    more than `limit` [grey levels per px]. Returns whether enough of the visible profiles, where the line was seen
    last, have an edge.
    """
    colors, u, base, row, good, visible = strip.colors, strip.u, strip.base, strip.row, strip.good, strip.visible
    red, green, blue, size = unit[0], unit[1], unit[2], len(preference)
    seen_first, seen_last = view.seen[0], view.seen[1]
    expected, found, mixed = 0, 0, np.empty(size + 2, np.float32)
    for k in range(len(u)):
        for i in range(size + 2):
            at = 3 * (side - 1 + i)
            r, g, b = np.float32(colors[k, at]), np.float32(colors[k, at + 1]), np.float32(colors[k, at + 2])
            mixed[i] = r * red + g * green + b * blue
        for i in range(size):
            answers[k, i] = mixed[i + 2] - mixed[i]
        index = _strongest(answers, k, preference)
        place, peak, inside = _peak_near(answers, k, index)
        good[k] = inside and peak > limit and allowed[k, index] != 0
        row[k] = base[k] + place
        found += good[k]
        expected += visible[k] != 0 and seen_first <= u[k] <= seen_last
    return found >= _ENOUGH * expected


@inner
def look_again(border, strip, side, limit, faint, preference, allowed, answers):
    """Second look at the profiles whose strongest answer is no edge of the line: only at places that may be one.

    The border of the surface is known by its two sides: beyond it the wall may change from brick to joint, and where
    the known step fails any step counts, even a `faint` one. The other arguments are those of `find_edges`.
    """
    colors, base, row, good = strip.colors, strip.base, strip.row, strip.good
    size, lowered, masked = len(preference), limit, np.empty((1, len(preference)), np.float32)
    if border:
        for k in range(len(row)):
            if good[k]:
                continue
            _mask(answers, allowed, k, masked)
            if _largest(masked, 0) < limit:
                lowered = faint
                for i in range(size):
                    answers[k, i] = _any_step(colors, k, 3 * (i + side))
    for k in range(len(row)):
        if good[k] or not (border or _largest(answers, k) > limit):
            continue
        _mask(answers, allowed, k, masked)
        index = _strongest(masked, 0, preference)
        place, peak, inside = _peak_near(answers, k, index)
        good[k] = inside and allowed[k, index] != 0 and peak > lowered
        row[k] = base[k] + place


@inner
def _strongest(answers, k, preference):
    """Index of the strongest answer of profile k among answers (K, n), with a preference for some places."""
    best, most = 0, answers[k, 0] * preference[0]
    for i in range(1, len(preference)):
        value = answers[k, i] * preference[i]
        if value > most:
            best, most = i, value
    return best


@inner
def _largest(answers, k):
    """Largest answer of profile k among answers (K, n)."""
    most = answers[k, 0]
    for i in range(1, answers.shape[1]):
        most = max(most, answers[k, i])
    return most


@inner
def _peak_near(answers, k, index):
    """Peak of the answers (K, n) of profile k near a whole place.

    Returns its place from the middle of the strip [px], the answer at the nearest whole place, and whether a peak could
    be there: not at the border of the strip. The interpolation is that of a Gaussian peak: a blurred step has a
    Gaussian derivative, on which a parabola would be off by up to 0.03 px.
    """
    middle = min(max(index, 1), answers.shape[1] - 2)
    peak = answers[k, middle]
    scale = max(peak, _TINY)
    before = math.log(max(answers[k, middle - 1] / scale, _FLOOR))
    behind = math.log(max(answers[k, middle + 1] / scale, _FLOOR))
    curvature = min(before + behind, -_TINY)
    shift = (before - behind) * np.float32(0.5) / curvature
    shift = min(max(shift, -_FARTHEST), _FARTHEST)
    if not curvature < _FLAT:  # nothing to interpolate
        shift = np.float32(0.0)
    return np.float64(middle - answers.shape[1] // 2) + np.float64(shift), peak, index == middle


@inner
def _mask(answers, allowed, k, masked):
    """Answers of profile k where an edge may lie, else zero, (1, n)."""
    for i in range(answers.shape[1]):
        masked[0, i] = answers[k, i] if allowed[k, i] else np.float32(0.0)


@inner
def _any_step(colors, k, at):
    """Length of the colours' gradient at a place of profile k [grey levels per px]."""
    red, green, blue = gradient(colors, k, at), gradient(colors, k, at + 1), gradient(colors, k, at + 2)
    return math.sqrt(red * red + green * green + blue * blue)


@inner
def end_at(neighbour, cut, view, fit, strip, margin):
    """Why a segment ends before a neighbouring profile; `cut` is whether no more was looked at on that side."""
    if neighbour < 0 or neighbour >= len(strip.u):
        return BY_SPAN if cut else BY_PICTURE
    beyond = fit.level + fit.slope * (strip.u[neighbour] - fit.center)
    if not margin <= beyond <= view.height - 1.0 - margin:
        return BY_PICTURE
    return BY_END if strip.visible[neighbour] else BY_MASK
