"""Sub-pixel fits of predicted lines, all in one call."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np

from ibvs_qp.vision.compilation import MAD_TO_SIGMA, inner, kernel, upper_median
from ibvs_qp.vision.lines.strips import (
    LINES,
    PIXELS,
    QUERIES,
    SEARCH,
    VIEW,
    Strip,
    clamped,
    end_at,
    find_admissible,
    find_edges,
    gather,
    look_again,
    preferences,
    typical_step,
)

#: Pixels of a profile beyond its two sides that must be in the picture.
_MARGIN = 2
#: A profile's gradient must reach this fraction of the line's whole step (a sharp edge reaches 0.4).
_STEP_SHARE = 0.12
#: The same of the smallest allowed contrast, for faint lines.
_FAINT_SHARE = 0.3
#: No longer gap than this fraction of the searched length is bridged.
_BRIDGED_SHARE = 0.3
#: A line with less room in the picture [px] than this fraction of the number of profiles is left out.
_ROOM_SHARE = 0.125
#: Colour steps smaller than this have no direction [grey levels].
_STEP_MIN = 1e-3
#: Shortest distance of the points of a pair [px], and places from which pairs are tried.
_APART, _STARTS = np.float32(4.0), 20
#: Fraction of the points that must agree with a prediction moved across its line, else lines are tried.
_AGREEING = 0.8
#: Tukey's constant: 95 % efficiency on normal residuals.
_TUKEY = 4.685
#: Smallest residual scale [px]: below this, all residuals are rounding.
_SCALE_MIN = 0.02
#: Largest correlation of neighbouring residuals accounted for.
_CORRELATION_MAX = 0.8


class Fit(NamedTuple):
    """A line v = level + slope (u - center) in its view [px], variances of level and slope, and residual [px]."""

    level: float
    slope: float
    center: float
    level_variance: float
    slope_variance: float
    rms: float


class Run(NamedTuple):
    """First and last profile of a line, how many of those between agree, and how many agree or could be seen."""

    first: int
    last: int
    agreeing: int
    seen: int


@inner
def place_in_view(query, pixels, view):
    """Fill a record of `VIEW` from one of `QUERY`."""
    (height, width), (fx, fy, cx, cy), (a, b, c) = pixels.mask.shape, pixels.camera, pixels.plane
    rows, columns, row_step, column_step, angle = height, width, width, 1, query.theta
    upright = abs(math.cos(angle)) > abs(math.sin(angle))
    if upright:
        fx, fy, cx, cy, a, b = fy, fx, cy, cx, b, a
        rows, columns, row_step, column_step, angle = width, height, 1, width, 0.5 * math.pi - angle
    sign = 1.0 if math.sin(angle) > 0.0 else -1.0
    p, q = math.cos(angle) / fx, math.sin(angle) / fy
    view.upright, view.sign, view.row_step, view.column_step, view.height = upright, sign, row_step, column_step, rows
    view.fx, view.fy, view.cx, view.cy = fx, fy, cx, cy
    view.slope, view.level = -p / q, (query.rho + p * cx + q * cy) / q
    first, last = fx * query.span[0] + cx, fx * query.span[1] + cx
    view.first, view.last = max(first, 0.0), min(last, columns - 1.0)
    view.cut_first, view.cut_last = first > 0.0, last < columns - 1.0
    view.seen[0], view.seen[1] = fx * query.seen[0] + cx, fx * query.seen[1] + cx
    view.surface_behind, view.polarity = sign * query.surface_side > 0.0, sign * query.polarity
    for k in range(3):
        view.step[k] = sign * query.step[k]
    view.plane[0], view.plane[1], view.plane[2] = a / fx, b / fy, c - a * cx / fx - b * cy / fy


@inner
def finish(view, fit, run, strip, search, theta, line):
    """Fill a record of `LINE`, its normal turned to a predicted angle [rad]."""
    u, first, last = strip.u, run.first, run.last
    _polar(view, fit, theta, search.bias, line)
    v1, v2 = fit.level + fit.slope * (u[first] - fit.center), fit.level + fit.slope * (u[last] - fit.center)
    along, across = (1, 0) if view.upright else (0, 1)
    line.segment[0, along], line.segment[0, across] = (u[first] - view.cx) / view.fx, (v1 - view.cy) / view.fy
    line.segment[1, along], line.segment[1, across] = (u[last] - view.cx) / view.fx, (v2 - view.cy) / view.fy
    line.length_px = math.hypot(u[last] - u[first], v2 - v1)
    margin = search.side + _MARGIN
    line.ends[0] = end_at(first - 1, view.cut_first, view, fit, strip, margin)
    line.ends[1] = end_at(last + 1, view.cut_last, view, fit, strip, margin)
    line.inlier_share, line.count, line.rms_px = run.agreeing / max(run.seen, 1.0), run.agreeing, fit.rms


@inner
def _polar(view, fit, reference, bias, line):
    """(rho, theta) of a fit, theta within pi/2 of the reference [rad], and their covariance J diag(variances) J^T."""
    fx, fy, cx, cy = view.fx, view.fy, view.cx, view.cy
    a, b, c = -fit.slope * fx, fy, -fit.slope * cx + cy + fit.slope * fit.center - fit.level
    length = math.hypot(a, b)
    rho, angle = -c / length, math.atan2(b, a)
    rho_level = 1.0 / length
    rho_slope, angle_slope = (cx - fit.center) / length - c * a * fx / length**3, b * fx / length**2
    if view.upright:
        angle, angle_slope = 0.5 * math.pi - angle, -angle_slope
    if math.cos(angle - reference) < 0.0:
        rho, rho_level, rho_slope, angle = -rho, -rho_level, -rho_slope, angle + math.pi
    turns = np.rint((angle - reference) / (2.0 * math.pi))
    level_variance, slope_variance = fit.level_variance + bias * bias, fit.slope_variance
    line.rho, line.theta = rho, angle - 2.0 * math.pi * turns
    line.covariance[0, 0] = rho_level**2 * level_variance + rho_slope**2 * slope_variance
    line.covariance[0, 1] = line.covariance[1, 0] = rho_slope * angle_slope * slope_variance
    line.covariance[1, 1] = angle_slope**2 * slope_variance


@kernel(nb.void(PIXELS, QUERIES, SEARCH, LINES, nb.u1[:, :, :, ::1], nb.f8[:, :, ::1]))
def fit_profiles(pixels, queries, search, lines, sides, places):
    """Fit L predicted lines, each at K profiles: as many as the shortest of them has columns, up to the most.

    `lines` (L,) is filled; so are the colours before and behind them, `sides`, uint8 (L, 2, profiles, 3), and the
    places of these, (L, profiles, 2) [px], unless they are empty.
    """
    views, alive, count = np.empty(len(queries), VIEW), np.zeros(len(queries), np.bool_), search.profiles
    for line in range(len(queries)):
        place_in_view(queries[line], pixels, views[line])
        room = views[line].last - views[line].first
        alive[line] = room >= int(_ROOM_SHARE * search.profiles)
        if alive[line]:
            count = min(count, int(room) + 1)
    across, size, preference = 2 * (search.reach + search.side) + 1, 2 * search.reach + 1, preferences(search.reach)
    colors, hidden = np.empty((len(lines), count, 3 * across), np.uint8), np.empty((count, across), np.uint8)
    marks, rows = np.empty((len(lines), 2, count), np.uint8), np.empty((len(lines), 5, count))
    scratch, allowed, answers = np.empty(count), np.empty((count, size), np.uint8), np.empty((count, size), np.float32)
    seen, agreed = alive.copy(), True
    for line in range(len(lines)):
        if not seen[line]:
            continue
        strip = _strip(colors, hidden, marks, rows, line)
        alive[line] = _find(pixels, queries[line], views[line], search, strip, preference, allowed, answers)
        agreed &= _shift(strip, search.gate, scratch) and queries[line].known
    for line in range(len(lines)):
        lines[line].alive = False
        if not seen[line]:
            continue
        view, strip = views[line], _strip(colors, hidden, marks, rows, line)
        # one line far from its prediction has all of them looked for anew
        good = alive[line] and (agreed or _consensus(strip, search.gate))
        length = max(strip.u[count - 1] - strip.u[0], 1.0)
        missing = int(min(search.bridge / length, _BRIDGED_SHARE) * (count - 1))
        run = _keep_run(strip, good, search, missing)
        if run.agreeing < search.min_profiles:
            continue
        fit = _robust_line(strip, run.agreeing)
        contrast = _step_across(strip, view.sign, search, run.agreeing, lines[line].step)
        if contrast < search.contrast_min * search.contrast_min:
            continue
        lines[line].alive = True
        finish(view, fit, run, strip, search, queries[line].theta, lines[line])
        if sides.size:
            _copy_contents(view, fit, strip, search, sides[line], places[line])


@inner
def _strip(colors, hidden, marks, rows, line):
    """The strip of one line in the buffers of all; those of hidden pixels are the last one's."""
    mark, row = marks[line], rows[line]
    return Strip(colors[line], hidden, mark[0], mark[1], row[0], row[1], row[2], row[3], row[4])


