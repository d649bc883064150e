"""How well lines fit as ends of the surface: depth and colour on both sides, and nothing of the surface beyond."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.survey.evidence import ON, SideEvidence, side_evidence
from ibvs_qp.vision.survey.look import SurfaceLook, alike_colors

#: Colours on both sides nearer than this are one [grey levels].
_CONTRAST = 16.0
#: Beside the bare surface, colours nearer than this to its own are the surface's [grey levels].
_SAME_COLOR = 24.0
#: Of the three places beyond a line at which colour is read, this many must be the surface's for it to go on.
_MOST = 2
#: A border that only colour shows counts this much: a step of depth is the better witness.
_COLOR_ONLY = 0.75
#: What depth shows counts this much where colour does not agree.
_DEPTH_ONLY = 0.5
#: Samples of the surface beyond a border count from this distance on [cells], and this share of them rules it out.
_CELLS_BEYOND, _SHARE_BEYOND = 2.0, 0.25
#: Distance from a line at which the surface's samples must lie beside it [cells], and places looked at along it.
_CELLS_BESIDE, _PLACES = 1.5, 16
#: Share of a line beside which they must lie: prints, holes and corners are no samples.
_MOSTLY = 0.75
#: Length that earns half of what a long line earns [px at 640].
_HALF_LENGTH_PX = 12.0
#: A border this long, as a share of the surface's size along it, earns all.
_FULL_SHARE = 0.2


@dataclass(frozen=True)
class Borders:
    """n lines judged as ends of the surface, each with the better of its two sides as the surface's side.

    Attributes:
        side: +1 if the surface lies where the given normal points, -1 if on the other side, (n,).
        depth: 0..1, share of the line along which depth says that the surface ends there, (n,).
        color: 0..1, share along which colour says so, (n,).
        beyond: Share of the surface's samples abreast of the line that lie beyond it, (n,).
        score: 0..1, all of it together with the length, (n,).
    """

    side: np.ndarray
    depth: np.ndarray
    color: np.ndarray
    beyond: np.ndarray
    score: np.ndarray


def judge_borders(
    pixels: np.ndarray, normals: np.ndarray, picture: Picture, depth: np.ndarray, look: SurfaceLook
) -> Borders:
    """Judge lines as ends of the surface.

    Args:
        pixels: Their end points [px], (n, 2, 2).
        normals: Unit vectors across them [px], (n, 2).
        picture: Colour and camera.
        depth: Depth [m], (H, W).
        look: The surface.
    """
    behind, before = (side_evidence(pixels, side * normals, picture, depth, look.plane) for side in (1, -1))
    one, two = (_one_sided(pixels, picture, look, *sides) for sides in ((behind, before), (before, behind)))
    out_one, out_two, size = _beyond(pixels, normals, look)
    length = np.hypot(*(pixels[:, 1] - pixels[:, 0]).T)
    grown = length / (length + _HALF_LENGTH_PX * picture.scale)
    grown = grown * np.sqrt(np.minimum(length / np.maximum(_FULL_SHARE * size, 1.0), 1.0))
    scores = []
    if look.by_light:  # a wall has the surface's depth, its joints the surface's colour
        inside = (_beside(pixels, side * normals, look) for side in (1, -1))
        one, two = ((share * score, *rest) for share, (score, *rest) in zip(inside, (one, two), strict=True))
    for (score, _, _), out in ((one, out_one), (two, out_two)):
        scores.append(score * grown * np.maximum(0.0, 1.0 - out / _SHARE_BEYOND))
    first = scores[0] >= scores[1]
    return Borders(
        side=np.where(first, 1, -1),
        depth=np.where(first, one[1], two[1]),
        color=np.where(first, one[2], two[2]),
        beyond=np.where(first, out_one, out_two),
        score=np.where(first, *scores),
    )


def _one_sided(
    pixels: np.ndarray, picture: Picture, look: SurfaceLook, inner: SideEvidence, outer: SideEvidence
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Score without length, by depth, by colour, of lines with the surface on the side of `inner`, (n,) each."""
    # the nearest colours: the joints of a wall just beyond the border have its colour a little farther in
    own = alike_colors(inner.colors[:, 0], look.color)
    like_out = alike_colors(outer.colors, look.color) & outer.inside
    # beside the bare surface the light is known, and what goes on must have its very colour
    step = outer.colors - inner.colors[:, :1]
    like_out &= ~own[:, None] | (np.vecdot(step, step) < _SAME_COLOR**2)
    goes_on = (outer.depth[:, 1:4] == ON).any(axis=1) & (like_out.sum(axis=1) >= _MOST)
    step = _middle(outer.colors) - _middle(inner.colors)
    changes = (np.vecdot(step, step) > _CONTRAST**2) & ~like_out.all(axis=1)
    belongs = own.mean(axis=1)
    by_depth = outer.end_share * (~goes_on).mean(axis=1)
    by_color = (changes & ~goes_on).mean(axis=1) * belongs
    ends = np.maximum(by_depth * (_DEPTH_ONLY + (1.0 - _DEPTH_ONLY) * by_color), _COLOR_ONLY * by_color)
    return inner.surface_share * ends * (1.0 - outer.covered_share), by_depth, by_color


def _beside(pixels: np.ndarray, normals: np.ndarray, look: SurfaceLook) -> np.ndarray:
    """How much of the lines has the surface's samples beside it, on the side of the normals, 0..1, (n,)."""
    grid = look.grid
    share = np.linspace(0.05, 0.95, _PLACES)[:, None]
    places = pixels[:, :1] + share * (pixels[:, 1:] - pixels[:, :1]) + _CELLS_BESIDE * grid.stride * normals[:, None]
    cells = np.rint((places - grid.offset) / grid.stride).astype(np.intp)
    rows, columns = np.clip(cells[..., 1], 0, grid.shape[0] - 1), np.clip(cells[..., 0], 0, grid.shape[1] - 1)
    return np.minimum(look.cells[rows, columns].mean(axis=1) / _MOSTLY, 1.0)


def _middle(colors: np.ndarray) -> np.ndarray:
    """Median over the three distances of colours (n, 3, K, 3), (n, K, 3)."""
    one, two, three = colors[:, 0], colors[:, 1], colors[:, 2]
    return np.maximum(np.minimum(one, two), np.minimum(np.maximum(one, two), three))


def _beyond(pixels: np.ndarray, normals: np.ndarray, look: SurfaceLook) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shares of the surface's samples abreast of lines that lie against and along the normals; its size along them."""
    grid = look.grid
    rows, columns = np.nonzero(look.colored)
    places = np.column_stack((columns, rows)) * float(grid.stride) + grid.offset
    run = pixels[:, 1] - pixels[:, 0]
    length = np.hypot(*run.T)
    along = places @ (run / length[:, None]).T - np.vecdot(pixels[:, 0], run) / length
    across = places @ normals.T - np.vecdot(pixels[:, 0], normals)
    abreast = (along > 0.0) & (along < length)
    margin = _CELLS_BEYOND * grid.stride
    against = np.count_nonzero(abreast & (across < -margin), axis=0)
    with_it = np.count_nonzero(abreast & (across > margin), axis=0)
    total = np.maximum(against + with_it, 1)
    size = np.ptp(along, axis=0) if len(places) else np.zeros(len(pixels))
    return against / total, with_it / total, size
