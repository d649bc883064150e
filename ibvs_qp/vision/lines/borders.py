"""How well lines fit as ends of the surface: depth and colour on both sides, and nothing of the surface beyond."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.kernels.borders import EVIDENCE, border_evidence, samples_beyond
from ibvs_qp.vision.picture.picture import Picture
from ibvs_qp.vision.surface.region import SurfaceRegion, depth_gate

#: Distances from the line at which depth is read [px at 640]. A depth camera moves a step by up to 20 px.
_DEPTH_PX = np.array((3.0, 5.0, 8.0, 12.0, 18.0, 26.0, 36.0))
#: Distances at which colour is read [px at 640]: beyond blur, then farther.
_COLOR_PX = np.array((4.0, 7.0, 11.0))
#: Samples of the surface beyond a border count from this distance on [cells], and this share of them rules it out.
_CELLS_BEYOND, _SHARE_BEYOND = 2.0, 0.25
#: Distance from a line at which the surface's samples must lie beside it [cells], and the share of the line beside
#: which they must: prints, holes and corners are no samples.
_CELLS_BESIDE, _MOSTLY = 1.5, 0.75
#: Places looked at along a line.
PLACES = 32
#: Length that earns half of what a long line earns [px at 640].
_HALF_LENGTH_PX = 12.0
#: A border this long, as a share of the surface's size along it, earns all.
_FULL_SHARE = 0.2


@dataclass(frozen=True)
class Borders:
    """n lines scored as ends of the surface, each with the better of its two sides as the surface's side.

    Attributes:
        side: +1 if the surface lies where the given normal points, -1 if on the other side, (n,).
        depth: 0..1, share of the line along which depth says that the surface ends there, (n,).
        color: 0..1, share along which colour says so, (n,).
        score: 0..1, all of it together with the length, (n,).
    """

    side: np.ndarray
    depth: np.ndarray
    color: np.ndarray
    score: np.ndarray


def score_borders(
    pixels: np.ndarray,
    normals: np.ndarray,
    picture: Picture,
    depth: np.ndarray,
    region: SurfaceRegion,
    paint: np.ndarray | None,
    places: int = PLACES,
) -> Borders:
    """Score lines as ends of the surface.

    Args:
        pixels: Their end points [px], (n, 2, 2).
        normals: Unit vectors across them [px], (n, 2).
        picture: Colour, mask and camera.
        depth: Depth [m], (H, W).
        region: The surface.
        paint: Colour of the paint on it, RGB (3,), or None if unknown.
        places: Places looked at along each line.
    """
    grid, ends, normals = region.grid, np.ascontiguousarray(pixels.reshape(-1, 4)), np.ascontiguousarray(normals)
    (a, b, c), (fx, fy, cx, cy) = region.plane.inverse_depth.tolist(), picture.intrinsics
    evidence, beyond = np.empty((len(ends), 2, EVIDENCE)), np.empty((len(ends), 3))
    border_evidence(
        picture.rgb,
        np.ascontiguousarray(depth, np.float32),
        picture.mask,
        ends,
        normals,
        picture.scale * _DEPTH_PX,
        picture.scale * _COLOR_PX,
        np.array((a / fx, b / fy, c - a * cx / fx - b * cy / fy)),
        depth_gate(region.plane),
        np.ascontiguousarray(region.color, float),
        np.empty(0) if paint is None else np.ascontiguousarray(paint, float),
        region.cells.view(np.uint8),
        _CELLS_BESIDE * grid.stride,
        float(grid.stride),
        float(grid.offset),
        places,
        evidence,
    )
    rows, columns = np.nonzero(region.colored)
    samples = np.column_stack((columns, rows)) * float(grid.stride) + grid.offset
    samples_beyond(samples, ends, normals, _CELLS_BEYOND * grid.stride, beyond)
    length = np.hypot(ends[:, 2] - ends[:, 0], ends[:, 3] - ends[:, 1])
    grown = length / (length + _HALF_LENGTH_PX * picture.scale)
    grown = grown * np.sqrt(np.minimum(length / np.maximum(_FULL_SHARE * beyond[:, 2], 1.0), 1.0))
    scores = evidence[:, :, 0] * grown[:, None] * np.maximum(0.0, 1.0 - beyond[:, :2] / _SHARE_BEYOND)
    if region.by_color:  # a wall has the surface's depth, its joints the surface's colour
        scores = scores * np.minimum(evidence[:, :, 3] / _MOSTLY, 1.0)
    best, each = np.where(scores[:, 0] >= scores[:, 1], 0, 1), np.arange(len(ends))
    return Borders(
        side=1 - 2 * best,
        depth=evidence[each, best, 1],
        color=evidence[each, best, 2],
        score=scores[each, best],
    )