@inner
def _find(pixels, query, view, search, strip, preference, allowed, answers):
    """Look for the edge of a line in every profile; whether the line has a colour step."""
    side, faint = search.side, _FAINT_SHARE * search.contrast_min
    direction, unit = np.empty(3), np.empty(3, np.float32)
    gather(pixels, view, search.reach + side, strip)
    find_admissible(pixels, view, query.demand, strip, side, allowed)
    for c in range(3):
        direction[c] = view.step[c]
    if not query.known:
        typical_step(strip.colors, allowed, side, int(view.polarity), direction)
    norm = math.sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2])
    for c in range(3):
        unit[c] = np.float32(0.5) * np.float32(direction[c] / max(norm, _STEP_MIN))
    limit = max(_STEP_SHARE * norm, faint)
    if not find_edges(view, strip, side, unit, limit, preference, allowed, answers):
        border = query.border and pixels.depth.size > 0
        look_again(border, strip, side, limit, faint, preference, allowed, answers)
    return norm >= _STEP_MIN


@inner
def _shift(strip, gate, scratch):
    """Distances of the edges from the prediction moved to the middle of them; whether most agree with it."""
    row, predicted, good, distance = strip.row, strip.predicted, strip.good, strip.distance
    count, near = 0, 0
    for k in range(len(row)):
        distance[k] = row[k] - predicted[k]
        if good[k]:
            scratch[count] = distance[k]
            count += 1
    middle = upper_median(scratch, count)
    for k in range(len(row)):
        distance[k] -= middle
        near += good[k] and abs(distance[k]) < gate
    return near >= max(_AGREEING * count, 1.0)


