"""Straight edges of a picture, found at half resolution and fitted at full resolution.

Oriented edge points vote for directed lines: a Hough transform in which a point votes only for normals near its own
gradient, so that lines of either polarity and of every direction are found in one pass (O'Gorman and Clowes, 1976).
Lines are taken best first; each keeps its points.
"""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.compilation import inner, kernel
from ibvs_qp.vision.picture.picture import Picture, half_resolution

#: Weakest gradient of an edge, over two pixels [grey levels], shortest segment [px at 640], and most of them.
_GRADIENT, _SHORTEST_PX, _MOST = 6.0, 20.0, 60
#: Steps of the angle of a line's normal over the full circle [deg]: the normal points to the brighter side.
_ANGLES = 360
#: A point votes for normals within this angle of its own gradient, and supports one within the larger angle [deg].
_VOTES_WITHIN, _AGREES_WITHIN = 12, 25
#: Largest turn of a voted normal by the fit to its points [deg].
_TURN = 14
#: A point within this distance of a line supports it, at first and after the fit [px of the searched picture].
_NEAR_FIRST, _NEAR = 2.0, 1.5
#: Largest gap between neighbours on a segment: a length [px] and a fraction of the run before it.
_GAP, _GAP_SHARE = 6.0, 0.3
#: Least points per length of a segment, and least votes per length of the shortest one [1/px]: level and upright edges
#: have a point on every other pixel.
_DENSE, _VOTED = 0.25, 0.4
#: Peaks of the vote that are looked at.
_TRIED = 120
#: Most points: the strongest ones vote.
_STRONGEST = 2500
#: Levels of a gradient's magnitude, for the choice of the strongest.
_LEVELS = 362
#: Normals of every whole degree, (2, 360).
_NORMALS = np.array([(math.cos(math.radians(k)), math.sin(math.radians(k))) for k in range(_ANGLES)]).T.copy()


