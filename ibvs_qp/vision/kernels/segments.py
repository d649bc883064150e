"""Straight segments of the edges of a picture, of any direction: oriented edge points vote for directed lines.

A Hough transform in which a point votes only for normals near its own gradient, so that lines of either polarity and of
every direction are found in one pass (O'Gorman and Clowes, 1976). Lines are taken best first; each keeps its points.
"""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels.compile import inner, kernel

#: Steps of the angle of a line's normal over the full circle [deg]: the normal points to the brighter side.
_ANGLES = 360
#: A point votes for normals within this angle of its own gradient, and supports one within the larger angle [deg].
_VOTES_WITHIN, _AGREES_WITHIN = 12, 25
#: Largest turn of a voted normal by the fit to its points [deg].
_TURN = 14
#: A point within this distance of a line supports it, at first and after the fit [px of the searched picture].
_NEAR_FIRST, _NEAR = 2.0, 1.5
#: Largest gap between neighbours on a segment: a length [px] and a share of the run before it.
_GAP, _GAP_SHARE = 6.0, 0.3
#: Least points per length of a segment, and least votes per length of the shortest one [1/px]: level and upright edges
#: have a point on every other pixel.
_DENSE, _VOTED = 0.25, 0.4
#: Peaks of the vote that are looked at, and the height from which on they are not told apart.
_TRIED, _HIGHEST = 120, 4095
#: Columns of a point: column and row, about the middle of the picture once ordered by direction, then direction and
#: magnitude of its gradient. Of a segment: ends, points.
POINT, SEGMENT = 5, 5
#: Most points: the strongest ones vote.
_MOST = 2500
#: Levels of a gradient's magnitude, for the choice of the strongest.
_LEVELS = 362


@inner
def _gradient(small, r, c):
    """Change of the channel that changes most, to the right and down, and its squared length."""
    best = right = down = np.int64(0)
    for k in range(3):
        x = np.int64(small[r, c + 1, k]) - np.int64(small[r, c - 1, k])
        y = np.int64(small[r + 1, c, k]) - np.int64(small[r - 1, c, k])
        size = x * x + y * y
        if size > best:
            best, right, down = size, x, y
    return best, right, down


@inner
def _columns_of(cell, cells, stride, factor, columns):
    """First column of a cell and the one behind its last; the outer cells reach to the border, but for one pixel."""
    first, end = (cell * stride + factor - 1) // factor, ((cell + 1) * stride + factor - 1) // factor
    return max(first, 1), columns - 1 if cell == cells - 1 else min(end, columns - 1)