@inner
def _consensus(strip, gate):
    """Distances from the line that most edges agree with; whether any pair of them spans a line.

    The lines tried run through fixed pairs, a half and a third of the points apart.
    """
    u, row, good, distance = strip.u, strip.row, strip.good, strip.distance
    x, y, count = np.empty(len(u), np.float32), np.empty(len(u), np.float32), 0
    for k in range(len(u)):
        if good[k]:
            x[count], y[count] = u[k], row[k]
            count += 1
    if count == 0:
        return False
    zero, one = np.float32(0.0), np.float32(1.0)
    spans, most, best_slope, best_level = False, -one, zero, zero
    narrow = np.float32(gate)
    scale = -one / (narrow * narrow)
    for pair in range(2 * _STARTS):
        i = int((pair % _STARTS) * (1.0 / (_STARTS - 1)) * (count - 1))
        j = (i + count // (2 if pair < _STARTS else 3)) % count
        run, score = x[j] - x[i], zero
        if not abs(run) > _APART:
            continue
        slope = (y[j] - y[i]) / run
        level = y[i] - slope * x[i]
        for k in range(count):
            d = level + slope * x[k] - y[k]
            score += max(d * d * scale + one, zero)
        if not spans or score > most:
            spans, most, best_slope, best_level = True, score, slope, level
    for k in range(len(u)):
        distance[k] = best_level + best_slope * np.float32(u[k]) - np.float32(row[k])
    return spans


@inner
def _keep_run(strip, alive, search, bridge):
    """Keep the profiles within the gate that lie in the run with most of them.

    Up to `bridge` visible misses in a row are bridged; hidden places never break a run.
    """
    good, visible, distance = strip.good, strip.visible, strip.distance
    first, last, start, held, most, missed, edges = 0, 0, -1, 0, 0, 0, 0
    for k in range(len(good)):
        edges += good[k]
    alive = alive and edges >= search.min_profiles
    for k in range(len(good)):
        good[k] = alive and good[k] != 0 and abs(distance[k]) < search.gate
        if not good[k]:
            missed += visible[k] != 0
            continue
        if start < 0 or missed > bridge:
            start, held = k, 0
        held, missed = held + 1, 0
        if held > most:
            most, first, last = held, start, k
    count, seen = 0, 0
    for k in range(len(good)):
        if not first <= k <= last:
            good[k] = 0
            continue
        count += good[k]
        seen += good[k] != 0 or visible[k] != 0
    return Run(first, last, count, seen)


@inner
def _robust_line(strip, count):
    """Tukey-weighted least-squares line through the points, in two rounds; gross errors are out already."""
    u, v, used, size = strip.u, strip.row, strip.good, len(strip.u)
    residual, weight = np.empty(size), np.empty(size)
    middle, half = 0.5 * (u[0] + u[size - 1]), max(0.5 * (u[size - 1] - u[0]), 1.0)
    slope, level, center, spread, unit = 0.0, 0.0, 0.0, 1.0, 0.0
    for k in range(size):
        weight[k] = used[k]
    for turn in range(2):
        total, along, square, rows, product = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(size):
            a, w = (u[k] - middle) / half, weight[k]
            total += w
            along += w * a
            square += w * (a * a)
            rows += w * v[k]
            product += w * (a * v[k])
        total = max(total, 1e-9)
        center = along / total
        spread = max(square - along * center, 1e-9)
        slope = (product - rows * center) / spread
        level = rows / total
        for k in range(size):
            residual[k] = v[k] - (level - slope * center) - slope * ((u[k] - middle) / half)
        if turn == 0:
            unit = 1.0 / (_TUKEY * max(MAD_TO_SIGMA * _middle_size(residual, used, weight), _SCALE_MIN))
        for k in range(size):
            share = residual[k] * unit
            left = max(1.0 - share * share, 0.0)
            weight[k] = left * left * used[k]
    variance, total, rms = _variance(residual, weight, used, count)
    slope_variance = variance / (spread * half * half)
    return Fit(level, slope / half, middle + half * center, variance / total, slope_variance, rms)


@inner
def _middle_size(residual, used, scratch):
    """Median size of the residuals of the used points; 0 without any."""
    count = 0
    for k in range(len(residual)):
        if used[k]:
            scratch[count] = abs(residual[k])
            count += 1
    return upper_median(scratch, count) if count else 0.0


@inner
def _variance(residual, weight, used, count):
    """Variance of one point, inflated where neighbouring residuals agree, the sum of weights and the rms [px]."""
    total, square, neighbours, residuals, before = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(residual)):
        r = residual[k] * used[k]
        weighted = weight[k] * r
        total += weight[k]
        square += weighted * r
        residuals += r * r
        neighbours += before * weighted
        before = weighted
    total = max(total, 1.0)
    variance = square / max(total - 2.0, 1.0) + _SCALE_MIN * _SCALE_MIN / 12.0
    correlation = min(max(neighbours / max(square, 1e-12), 0.0), _CORRELATION_MAX)
    variance *= (1.0 + correlation) / (1.0 - correlation)
    return variance, total, math.sqrt(residuals / max(count, 1.0))


