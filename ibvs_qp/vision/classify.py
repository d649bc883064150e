"""What a line is: border of the working surface, edge of fresh paint, or something printed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.colors import BOARD, PAINT, SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.native import native
from ibvs_qp.vision.native_sides import Evidence, look_natively
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


def identify_lines(
    lines: list[RefinedLine],
    picture: Picture,
    depth: np.ndarray,
    plane: PlaneEstimate | None,
    grid: CoarseGrid,
    colors: SurfaceColors,
    config: LineConfig,
) -> list[LineIdentity]:
    """Tell by colour and depth on both sides of each line what it is."""
    if not lines:
        return []
    library = native()
    if library is None:
        shown = look_with_numpy(lines, picture, depth, plane, grid, colors)
    else:
        shown = look_natively(
            library,
            lines,
            picture,
            depth,
            plane,
            grid,
            colors,
            distances_px=tuple(distance * picture.scale for distance in _DEPTH_PX),
            valid=_VALID,
            correlated=_CORRELATED,
            margin=_margin(grid),
        )
    return [_identify(evidence, colors, config) for evidence in shown]


def _identify(shown: Evidence, colors: SurfaceColors, config: LineConfig) -> LineIdentity:
    """What a line is by what its two sides show."""
    board, paint, steps = shown.board, shown.paint, shown.steps
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
        foreign = colors.board is not None and board[other] + paint[other] <= _HAS_NOT
        foreign = foreign and not (known[other] and off[other])
        # hardly any of the surface lies beyond a true border
        beyond = shown.samples[other] / max(sum(shown.samples), 1)
        if (farther or foreign) and beyond <= _BEYOND:
            quality = 1.0 if farther else 0.6
            return LineIdentity(kind="board", surface_side=side, borders_plane=farther, quality=quality)
    return LineIdentity()


def look_with_numpy(
    lines: list[RefinedLine],
    picture: Picture,
    depth: np.ndarray,
    plane: PlaneEstimate | None,
    grid: CoarseGrid,
    colors: SurfaceColors,
) -> list[Evidence]:
    """Both sides of every line where there is no machine code, and to say what it computes."""
    labels = np.split(
        colors.label(
            np.concatenate([line.sides for line in lines], axis=1),
            colors.levels_at(*np.concatenate([line.pixels for line in lines]).T),
        ),
        np.cumsum([len(line.pixels) for line in lines[:-1]]),
        axis=1,
    )
    steps = _depth_steps(lines, picture, depth, plane)
    surface = None if plane is None else grid.design[np.flatnonzero(plane.component)]
    found = []
    for line, label, step in zip(lines, labels, steps, strict=True):
        count = max(label.shape[1], 1)
        board, paint = ((np.count_nonzero(label == kind, axis=1) / count).tolist() for kind in (BOARD, PAINT))
        found.append(Evidence(board, paint, step, _samples_beside(line, surface, grid)))
    return found


def _depth_steps(
    lines: list[RefinedLine], picture: Picture, depth: np.ndarray, plane: PlaneEstimate | None
) -> list[list[tuple[float | None, float]]]:
    """How much farther than the surface either side of each line is, share of depth, with its standard deviation.

    None where too few readings tell; the nearest of a few distances that tells enough is taken.
    """
    found: list[list[tuple[float | None, float]]] = [[(None, 1.0), (None, 1.0)] for _ in lines]
    if plane is None:
        return found
    missing = [(k, index) for k in range(len(lines)) for index in (0, 1)]
    for distance in _DEPTH_PX:
        offsets = [
            (
                (-1, 1)[index] * distance * picture.scale * math.cos(lines[k].theta),
                (-1, 1)[index] * distance * picture.scale * math.sin(lines[k].theta),
            )
            for k, index in missing
        ]
        places = np.concatenate([lines[k].pixels + offset for (k, _), offset in zip(missing, offsets, strict=True)])
        relative = _relative_depths(places, picture, depth, plane)
        start, left = 0, []
        for k, index in missing:
            total = len(lines[k].pixels)
            part = relative[start : start + total]
            start += total
            part = part[np.isfinite(part)]
            if len(part) < max(_VALID * total, 5):
                left.append((k, index))
            else:
                found[k][index] = median(part) - 1.0, plane.residual_sigma * math.sqrt(_CORRELATED / len(part))
        missing = left
        if not missing:
            break
    return found


def _relative_depths(places: np.ndarray, picture: Picture, depth: np.ndarray, plane: PlaneEstimate) -> np.ndarray:
    """Depth at places (n, 2) [px] as a share of the surface's there, (n,); NaN where nothing is seen."""
    (height, width), (fx, fy, cx, cy) = depth.shape, picture.intrinsics
    u, v = np.rint(places).T
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    flat = (np.where(inside, v, 0.0) * width + np.where(inside, u, 0.0)).astype(np.intp)
    z = depth.reshape(-1).take(flat)
    seen = inside & (z > 0) & (z < np.inf) & (picture.mask.reshape(-1).take(flat) == 0)  # false for NaN too
    a, b, c = plane.inverse_depth.tolist()
    surface = (a / fx) * u + (b / fy) * v + (c - a * cx / fx - b * cy / fy)
    return np.where(seen, z * surface, np.nan)


def _samples_beside(line: RefinedLine, points: np.ndarray | None, grid: CoarseGrid) -> list[int]:
    """The surface's samples (n, 3) abreast of the segment that lie clearly before and clearly behind the line."""
    if points is None:
        return [0, 0]
    cos, sin = math.cos(line.theta), math.sin(line.theta)
    across = points[:, 0] * cos + points[:, 1] * sin - line.rho
    along = points[:, 1] * cos - points[:, 0] * sin
    ends = line.segment[:, 1] * cos - line.segment[:, 0] * sin
    abreast, margin = (along > ends.min()) & (along < ends.max()), _margin(grid)
    return [int(np.count_nonzero(abreast & part)) for part in (across < -margin, across > margin)]


def _margin(grid: CoarseGrid) -> float:
    """How far from a line samples of the surface count, normalised."""
    return 1.5 * grid.stride / grid.intrinsics[0]
