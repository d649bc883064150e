"""How well lines fit as ends of the surface: depth and colour on both sides, and nothing of the surface beyond."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.vision.appearance.colors import BOARD, PAINT, SurfaceColors, is_alike
from ibvs_qp.vision.appearance.light import in_other_light, is_shaded
from ibvs_qp.vision.compilation import inner, kernel
from ibvs_qp.vision.lines.refine import RefinedLine
from ibvs_qp.vision.picture.picture import Picture
from ibvs_qp.vision.surface.plane import SurfaceRegion, depth_gate

#: Distances from the line at which depth is read [px at 640]. A depth camera moves a step by up to 20 px.
_DEPTH_PX = np.array((3.0, 5.0, 8.0, 12.0, 18.0, 26.0, 36.0))
#: Distances at which colour is read [px at 640]: beyond blur, then farther.
_COLOR_PX = np.array((4.0, 7.0, 11.0))
#: Samples of the surface beyond a border count from this distance on [cells], and this fraction of them rules it out.
_CELLS_BEYOND, _SHARE_BEYOND = 2.0, 0.25
#: Distance from a line at which the surface's samples must lie beside it [cells], places along it at which they are
#: looked for, and the fraction of them at which they must lie: prints, holes and corners are no samples.
_CELLS_BESIDE, _PLACES_BESIDE, _MOSTLY = 1.5, 16, 0.75
#: Places looked at along a line.
_PLACES = 32
#: Distance from a segment at which its two sides are read for a first look [px at 640], and places along it.
_LOOK_PX, _LOOKS = 4.0, 16
#: Places along a segment at which the surface is looked for beside it; one beside which it lies for more than this
#: fraction of its length stays whole, a shorter piece is left out [px at 640].
_PLACES_TRIM, _WHOLE, _SHORTEST_PX = 48, 0.95, 40.0
#: Samples this far apart are near each other: two cells.
_NEAR_CELLS = np.ones((5, 5), np.uint8)
#: Length with half the score of a long line [px at 640].
_HALF_LENGTH_PX = 12.0
#: A border this long, as a fraction of the surface's size along it, earns all.
_FULL_SHARE = 0.2
#: Meaning of a depth reading.
_UNSEEN, _ON, _FARTHER, _NEARER = 0, 1, 2, 3
#: Distances within which the surface must be seen on its own side, beyond which it must not be, and within which it
#: goes on, as places in the list of distances.
_SEEN_WITHIN, _ENDED_FROM, _ON_FROM, _ON_TO, _COVERED_FROM, _HELD_TO = 5, 5, 1, 4, 2, 2
#: Colours on both sides nearer than this are one; next to the bare surface, a continuation is as near to it [grey
#: levels].
_CONTRAST, _SAME_COLOR = 16.0, 24.0
#: Colours this near to the paint's are paint [grey levels]: less than the gate of the labels, for no depth confirms it.
_SAME_PAINT = 30.0
#: Of the places beyond a line at which colour is read, this many must be the surface's for it to go on.
_MOST = 2
#: A shadow's edge has no step of depth: means over a line of readings before this place in the list, and from it on,
#: differ by less than this fraction; a board 1 cm before a wall, seen from 1 m, has 1 %. Readings farther off are of
#: another thing; of the near ones this fraction at most may be. The limit grows with the noise of few readings, by this
#: factor at most.
_FAR_FROM, _NO_STEP, _NEAR_PLANE, _FEW, _NOISIER = 3, 0.007, 0.05, 0.3, 1.3
#: By so large a fraction of the line the surface ends a little farther out, and the shadow's edge lies before that.
_ENDS_SOON = 0.3
#: A border that only colour shows counts this much, and one that depth shows against the colour.
_COLOR_ONLY, _DEPTH_ONLY = 0.75, 0.5
#: Least fraction of the places along a line that nothing hides.
_LEAST_SHARE = 0.15


@dataclass(frozen=True)
class Borders:
    """n lines scored as ends of the surface, each with the better of its two sides as the surface's side."""

    side: np.ndarray  # +1 if the surface lies where the given normal points, -1 if on the other side, (n,)
    depth: np.ndarray  # 0..1, fraction of the line along which the surface ends by depth, (n,)
    color: np.ndarray  # 0..1, the same by colour, (n,)
    score: np.ndarray  # 0..1, all of it together with the length, (n,)
    held: np.ndarray  # 0..1, fraction of the line to which the surface reaches by depth, (n,)

    @property
    def parts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The three fractions, (n,) each."""
        return self.depth, self.color, self.held


def score_borders(
    segments: np.ndarray,
    picture: Picture,
    region: SurfaceRegion,
    colors: SurfaceColors,
    theta: np.ndarray | None = None,
) -> Borders:
    """Score lines as ends of the surface.

    Args:
        segments: End points (u1, v1, u2, v2) [px], (n, 4).
        picture: The picture.
        region: The surface.
        colors: Colours of board and paint.
        theta: Angles of their normals [rad], (n,); None for a first look, with normals to the right and fewer places.
    """
    run, normals = _along_and_across(segments)
    if theta is not None:
        normals *= np.sign(np.vecdot(normals, np.column_stack((np.cos(theta), np.sin(theta)))))[:, None]
    grid, ends, paint = picture.grid, np.ascontiguousarray(segments), colors.paint if colors.paint_distinct else None
    (a, b, c), (fx, fy, cx, cy) = region.plane.inverse_depth.tolist(), picture.intrinsics
    plane = np.array((a / fx, b / fy, c - a * cx / fx - b * cy / fy))
    distances = picture.scale * _DEPTH_PX, picture.scale * _COLOR_PX
    own, other = np.ascontiguousarray(region.color, float), np.empty(0) if paint is None else paint.astype(float)
    images, places = (picture.rgb, picture.depth, picture.mask), _PLACES // 2 if theta is None else _PLACES
    evidence = _border_evidence(
        *images, ends, normals, *distances, plane, depth_gate(region.plane), own, other, region.shadowed, places
    )
    rows, columns = np.nonzero(region.colored)
    samples = np.column_stack((columns, rows)) * float(grid.stride) + grid.offset
    beyond = _samples_beyond(samples, ends, normals, _CELLS_BEYOND * grid.stride)
    length = np.hypot(*run.T)
    grown = length / (length + _HALF_LENGTH_PX * picture.scale)
    grown = grown * np.sqrt(np.minimum(length / np.maximum(_FULL_SHARE * beyond[:, 2], 1.0), 1.0))
    scores = evidence[:, :, 0] * grown[:, None] * np.maximum(0.0, 1.0 - beyond[:, :2] / _SHARE_BEYOND)
    if region.by_color:  # a wall has the surface's depth, its joints the surface's colour
        aside = _CELLS_BESIDE * grid.stride * np.stack((normals, -normals), axis=1)
        rows, columns, _ = grid.cells_at(*places_beside(ends, aside, _PLACES_BESIDE))
        beside = region.cells[rows, columns].mean(axis=2)
        scores = scores * np.minimum(beside / _MOSTLY, 1.0)
    best, each = np.where(scores[:, 0] >= scores[:, 1], 0, 1), np.arange(len(ends))
    return Borders(
        1 - 2 * best, evidence[each, best, 1], evidence[each, best, 2], scores[each, best], evidence[each, best, 3]
    )


def end_of_paint(picture: Picture, surface: SurfaceRegion, colors: SurfaceColors) -> np.ndarray:
    """Samples near both paint and board, bool (rows, columns)."""
    labels = colors.label(picture.colors, *picture.grid.pixels, shade=True)
    marks = surface.cells, labels == BOARD, labels == PAINT
    near = [cv2.dilate(cells.view(np.uint8), _NEAR_CELLS) > 0 for cells in marks]
    return near[0] & near[1] & near[2]


def board_beside_paint(fit: RefinedLine, colors: SurfaceColors, least: float) -> int:
    """Side of the board, +1 or -1, if the other one shows paint along the least fraction of the line; else 0."""
    if not colors.paint_distinct or fit.sides.size == 0:
        return 0
    labels = colors.label(fit.sides, *fit.pixels.T, shade=True)
    board, paint = ((labels == kind).mean(axis=1) >= least for kind in (BOARD, PAINT))
    return 1 if board[1] and paint[0] else -1 if board[0] and paint[1] else 0


def differing(segments: np.ndarray, picture: Picture, colors: SurfaceColors) -> np.ndarray:
    """Fraction of each segment (n, 4) along which one side shows the board and the other the paint, (n,)."""
    height, width = picture.mask.shape
    u, v = places_beside(segments, ways_aside(segments, _LOOK_PX * picture.scale), _LOOKS)
    u = np.minimum(np.maximum(np.rint(u), 0.0), width - 1.0).astype(np.intp)
    v = np.minimum(np.maximum(np.rint(v), 0.0), height - 1.0).astype(np.intp)
    labels = colors.label(picture.rgb[v, u], u, v, shade=True)
    one, two = labels[:, 0], labels[:, 1]
    return ((one != two) & (one > 0) & (two > 0)).mean(axis=1)


def trimmed(segments: np.ndarray, picture: Picture, surface: SurfaceRegion) -> np.ndarray:
    """The pieces beside the surface of those segments (n, 4) that reach beyond it, one each at most, (m, 4) [px].

    A joint of the wall may run on where an edge of the surface stops. The search for segments joins the two, a pixel or
    two aside; a fit to both is wrong by a part of that. Shorter pieces are left out.
    """
    (run, _), start, margin = _along_and_across(segments), segments[:, :2], 0.5 / _PLACES_TRIM
    region = cv2.morphologyEx(surface.whole, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) > 0
    aside = ways_aside(segments, _CELLS_BESIDE * picture.grid.stride)
    rows, columns, inside = picture.grid.cells_at(*places_beside(segments, aside, _PLACES_TRIM, margin))
    sides = inside & region[rows, columns]
    marked = sides.sum(axis=2)
    beside = np.where((marked[:, 0] >= marked[:, 1])[:, None], sides[:, 0], sides[:, 1])
    first, count = _longest_runs(beside)
    shortest = _SHORTEST_PX * picture.scale
    kept = (count < _WHOLE * _PLACES_TRIM) & (count * np.hypot(*run.T) >= shortest * _PLACES_TRIM)
    ends = [(edge / _PLACES_TRIM)[:, None] * run + start for edge in (first, first + count)]
    return np.hstack(ends)[kept]


def _longest_runs(marks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First place and number of places of the longest run in every row of bool (n, K), (n,) each."""
    place = np.arange(marks.shape[1])
    length = place - np.maximum.accumulate(np.where(marks, -1, place), axis=1)  # since the last unmarked place
    last = np.argmax(length, axis=1)
    count = length[np.arange(len(marks)), last]
    return last + 1 - count, count