@inner
def _index_of(row, base, search):
    """Pixel of a profile in a row, at most the searched ones."""
    return search.reach + search.side + clamped(np.rint(row - base), -search.reach, search.reach)


@inner
def _step_across(strip, sign, search, count, step):
    """Fill in the mean colour step of the supporting profiles along the normal, (3,); returns its squared size."""
    colors, row, base, good, side = strip.colors, strip.row, strip.base, strip.good, search.side
    total, red, green, blue = max(count, 1.0), 0.0, 0.0, 0.0
    for k in range(len(row)):
        if not good[k]:
            continue
        index = _index_of(row[k], base[k], search)
        before, behind = 3 * (index - side), 3 * (index + side)
        red += float(colors[k, behind]) - float(colors[k, before])
        green += float(colors[k, behind + 1]) - float(colors[k, before + 1])
        blue += float(colors[k, behind + 2]) - float(colors[k, before + 2])
    red, green, blue = red / total, green / total, blue / total
    step[0], step[1], step[2] = sign * red, sign * green, sign * blue
    return red * red + green * green + blue * blue


@inner
def _copy_contents(view, fit, strip, search, sides, places):
    """Colours before and behind the line along its normal, uint8 (2, N, 3), and places of its supporting profiles."""
    colors, u, base, good, side = strip.colors, strip.u, strip.base, strip.good, search.side
    count, upright, behind = 0, int(view.upright), 1 if view.sign > 0.0 else 0
    for k in range(len(u)):
        if not good[k]:
            continue
        v = fit.level + fit.slope * (u[k] - fit.center)
        places[count, upright], places[count, 1 - upright] = u[k], v
        index = _index_of(v, base[k], search)
        for c in range(3):
            sides[1 - behind, count, c] = colors[k, 3 * (index - side) + c]
            sides[behind, count, c] = colors[k, 3 * (index + side) + c]
        count += 1
