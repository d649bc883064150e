"""What depth and colour say on both sides of lines: where the surface ends, and where it goes on."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.kernels.beside import place_along
from ibvs_qp.vision.kernels.compile import inner, kernel

#: What a depth reading says.
UNSEEN, ON, FARTHER, NEARER = 0, 1, 2, 3
#: Distances within which the surface must be seen on its own side, beyond which it must not be, and within which it
#: goes on, as places in the list of distances.
_SEEN_WITHIN, _ENDED_FROM, _ON_FROM, _ON_TO, _COVERED_FROM = 5, 5, 1, 4, 2
#: Colours on both sides nearer than this are one; beside the bare surface, what goes on is as near to it [grey levels].
_CONTRAST, _SAME_COLOR = 16.0, 24.0
#: Colours this near to the paint's are paint: less than the gate of the labels, for nothing else tells [grey levels].
_SAME_PAINT = 30.0
#: Of the places beyond a line at which colour is read, this many must be the surface's for it to go on.
_MOST = 2
#: A border that only colour shows counts this much, and what depth shows where colour does not agree.
_COLOR_ONLY, _DEPTH_ONLY = 0.75, 0.5
#: A colour is the surface's if it is its colour in a light this much weaker or stronger, up to this share of the
#: colour's size and this distance [grey levels].
_DIMMER, _BRIGHTER, _CHROMA, _GREY = 0.68, 1.4, 0.10, 14.0
#: Least share of the places along a line that nothing hides.
_LEAST_SHARE = 0.15
#: Places along a line at which samples are looked for beside it, and share of it left out at either end.
_PLACES, _MARGIN = 16, 0.05
#: Columns of the evidence of one side: score, by depth, by colour, share beside the surface.
EVIDENCE = 4


@inner
def is_alike(red, green, blue, color):
    """Whether a colour is the colour (3,) in some light."""
    size = max(math.sqrt(color[0] * color[0] + color[1] * color[1] + color[2] * color[2]), 1.0)
    light = (red * color[0] + green * color[1] + blue * color[2]) / (size * size)
    square = red * red + green * green + blue * blue
    offset = max(square - (light * size) ** 2, 0.0)
    gate = _CHROMA * size + _GREY
    if light > _DIMMER and light < _BRIGHTER and offset < gate * gate:
        return True
    away = (light - 1.0) * size
    return offset + away * away < _GREY * _GREY


@inner
def _is_painted(pixel, paint):
    """Whether a colour is that of the paint; never if that is not known. A wall may be alike in another light."""
    if len(paint) == 0:
        return False
    away = (pixel[0] - paint[0]) ** 2 + (pixel[1] - paint[1]) ** 2 + (pixel[2] - paint[2]) ** 2
    return away < _SAME_PAINT * _SAME_PAINT


@inner
def _middle(one, two, three):
    """Median of three numbers."""
    return max(min(one, two), min(max(one, two), three))


@inner
def _depth_at(depth, mask, u, v, plane, gate):
    """What the depth at a pixel says; ``plane`` is 1/Z over pixels."""
    if u < 0 or v < 0 or u >= depth.shape[1] or v >= depth.shape[0] or mask[v, u] != 0:
        return UNSEEN
    z = np.float64(depth[v, u])
    if not (z > 0.0 and z < np.inf):
        return UNSEEN
    relative = z * (plane[0] * u + plane[1] * v + plane[2]) - 1.0
    if abs(relative) <= gate:
        return ON
    return FARTHER if relative > 0.0 else NEARER


@inner
def _read_side(rgb, depth, mask, u, v, nx, ny, depth_px, color_px, plane, gate, states, colors, inside):
    """Depth and colour at growing distances from a place; whether nothing hides the nearest colour."""
    for d in range(len(depth_px)):
        states[d] = _depth_at(depth, mask, round(u + depth_px[d] * nx), round(v + depth_px[d] * ny), plane, gate)
    height, width = mask.shape
    free = True
    for d in range(len(color_px)):
        column, row = round(u + color_px[d] * nx), round(v + color_px[d] * ny)
        inside[d] = 0 <= column < width and 0 <= row < height
        column, row = min(max(column, 0), width - 1), min(max(row, 0), height - 1)
        if mask[row, column] != 0:
            free = False
        for c in range(3):
            colors[d, c] = rgb[row, column, c]
    return free


@inner
def _any(states, first, last, wanted):
    """Whether one of the states is the wanted one."""
    for d in range(first, last):
        if states[d] == wanted:
            return True
    return False


@inner
def _ends_here(inner_states, outer_states, inner_colors, outer_colors, inside, color, paint, sums):
    """Add what one place says with the surface on the inner side: seen, ended, covered, goes on, changes, own."""
    count = len(outer_states)
    bare = is_alike(inner_colors[0, 0], inner_colors[0, 1], inner_colors[0, 2], color)
    own = bare or _is_painted(inner_colors[0], paint)
    like = 0
    for d in range(len(outer_colors)):
        if inside[d] and _is_painted(outer_colors[d], paint):
            like += 1
            continue
        if not inside[d] or not is_alike(outer_colors[d, 0], outer_colors[d, 1], outer_colors[d, 2], color):
            continue
        if bare:  # beside the bare surface the light is known, and what goes on must have its very colour
            apart = 0.0
            for c in range(3):
                apart += (outer_colors[d, c] - inner_colors[0, c]) ** 2
            if apart >= _SAME_COLOR * _SAME_COLOR:
                continue
        like += 1
    goes_on = like >= _MOST and _any(outer_states, _ON_FROM, _ON_TO, ON)
    contrast = 0.0
    for c in range(3):
        beyond = _middle(outer_colors[0, c], outer_colors[1, c], outer_colors[2, c])
        before = _middle(inner_colors[0, c], inner_colors[1, c], inner_colors[2, c])
        contrast += (beyond - before) ** 2
    changes = contrast > _CONTRAST * _CONTRAST and like < len(outer_colors)
    sums[0] += 1.0 if _any(inner_states, 0, _SEEN_WITHIN, ON) else 0.0
    ended = not _any(outer_states, _ENDED_FROM, count, ON) and not _any(outer_states, _COVERED_FROM, count, NEARER)
    sums[1] += 1.0 if ended and _any(outer_states, 0, count, FARTHER) else 0.0
    sums[2] += 1.0 if _any(outer_states, 0, count, NEARER) else 0.0
    sums[3] += 0.0 if goes_on else 1.0
    sums[4] += 1.0 if changes and not goes_on else 0.0
    sums[5] += 1.0 if own else 0.0


@inner
def _beside(cells, pixels, nx, ny, distance, stride, offset):
    """Share of the places along a line beside which the surface's samples lie."""
    count = 0
    for k in range(_PLACES):
        u, v = place_along(pixels, k, _PLACES, _MARGIN, distance * nx, distance * ny)
        row, column = round((v - offset) / stride), round((u - offset) / stride)
        row, column = min(max(row, 0), cells.shape[0] - 1), min(max(column, 0), cells.shape[1] - 1)
        count += cells[row, column] != 0
    return count / _PLACES


