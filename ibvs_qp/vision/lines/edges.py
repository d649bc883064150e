"""Where each profile across a predicted line has its edge, to a fraction of a pixel."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.compilation import inner
from ibvs_qp.vision.lines.strips import gradient

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

    The interpolation is that of a Gaussian peak: a blurred step has a Gaussian derivative, on which a parabola would be
    off by up to 0.03 px.

    Returns:
        Its place from the middle of the strip [px], the answer at the nearest whole place, and whether a peak could be
        there: not at the border of the strip.
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
