"""Strips of colour across predicted lines: their pixels, where an edge of the line may lie, and a new line's step."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.appearance.labels import BOARD, OTHER, PAINT, label_of, level_at
from ibvs_qp.vision.compilation import inner
from ibvs_qp.vision.lines.records import ANY, BORDER, PAINT_EDGE
from ibvs_qp.vision.medians import upper_median

#: A reading farther from the surface than this fraction of depth is not on it: on the far side of a border, 2.6 sigma
#: of 0.5 % + 0.5 % noise; on the surface's own side, more than real cameras are off by within 4 px of a border (7 %).
_OFF_FAR, _OFF_OWN = 0.018, 0.08
#: Turns a gradient's peak into the size of the step: a blur of 0.7 px leaves 0.4 of it.
_PEAK_TO_STEP = np.float32(2.5)
#: Profiles that define the step: gradients above this fraction of the median one.
_CLEAR = np.float32(0.5)


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
                allowed[k, i] = (label[i + own] == BOARD) & (label[i + far] == PAINT)
            else:  # a wall may have the colour of board or paint, but not their depth; lines on the board have both
                on = (label[i + own] != OTHER) & (away[i + own] <= _OFF_OWN)
                allowed[k, i] = on & ((label[i + far] == OTHER) | (away[i + far] > _OFF_FAR))


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