@kernel(
    "void(u1[:, :, ::1], f4[:, ::1], u1[:, ::1], f8[:, ::1], f8[:, ::1], f8[::1], f8[::1], f8[::1], f8, f8[::1],"
    " f8[::1], u1[:, ::1], f8, f8, f8, i8, f8[:, :, ::1])"
)
def border_evidence(
    rgb,
    depth,
    mask,
    pixels,
    normals,
    depth_px,
    color_px,
    plane,
    gate,
    color,
    paint,
    cells,
    distance,
    stride,
    offset,
    places,
    evidence,
):
    """Evidence that the surface ends at lines, with the surface along their normals, and against them.

    Args:
        rgb: Picture, (H, W, 3).
        depth: Depth [m], (H, W).
        mask: Non-zero where the vehicle hides the view, (H, W).
        pixels: Ends u1, v1, u2, v2 of the lines [px], (n, 4).
        normals: Unit vectors across them [px], (n, 2).
        depth_px: Distances at which depth is read [px].
        color_px: Distances at which colour is read [px], (3,).
        plane: The surface over pixels, 1/Z = p u + q v + r, (3,).
        gate: Share of depth within which a reading is on it.
        color: Its colour, (3,).
        paint: Colour of the paint on it, (3,), or empty if unknown.
        cells: Its samples, (rows, columns).
        distance: Distance from a line at which these must lie beside it [px].
        stride: Distance of the samples [px].
        offset: Place of the first [px].
        places: Places looked at along a line.
        evidence: Receives score, share by depth, share by colour and share beside the samples, (n, 2, 4).
    """
    states = np.empty((2, len(depth_px)), np.int64)
    colors, inside = np.empty((2, 3, 3)), np.empty((2, 3), np.bool_)
    sums = np.empty((2, 6))
    for i in range(len(pixels)):
        sums[:] = 0.0
        count = 0
        nx, ny = normals[i, 0], normals[i, 1]
        for k in range(places):
            share = (k + 0.5) / places
            u = pixels[i, 0] + share * (pixels[i, 2] - pixels[i, 0])
            v = pixels[i, 1] + share * (pixels[i, 3] - pixels[i, 1])
            free = True
            for side in range(2):
                sign = 1.0 if side == 0 else -1.0
                free &= _read_side(
                    rgb,
                    depth,
                    mask,
                    u,
                    v,
                    sign * nx,
                    sign * ny,
                    depth_px,
                    color_px,
                    plane,
                    gate,
                    states[side],
                    colors[side],
                    inside[side],
                )
            if not free:
                continue
            count += 1
            for side in range(2):
                other = 1 - side
                _ends_here(
                    states[side], states[other], colors[side], colors[other], inside[other], color, paint, sums[side]
                )
        for side in range(2):
            sign = 1.0 if side == 0 else -1.0
            evidence[i, side, 3] = _beside(cells, pixels[i], sign * nx, sign * ny, distance, stride, offset)
            if count < _LEAST_SHARE * places:
                evidence[i, side, 0] = evidence[i, side, 1] = evidence[i, side, 2] = 0.0
                continue
            seen, ended, covered, stops, changes, own = sums[side] / count
            by_depth, by_color = ended * stops, changes * own
            ends = max(by_depth * (_DEPTH_ONLY + (1.0 - _DEPTH_ONLY) * by_color), _COLOR_ONLY * by_color)
            evidence[i, side, 0] = seen * ends * (1.0 - covered)
            evidence[i, side, 1] = by_depth
            evidence[i, side, 2] = by_color