def _along_and_across(segments: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ways along segments (n, 4) and unit vectors to the right of them [px], (n, 2) each."""
    run = segments[:, 2:] - segments[:, :2]
    return run, np.column_stack((-run[:, 1], run[:, 0])) / np.hypot(*run.T)[:, None]


def ways_aside(segments: np.ndarray, distance: float) -> np.ndarray:
    """Ways [px] to the left and to the right of segments (n, 4), seen from the first end to the second, (n, 2, 2)."""
    run = segments[:, 2:] - segments[:, :2]
    right = (distance / np.hypot(*run.T))[:, None] * np.column_stack((-run[:, 1], run[:, 0]))
    return np.stack((-right, right), axis=1)


def places_beside(
    segments: np.ndarray, aside: np.ndarray, count: int, margin: float = 0.05
) -> tuple[np.ndarray, np.ndarray]:
    """Columns and rows of places along segments (n, 4), moved to both sides (n, 2, 2) [px], (n, 2, count) each.

    A margin, fraction of the length, is left out at either end.
    """
    share = margin + (1.0 - 2.0 * margin) * np.arange(count) / (count - 1)
    first, last = segments[:, :2, None, None], segments[:, 2:, None, None]
    u, v = (first[:, k] + share * (last[:, k] - first[:, k]) + aside[:, :, k, None] for k in range(2))
    return u, v


@kernel(
    "f8[:, :, ::1](u1[:, :, ::1], f4[:, ::1], u1[:, ::1], f8[:, ::1], f8[:, ::1], f8[::1], f8[::1], f8[::1], f8,"
    " f8[::1], f8[::1], b1, i8)"
)
def _border_evidence(
    rgb, depth, mask, pixels, normals, depth_px, color_px, plane, gate, color, paint, shadowed, places
):
    """Evidence that the surface ends at lines, with the surface along their normals, and against them.

    Depth and colour are read at distances `depth_px` and `color_px` (3,) on both sides of places along the lines; a
    reading within the gate, fraction of depth, of the plane 1/Z = p u + q v + r is on the surface, `color` and `paint`
    are its colours, paint empty if unknown, `shadowed` whether shadows lie on it. Returns score, fraction by depth,
    fraction by colour, and fraction to which the surface reaches, (n, 2, 4).
    """
    states, evidence = np.empty((2, len(depth_px)), np.int64), np.zeros((len(pixels), 2, 4))
    colors, middle, inside = np.empty((2, 3, 3)), np.empty((2, 3)), np.empty((2, 3), np.bool_)
    sums, off = np.empty((2, 8)), np.empty((2, 2, 3))
    for i in range(len(pixels)):
        sums[:] = 0.0
        off[:] = 0.0
        count = 0
        for k in range(places):
            share = (k + 0.5) / places
            u = pixels[i, 0] + share * (pixels[i, 2] - pixels[i, 0])
            v = pixels[i, 1] + share * (pixels[i, 3] - pixels[i, 1])
            free = True
            for side in range(2):
                sign = 1.0 if side == 0 else -1.0
                nx, ny = sign * normals[i, 0], sign * normals[i, 1]
                _read_depth(depth, mask, u, v, nx, ny, depth_px, plane, gate, states[side], off[side])
                free &= _read_color(rgb, mask, u, v, nx, ny, color_px, colors[side], inside[side])
            if not free:
                continue
            count += 1
            shaded = _light_changes(colors[0], colors[1], middle)
            for side in range(2):
                far = 1 - side
                _ends_here(
                    states[side],
                    states[far],
                    colors[side],
                    colors[far],
                    inside[far],
                    color,
                    paint,
                    shadowed,
                    shaded,
                    sums[side],
                )
        whole = places * _FAR_FROM
        near, beyond = _level(off[:, 0], whole), _level(off[:, 1], places * len(depth_px) - whole)
        for side in range(2):
            if count < _LEAST_SHARE * places:
                continue
            seen, ended, covered, stops, changes, own, by_light, held = sums[side] / count
            by_depth = ended * stops
            shadow = near and (beyond or by_depth > _ENDS_SOON)
            by_color = (changes - by_light if shadow else changes) * own
            ends = max(by_depth * (_DEPTH_ONLY + (1.0 - _DEPTH_ONLY) * by_color), _COLOR_ONLY * by_color)
            evidence[i, side, 0] = seen * ends * (1.0 - covered)
            evidence[i, side, 1], evidence[i, side, 2], evidence[i, side, 3] = by_depth, by_color, held
    return evidence


@inner
def _read_depth(depth, mask, u, v, nx, ny, distances, plane, gate, states, off):
    """Meaning of the depth at growing distances from a place; adds up how far off the plane it is, and the readings."""
    height, width = mask.shape
    for d in range(len(distances)):
        column, row = round(u + distances[d] * nx), round(v + distances[d] * ny)
        states[d] = _UNSEEN
        if column < 0 or row < 0 or column >= width or row >= height or mask[row, column] != 0:
            continue
        z = np.float64(depth[row, column])
        if z > 0.0 and z < np.inf:
            relative = z * (plane[0] * column + plane[1] * row + plane[2]) - 1.0
            states[d] = _ON if abs(relative) <= gate else _FARTHER if relative > 0.0 else _NEARER
            part = 1 if d >= _FAR_FROM else 0
            if abs(relative) < _NEAR_PLANE:
                off[part, 0] += relative
                off[part, 1] += 1.0
            else:
                off[part, 2] += 1.0


@inner
def _level(off, whole):
    """Whether the surface goes on beyond a line by depth.

    Of the readings on both sides these are the sum, the number, and the number of those far off, (2, 3); `whole` is the
    number on a side without gaps. Means of fewer ones, as at the border of the picture, are noisier.
    """
    one, two = off[0, 1], off[1, 1]
    if one <= off[0, 2] * (1.0 / _FEW - 1.0) or two <= off[1, 2] * (1.0 / _FEW - 1.0):
        return False
    noise = min(math.sqrt(whole / min(one, two)), _NOISIER)
    return abs(off[0, 0] / one - off[1, 0] / two) < _NO_STEP * noise


@inner
def _light_changes(one, two, middle):
    """Whether the colours next to a place, (3, 3) by distance on each side, are one colour in sun and in shadow.

    Their means (2, 3) are filled in.
    """
    for c in range(3):
        middle[0, c], middle[1, c] = 0.5 * (one[0, c] + one[1, c]), 0.5 * (two[0, c] + two[1, c])
    return in_other_light(middle[0], middle[1])


@inner
def _read_color(rgb, mask, u, v, nx, ny, distances, colors, inside):
    """Colour at growing distances from a place, the border's beyond the picture; whether nothing hides it."""
    height, width = mask.shape
    free = True
    for d in range(len(distances)):
        column, row = round(u + distances[d] * nx), round(v + distances[d] * ny)
        inside[d] = 0 <= column < width and 0 <= row < height
        column, row = min(max(column, 0), width - 1), min(max(row, 0), height - 1)
        if mask[row, column] != 0:
            free = False
        for c in range(3):
            colors[d, c] = rgb[row, column, c]
    return free


@inner
def _ends_here(inner_states, outer_states, inner_colors, outer_colors, inside, color, paint, shadowed, shaded, sums):
    """Add the evidence of one place with the surface on the inner side.

    It is seen, ended, covered, goes on, changes, own, changes by light, and held.
    """
    count = len(outer_states)
    bare = is_alike(inner_colors[0, 0], inner_colors[0, 1], inner_colors[0, 2], color)
    own = bare or _is_painted(inner_colors[0], paint) or (shadowed and is_shaded(inner_colors[0], color))
    like = 0
    for d in range(len(outer_colors)):
        if inside[d] and _is_painted(outer_colors[d], paint):
            like += 1
            continue
        if not inside[d] or not is_alike(outer_colors[d, 0], outer_colors[d, 1], outer_colors[d, 2], color):
            continue
        # next to the bare surface the light is known, and a continuation must have the same colour
        if bare and _apart(outer_colors[d], inner_colors[0]) >= _SAME_COLOR * _SAME_COLOR:
            continue
        like += 1
    goes_on = like >= _MOST and _any(outer_states, _ON_FROM, _ON_TO, _ON)
    contrast = 0.0
    for c in range(3):
        beyond = _middle(outer_colors[0, c], outer_colors[1, c], outer_colors[2, c])
        before = _middle(inner_colors[0, c], inner_colors[1, c], inner_colors[2, c])
        contrast += (beyond - before) ** 2
    changes = contrast > _CONTRAST * _CONTRAST and like < len(outer_colors)
    sums[0] += 1.0 if _any(inner_states, 0, _SEEN_WITHIN, _ON) else 0.0
    ended = not _any(outer_states, _ENDED_FROM, count, _ON) and not _any(outer_states, _COVERED_FROM, count, _NEARER)
    sums[1] += 1.0 if ended and _any(outer_states, 0, count, _FARTHER) else 0.0
    sums[2] += 1.0 if _any(outer_states, 0, count, _NEARER) else 0.0
    sums[3] += 0.0 if goes_on else 1.0
    sums[4] += 1.0 if changes and not goes_on else 0.0
    sums[5] += 1.0 if own else 0.0
    sums[6] += 1.0 if changes and not goes_on and shaded else 0.0
    sums[7] += 1.0 if _any(inner_states, 0, _HELD_TO, _ON) else 0.0


@inner
def _is_painted(color, paint):
    """Whether a colour is that of the paint; never if that is not known. A wall may be alike in another light."""
    return len(paint) != 0 and _apart(color, paint) < _SAME_PAINT * _SAME_PAINT


@inner
def _apart(one, two):
    """Squared distance of two colours (3,)."""
    return (one[0] - two[0]) ** 2 + (one[1] - two[1]) ** 2 + (one[2] - two[2]) ** 2


@inner
def _middle(one, two, three):
    """Median of three numbers."""
    return max(min(one, two), min(max(one, two), three))


@inner
def _any(states, first, last, value):
    """Whether one of the states is the requested one."""
    for d in range(first, last):
        if states[d] == value:
            return True
    return False


@kernel("f8[:, ::1](f8[:, ::1], f8[:, ::1], f8[:, ::1], f8)")
def _samples_beyond(samples, pixels, normals, margin):
    """Where samples of the surface (m, 2) [px] lie abreast of lines (n, 4), those within a margin on neither side.

    Returns the fractions that lie against and along the normal, and the size of the surface along the line [px],
    (n, 3).
    """
    found = np.empty((len(pixels), 3))
    for i in range(len(pixels)):
        run_u, run_v = pixels[i, 2] - pixels[i, 0], pixels[i, 3] - pixels[i, 1]
        length = math.hypot(run_u, run_v)
        du, dv = run_u / length, run_v / length
        low, high, against, with_it = np.inf, -np.inf, 0, 0
        for k in range(len(samples)):
            u, v = samples[k, 0] - pixels[i, 0], samples[k, 1] - pixels[i, 1]
            along = u * du + v * dv
            low, high = min(low, along), max(high, along)
            if along <= 0.0 or along >= length:
                continue
            across = u * normals[i, 0] + v * normals[i, 1]
            if across < -margin:
                against += 1
            elif across > margin:
                with_it += 1
        total = max(against + with_it, 1)
        found[i, 0], found[i, 1] = against / total, with_it / total
        found[i, 2] = high - low if high > low else 0.0
    return found