@inner
def _gradients(small, region, stride, factor, least, strength, gradient):
    """Gradients of at least some squared length in the wanted cells."""
    rows, columns, _ = small.shape
    for r in range(1, rows - 1):
        row = min(factor * r // stride, region.shape[0] - 1)
        for cell in range(region.shape[1]):
            if region[row, cell] == 0:
                continue
            first, end = _columns_of(cell, region.shape[1], stride, factor, columns)
            for c in range(first, end):
                size, right, down = _gradient(small, r, c)
                if size > least:
                    strength[r, c] = size
                    gradient[r, c, 0] = right
                    gradient[r, c, 1] = down


@inner
def _is_ridge(strength, gradient, r, c):
    """Whether a gradient is largest along itself, and the step to its neighbours along it."""
    right, down = gradient[r, c, 0], gradient[r, c, 1]
    if 5 * abs(down) < 2 * abs(right):
        dr, dc = 0, 1
    elif 5 * abs(right) < 2 * abs(down):
        dr, dc = 1, 0
    else:
        dr, dc = (1 if (right > 0) == (down > 0) else -1), 1
    own = strength[r, c]
    return own >= strength[r - dr, c - dc] and own > strength[r + dr, c + dc], dr, dc


@inner
def _edge_points(small, mask, factor, region, stride, threshold, points):
    """Edge points that nothing hides, the strongest where there are too many; returns how many."""
    rows, columns, _ = small.shape
    strength = np.zeros((rows, columns), np.int32)
    gradient = np.empty((rows, columns, 2), np.int16)
    _gradients(small, region, stride, factor, threshold * threshold, strength, gradient)
    levels = np.zeros(_LEVELS, np.int64)
    places = np.empty(rows * columns, np.int32)
    count = 0
    for r in range(1, rows - 1):
        row = min(factor * r // stride, region.shape[0] - 1)
        for cell in range(region.shape[1]):
            if region[row, cell] == 0:
                continue
            first, end = _columns_of(cell, region.shape[1], stride, factor, columns)
            for c in range(first, end):
                if strength[r, c] == 0 or mask[factor * r, factor * c] != 0:
                    continue
                ridge, dr, dc = _is_ridge(strength, gradient, r, c)
                # along level and upright edges every other place tells enough
                if ridge and not (dc == 0 and c % 2) and not (dr == 0 and r % 2):
                    places[count] = r * columns + c
                    levels[int(math.sqrt(strength[r, c]))] += 1
                    count += 1
    weakest, stronger = _LEVELS - 1, levels[_LEVELS - 1]
    while weakest > 0 and (stronger == 0 or stronger + levels[weakest - 1] <= _MOST):
        weakest -= 1
        stronger += levels[weakest]
    kept = 0
    for k in range(count):
        r = places[k] // columns
        c = places[k] - r * columns
        size = math.sqrt(strength[r, c])
        if size < weakest or kept == _MOST:
            continue
        _, dr, dc = _is_ridge(strength, gradient, r, c)
        before, behind = math.sqrt(strength[r - dr, c - dc]), math.sqrt(strength[r + dr, c + dc])
        bend = before - 2.0 * size + behind
        shift = 0.5 * (before - behind) / bend if bend < 0.0 else 0.0
        points[kept, 0] = c + shift * dc
        points[kept, 1] = r + shift * dr
        points[kept, 2] = gradient[r, c, 0] / size
        points[kept, 3] = gradient[r, c, 1] / size
        points[kept, 4] = size
        kept += 1
    return kept


@inner
def _wanted_degrees(tilt, within):
    """Whether normals of each whole degree are wanted: near level and upright for a tilt [rad], all without one."""
    wanted = np.ones(_ANGLES, np.uint8)
    if not math.isnan(tilt):
        for k in range(_ANGLES):
            off = (k - math.degrees(tilt) + 45.0) % 90.0 - 45.0
            wanted[k] = abs(off) <= within
    return wanted


@inner
def _by_direction(points, count, middle, first):
    """The points about the middle, by the whole degree of their gradient; ``first`` receives where each one begins."""
    degrees, ordered = np.empty(count, np.int64), np.empty((count, POINT))
    for i in range(count):
        degrees[i] = round(math.degrees(math.atan2(points[i, 3], points[i, 2]))) % _ANGLES
        first[degrees[i] + 1] += 1
    for k in range(_ANGLES):
        first[k + 1] += first[k]
    filled = first[:_ANGLES].copy()
    for i in range(count):
        place = ordered[filled[degrees[i]]]
        place[0], place[1] = points[i, 0] - middle[0], points[i, 1] - middle[1]
        place[2:] = points[i, 2:]
        filled[degrees[i]] += 1
    return ordered


@inner
def _peaks(points, first, wanted, middle, threshold, least, cosine, sine, normals, distances):
    """Voted lines, best first: degree of the normal and distance from the middle; returns how many."""
    reach = int(math.hypot(middle[0], middle[1])) + 2
    wide = 2 * reach + 1
    votes = np.zeros((_ANGLES, wide), np.int32)
    for degree in range(_ANGLES):
        for i in range(first[degree], first[degree + 1]):
            u, v = points[i, 0], points[i, 1]
            weight = 2 if points[i, 4] > 2.0 * threshold else 1
            for turn in range(-_VOTES_WITHIN, _VOTES_WITHIN + 1):
                k = (degree + turn) % _ANGLES
                if wanted[k] == 0:
                    continue
                votes[k, int(u * cosine[k] + v * sine[k] + reach + 0.5)] += weight
    heights, places = np.empty(votes.size // 2, np.int64), np.empty(votes.size // 2, np.int64)
    levels, count = np.zeros(_HIGHEST + 1, np.int64), 0
    for k in range(_ANGLES):
        if wanted[k] == 0:
            continue
        up, down, row = votes[(k + 1) % _ANGLES], votes[(k - 1) % _ANGLES], votes[k]
        for r in range(1, wide - 1):
            own = row[r]
            if own < least or own <= row[r - 1] or own < row[r + 1] or own <= down[r] or own < up[r]:
                continue
            heights[count], places[count] = own, k * wide + r
            levels[min(own, _HIGHEST)] += 1
            count += 1
    lowest, higher = _HIGHEST, levels[_HIGHEST]
    while lowest > least and higher + levels[lowest - 1] <= _TRIED:
        lowest -= 1
        higher += levels[lowest]
    kept = 0
    for k in range(count):  # of noise there are thousands, so only the highest are sorted, by insertion
        if heights[k] < lowest or kept == _TRIED:
            continue
        place, height, own = kept, heights[k], places[k]
        while place > 0 and heights[place - 1] < height:
            heights[place], places[place] = heights[place - 1], places[place - 1]
            place -= 1
        heights[place], places[place] = height, own
        kept += 1
    for k in range(kept):
        normals[k] = places[k] // wide
        distances[k] = places[k] - normals[k] * wide - reach
    return kept


@inner
def _supporters(points, first, used, degree, within, nx, ny, rho, near, held):
    """Free points near a line whose gradients agree with its normal; returns how many."""
    agree, count = math.cos(math.radians(_AGREES_WITHIN)), 0
    for turn in range(-within, within + 1):
        k = (degree + turn) % _ANGLES
        for i in range(first[k], first[k + 1]):
            away = points[i, 0] * nx + points[i, 1] * ny - rho
            if used[i] == 0 and abs(away) <= near and points[i, 2] * nx + points[i, 3] * ny >= agree:
                held[count] = i
                count += 1
    return count


@inner
def _through(points, held, count, nx, ny, rho):
    """The line through points by least squares; the given one where it would turn too far."""
    u = v = uu = uv = vv = 0.0
    for j in range(count):
        x, y = points[held[j], 0], points[held[j], 1]
        u += x
        v += y
        uu += x * x
        uv += x * y
        vv += y * y
    u, v = u / count, v / count
    direction = 0.5 * math.atan2(2.0 * (uv / count - u * v), (uu / count - u * u) - (vv / count - v * v))
    ax, ay = -math.sin(direction), math.cos(direction)
    if ax * nx + ay * ny < 0.0:
        ax, ay = -ax, -ay
    if ax * nx + ay * ny < math.cos(math.radians(_TURN)):
        return nx, ny, rho
    return ax, ay, u * ax + v * ay


@inner
def _cut(points, held, count, middle, nx, ny, rho, shortest, used, segments, kept, bins):
    """Segments of a line between gaps of its points; their points are used. Returns how many segments there are now.

    ``bins`` holds number, lowest and highest place of the points on every pixel along a line: nothing need be sorted.
    """
    bins[:, 0] = 0.0
    half = len(bins) // 2
    for j in range(count):
        along = points[held[j], 1] * nx - points[held[j], 0] * ny
        one = bins[int(along + half)]
        one[1] = along if one[0] == 0.0 else min(one[1], along)
        one[2] = along if one[0] == 0.0 else max(one[2], along)
        one[0] += 1.0
    low, high, size = 0.0, 0.0, 0.0
    for k in range(len(bins) + 1):
        last = k == len(bins)
        if not last and bins[k, 0] == 0.0:
            continue
        if not last and size > 0.0 and bins[k, 1] - high <= _GAP + _GAP_SHARE * (high - low):
            high = bins[k, 2]
            size += bins[k, 0]
            continue
        if size > 0.0 and high - low >= shortest and size >= _DENSE * (high - low) and kept < len(segments):
            segments[kept, 0], segments[kept, 1] = middle[0] + rho * nx - low * ny, middle[1] + rho * ny + low * nx
            segments[kept, 2], segments[kept, 3] = middle[0] + rho * nx - high * ny, middle[1] + rho * ny + high * nx
            segments[kept, 4] = size
            kept += 1
            for j in range(count):
                along = points[held[j], 1] * nx - points[held[j], 0] * ny
                if low <= along <= high:
                    used[held[j]] = 1
        if not last:
            low, high, size = bins[k, 1], bins[k, 2], bins[k, 0]
    return kept


@kernel("i8(u1[:, :, ::1], u1[:, ::1], i8, u1[:, ::1], i8, f8, f8, f8, f8, f8[:, ::1])")
def find_segments(small, mask, factor, region, stride, threshold, shortest, tilt, within, segments):
    """Segments of a picture, those with most votes first.

    Args:
        small: Picture, at a lower resolution, (h, w, 3).
        mask: Non-zero where the vehicle hides the view, at full resolution, (H, W).
        factor: Pixels at full resolution per pixel of the picture.
        region: Non-zero on the cells in which segments are wanted, (rows, columns).
        stride: Side of a cell at full resolution [px].
        threshold: Least gradient, over two pixels [grey levels].
        shortest: Least length [px].
        tilt: Angle of gravity in the picture from down [rad]; NaN if it is unknown.
        within: With a tilt, segments this near to level and upright are wanted [deg].
        segments: Receives u1, v1, u2, v2 [px] and number of points, (n, 5). The brighter side lies to the left of the
            way from the first end to the second.

    Returns:
        How many there are.
    """
    points = np.empty((_MOST + 1, POINT))
    count = _edge_points(small, mask, factor, region, stride, threshold, points)
    middle = (0.5 * (small.shape[1] - 1), 0.5 * (small.shape[0] - 1))
    cosine, sine = np.empty(_ANGLES), np.empty(_ANGLES)
    for k in range(_ANGLES):
        cosine[k], sine[k] = math.cos(math.radians(k)), math.sin(math.radians(k))
    first, least = np.zeros(_ANGLES + 1, np.int64), int(_VOTED * shortest)
    points, wanted = _by_direction(points, count, middle, first), _wanted_degrees(tilt, within)
    normals, distances = np.empty(_TRIED, np.int64), np.empty(_TRIED, np.int64)
    tried = _peaks(points, first, wanted, middle, threshold, least, cosine, sine, normals, distances)
    bins = np.empty((2 * int(math.hypot(middle[0], middle[1])) + 6, 3))
    used, held, kept = np.zeros(count, np.uint8), np.empty(count, np.int64), 0
    for peak in range(tried):
        k, rho = normals[peak], float(distances[peak])
        nx, ny = cosine[k], sine[k]
        near = _supporters(points, first, used, k, _AGREES_WITHIN + 1, nx, ny, rho, _NEAR_FIRST, held)
        if near < least:
            continue
        nx, ny, rho = _through(points, held, near, nx, ny, rho)
        wide = _AGREES_WITHIN + _TURN + 1
        near = _supporters(points, first, used, k, wide, nx, ny, rho, _NEAR, held)
        if near >= least:
            kept = _cut(points, held, near, middle, nx, ny, rho, shortest, used, segments, kept, bins)
        if kept == len(segments):
            break
    return kept