def edge_segments(picture: Picture, region: np.ndarray, within_deg: float) -> np.ndarray:
    """Straight edges in marked samples, bool (rows, columns), longest first.

    Where the tilt is known, edges within an angle [deg] of level and upright alone are looked for. Returns end points
    u1, v1, u2, v2 [px], the brighter side to the left of the way, (n, 4).
    """
    small, factor = half_resolution(picture.rgb)
    rows, columns = (
        np.minimum(factor * np.arange(size) // picture.grid.stride, cells - 1)
        for size, cells in zip(small.shape[:2], region.shape, strict=True)
    )
    normals = np.ones(_ANGLES, bool)
    if picture.tilt is not None:
        normals = np.abs((np.arange(_ANGLES) - math.degrees(picture.tilt) + 45.0) % 90.0 - 45.0) <= within_deg
    shortest = _SHORTEST_PX * picture.scale / factor
    middle = 0.5 * (small.shape[1] - 1), 0.5 * (small.shape[0] - 1)
    reach, least = int(math.hypot(*middle)) + 2, int(_VOTED * shortest)
    points = _edge_points(small, picture.mask, factor, np.ascontiguousarray(region), rows, columns)
    degrees = np.rint(np.degrees(np.arctan2(points[:, 3], points[:, 2]))).astype(np.int16) % _ANGLES
    points = points.take(np.argsort(degrees, kind="stable"), axis=0)
    first = np.concatenate(([0], np.cumsum(np.bincount(degrees, minlength=_ANGLES))))
    points[:, :2] -= middle
    votes = _votes(points, first, normals, _NORMALS, reach)
    degree, distance = _peaks(votes, max(least, 1))
    segments, used = np.empty((_MOST, 4)), np.zeros(len(points), np.bool_)
    kept = _segments_on(points, first, degree, distance - reach, _NORMALS, least, shortest, middle, used, segments)
    ends = segments[:kept] * factor + 0.5 * (factor - 1)  # pixel centres
    return ends[np.argsort(-np.hypot(ends[:, 2] - ends[:, 0], ends[:, 3] - ends[:, 1]), kind="stable")]


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


@kernel("f8[:, ::1](u1[:, :, ::1], u1[:, ::1], i8, b1[:, ::1], i8[::1], i8[::1])")
def _edge_points(small, mask, factor, region, row_of, column_of):
    """Column, row, direction and magnitude of edge points, the strongest where there are too many, (n, 5)."""
    rows, columns, _ = small.shape
    strength, gradient = np.zeros((rows, columns), np.int32), np.empty((rows, columns, 2), np.int16)
    for r in range(1, rows - 1):
        for c in range(1, columns - 1):
            if region[row_of[r], column_of[c]]:
                size, right, down = _gradient(small, r, c)
                if size > _GRADIENT * _GRADIENT:
                    strength[r, c], gradient[r, c, 0], gradient[r, c, 1] = size, right, down
    levels, places = np.zeros(_LEVELS, np.int64), np.empty(rows * columns, np.int32)
    count = 0
    for r in range(1, rows - 1):
        for c in range(1, columns - 1):
            if strength[r, c] == 0 or mask[factor * r, factor * c] != 0:
                continue
            ridge, dr, dc = _is_ridge(strength, gradient, r, c)
            # along level and upright edges every other place suffices
            if ridge and not (dc == 0 and c % 2) and not (dr == 0 and r % 2):
                places[count] = r * columns + c
                levels[int(math.sqrt(strength[r, c]))] += 1
                count += 1
    weakest, stronger = _LEVELS - 1, levels[_LEVELS - 1]
    while weakest > 0 and (stronger == 0 or stronger + levels[weakest - 1] <= _STRONGEST):
        weakest -= 1
        stronger += levels[weakest]
    kept, points = 0, np.empty((min(count, _STRONGEST), 5))
    for k in range(count):
        r = places[k] // columns
        c = places[k] - r * columns
        size = math.sqrt(strength[r, c])
        if size < weakest or kept == _STRONGEST:
            continue
        _, dr, dc = _is_ridge(strength, gradient, r, c)
        before, behind = math.sqrt(strength[r - dr, c - dc]), math.sqrt(strength[r + dr, c + dc])
        bend = before - 2.0 * size + behind
        shift = 0.5 * (before - behind) / bend if bend < 0.0 else 0.0
        points[kept, 0], points[kept, 1] = c + shift * dc, r + shift * dr
        points[kept, 2], points[kept, 3] = gradient[r, c, 0] / size, gradient[r, c, 1] / size
        points[kept, 4] = size
        kept += 1
    return points[:kept]


@kernel("i4[:, ::1](f8[:, ::1], i8[::1], b1[::1], f8[:, ::1], i8)")
def _votes(points, first, chosen, normals, reach):
    """Votes for lines by the degree of their normal and distance from the middle plus reach, (360, 2 reach + 1)."""
    votes = np.zeros((_ANGLES, 2 * reach + 1), np.int32)
    for degree in range(_ANGLES):
        for i in range(first[degree], first[degree + 1]):
            weight = 2 if points[i, 4] > 2.0 * _GRADIENT else 1
            for turn in range(-_VOTES_WITHIN, _VOTES_WITHIN + 1):
                k = (degree + turn) % _ANGLES
                if chosen[k]:
                    away = points[i, 0] * normals[0, k] + points[i, 1] * normals[1, k]
                    votes[k, int(away + reach + 0.5)] += weight
    return votes


def _peaks(votes: np.ndarray, least: int) -> tuple[np.ndarray, np.ndarray]:
    """Places of the highest peaks of votes, the highest first, (n,) each; of equal ones all or none."""
    k, r = np.divmod(np.flatnonzero(votes >= least), votes.shape[1])
    inside = (r > 0) & (r < votes.shape[1] - 1)
    k, r = k[inside], r[inside]
    own = votes[k, r]
    peak = (own > votes[k, r - 1]) & (own >= votes[k, r + 1]) & (own > votes[k - 1, r])
    peak &= own >= votes[(k + 1) % _ANGLES, r]
    k, r, own = k[peak], r[peak], own[peak]
    order = np.argsort(-own, kind="stable")
    if len(order) > _TRIED:
        order = order[: np.searchsorted(-own[order], -own[order[_TRIED]])]
    return k[order], r[order]


@kernel("i8(f8[:, ::1], i8[::1], i8[::1], i8[::1], f8[:, ::1], i8, f8, UniTuple(f8, 2), b1[::1], f8[:, ::1])")
def _segments_on(points, first, degrees, distances, normals, least, shortest, middle, used, segments):
    """Segments on voted lines between gaps of their points, which are then used; returns how many there are."""
    held, kept, wide = np.empty(len(points), np.int64), 0, _AGREES_WITHIN + _TURN + 1
    for peak in range(len(degrees)):
        k, rho = degrees[peak], float(distances[peak])
        nx, ny = normals[0, k], normals[1, k]
        near = _supporters(points, first, used, k, _AGREES_WITHIN + 1, nx, ny, rho, _NEAR_FIRST, held)
        if near < least:
            continue
        nx, ny, rho = _through(points, held, near, nx, ny, rho)
        near = _supporters(points, first, used, k, wide, nx, ny, rho, _NEAR, held)
        if near >= least:
            kept = _cut(points, held[:near], nx, ny, rho, shortest, middle, used, segments, kept)
        if kept == len(segments):
            break
    return kept


@inner
def _supporters(points, first, used, degree, within, nx, ny, rho, near, held):
    """Free points near a line whose gradients agree with its normal; returns how many."""
    agree, count = math.cos(math.radians(_AGREES_WITHIN)), 0
    for turn in range(-within, within + 1):
        k = (degree + turn) % _ANGLES
        for i in range(first[k], first[k + 1]):
            away = points[i, 0] * nx + points[i, 1] * ny - rho
            if not used[i] and abs(away) <= near and points[i, 2] * nx + points[i, 3] * ny >= agree:
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
def _cut(points, held, nx, ny, rho, shortest, middle, used, segments, kept):
    """Cut a line at gaps between its points, which are then used; returns how many segments are kept."""
    along, start, (u, v) = np.empty(len(held)), 0, middle
    for j in range(len(held)):
        along[j] = points[held[j], 1] * nx - points[held[j], 0] * ny
    ordered = np.sort(along)
    for j in range(len(held)):
        low, high, size = ordered[start], ordered[j], j + 1 - start
        if j + 1 < len(held) and ordered[j + 1] - high <= _GAP + _GAP_SHARE * (high - low):
            continue
        start = j + 1
        if high - low >= shortest and size >= _DENSE * (high - low) and kept < len(segments):
            segments[kept, 0], segments[kept, 1] = u + rho * nx - low * ny, v + rho * ny + low * nx
            segments[kept, 2], segments[kept, 3] = u + rho * nx - high * ny, v + rho * ny + high * nx
            kept += 1
            for i in range(len(held)):
                used[held[i]] |= low <= along[i] <= high
    return kept