@kernel("void(f8[:, ::1], f8[:, ::1], f8[:, ::1], f8, f8[:, ::1])")
def samples_beyond(places, pixels, normals, margin, found):
    """Where samples of the surface lie abreast of lines.

    Args:
        places: The samples [px], (m, 2).
        pixels: Ends of the lines [px], (n, 4).
        normals: Unit vectors across them, (n, 2).
        margin: Samples nearer to a line than this lie on neither side [px].
        found: Receives the shares that lie against and along the normal, and the size of the surface along the line
            [px], (n, 3).
    """
    for i in range(len(pixels)):
        run_u, run_v = pixels[i, 2] - pixels[i, 0], pixels[i, 3] - pixels[i, 1]
        length = math.hypot(run_u, run_v)
        du, dv = run_u / length, run_v / length
        low, high, against, with_it = np.inf, -np.inf, 0, 0
        for k in range(len(places)):
            u, v = places[k, 0] - pixels[i, 0], places[k, 1] - pixels[i, 1]
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


@kernel("void(f8[:, ::1], f8[::1], u1[::1])")
def alike(colors, color, found):
    """Whether each of n colours (n, 3) is the colour (3,) in some light; ``found`` receives 0 or 1, (n,)."""
    for k in range(len(colors)):
        found[k] = is_alike(colors[k, 0], colors[k, 1], colors[k, 2], color)
