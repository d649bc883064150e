"""What a line is: border of the working surface, edge of fresh paint, or something printed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.colors import BOARD, PAINT, SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.plane import PlaneEstimate
from ibvs_qp.vision.refined import RefinedLine
from ibvs_qp.vision.robust import median

#: Distances from the line at which depth is read, nearest first [px at 640]: beyond the holes along an edge, yet
#: not so far that an edge parallel to the border is taken for the border.
_DEPTH_PX = (5.0, 8.0, 12.0)
#: Depth steps below this share of depth are warps of the camera, not edges.
_STEP_MIN = 0.008
#: Share of profiles that must show a colour for a side to have it, and below which it has not.
_HAS, _HAS_NOT = 0.6, 0.35
#: Samples of the surface allowed beyond its border.
_BEYOND = 0.06
#: Profiles over which depth noise is correlated: 20 px at 9 px per profile.
_CORRELATED = 3.0
#: Least share of valid depth readings on a side.
_VALID = 0.4


@dataclass(frozen=True, kw_only=True)
class LineIdentity:
    """What a line was found to be.

    Attributes:
        kind: "board", "paint" or "" if neither.
        surface_side: +1 or -1, the side of the normal on which the (unpainted) surface lies, 0 if unknown.
        borders_plane: Whether depth says that the surface ends there.
        quality: 0..1, how sure that is.
    """

    kind: str = ""
    surface_side: int = 0
    borders_plane: bool = False
    quality: float = 0.1


def identify(
    line: RefinedLine,
    picture: Picture,
    depth: np.ndarray,
    plane: PlaneEstimate | None,
    grid: CoarseGrid,
    colors: SurfaceColors,
    config: LineConfig,
) -> LineIdentity:
    """Tell by colour and depth on both sides of a line what it is."""
    labels = colors.label(line.sides)
    board, paint = (labels == BOARD).mean(axis=1), (labels == PAINT).mean(axis=1)
    steps = [_depth_step(line, picture, depth, plane, side) for side in (-1, 1)]
    gates = [max(_STEP_MIN, config.depth_step_sigmas * sigma) for _, sigma in steps]
    off = [value is not None and abs(value) > gate for (value, _), gate in zip(steps, gates, strict=True)]
    known = [value is not None for value, _ in steps]
    for index, side in enumerate((-1, 1)):
        other = 1 - index
        if paint[other] >= _HAS and board[index] >= _HAS and not off[other]:
            return LineIdentity(kind="paint", surface_side=side, quality=1.0)
    colored = [colors.board is None or board[k] + paint[k] >= _HAS for k in (0, 1)]
    on = [colored[k] and not off[k] for k in (0, 1)]
    for index, side in enumerate((-1, 1)):
        other = 1 - index
        if not on[index] or on[other]:
            continue
        value, gate = steps[other][0], gates[other]
        farther = value is not None and value > gate
        beyond = _share_beyond(line, plane, grid, side)
        if farther and beyond <= _BEYOND:
            return LineIdentity(kind="board", surface_side=side, borders_plane=True, quality=1.0)
        foreign = colors.board is not None and board[other] + paint[other] <= _HAS_NOT
        if foreign and beyond <= _BEYOND and not (known[other] and off[other]):
            return LineIdentity(kind="board", surface_side=side, quality=0.6)
    return LineIdentity()


def _depth_step(
    line: RefinedLine, picture: Picture, depth: np.ndarray, plane: PlaneEstimate | None, side: int
) -> tuple[float | None, float]:
    """How much farther than the surface one side is, share of depth, with its standard deviation; None if unseen."""
    if plane is None:
        return None, 1.0
    height, width = depth.shape
    normal = side * np.array([np.cos(line.theta), np.sin(line.theta)])
    for distance in _DEPTH_PX:
        place = np.round(line.pixels + distance * picture.scale * normal).astype(np.intp)
        inside = (place[:, 0] >= 0) & (place[:, 0] < width) & (place[:, 1] >= 0) & (place[:, 1] < height)
        place = place[inside]
        z = depth[place[:, 1], place[:, 0]].astype(float)
        seen = (z > 0) & np.isfinite(z) & (picture.mask[place[:, 1], place[:, 0]] == 0)
        count = int(np.count_nonzero(seen))
        if count < max(_VALID * len(line.pixels), 5):
            continue
        fx, fy, cx, cy = picture.intrinsics
        x, y = (place[seen, 0] - cx) / fx, (place[seen, 1] - cy) / fy
        a, b, c = plane.inverse_depth
        value = median(z[seen] * (a * x + b * y + c)) - 1.0
        return value, plane.residual_sigma * math.sqrt(_CORRELATED / count)
    return None, 1.0


def _share_beyond(line: RefinedLine, plane: PlaneEstimate | None, grid: CoarseGrid, side: int) -> float:
    """Share of the surface's samples abreast of the segment that lie beyond the line: ~0 at a true border."""
    if plane is None:
        return 0.0
    cos, sin = np.cos(line.theta), np.sin(line.theta)
    points = grid.design[plane.component.ravel()]
    across = side * (points[:, 0] * cos + points[:, 1] * sin - line.rho)
    along = points[:, 1] * cos - points[:, 0] * sin
    ends = line.segment[:, 1] * cos - line.segment[:, 0] * sin
    abreast = (along > ends.min()) & (along < ends.max())
    margin = 1.5 * grid.stride / grid.intrinsics[0]
    beyond, within = int((abreast & (across < -margin)).sum()), int((abreast & (across > margin)).sum())
    return beyond / max(beyond + within, 1)
