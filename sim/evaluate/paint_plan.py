"""The nominal polyline of a paint job and its intended band (truth, for metrics and figures only).

Everything is in board coordinates (along, up) [m] of `BoardGeometry`. Row 1 runs parallel to the bottom edge, the
first climb parallel to the left edge, and row k follows the upper edge of row k - 1 as it was painted.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from sim.world.board import BoardGeometry
from sim.world.scene import Scene

#: A painted row is averaged over pieces of this length [m], shorter than any bend that the vehicle can paint.
BIN_M = 0.01


@dataclass(frozen=True, kw_only=True)
class Segment:
    """One row or one climb of the nominal polyline."""

    kind: str  # "row" or "climb"
    row: int  # number of the row, or of the row that the climb leads to
    points: np.ndarray  # corners of the segment in the order of travel, (K, 2) [m]


@dataclass(frozen=True, kw_only=True)
class PaintPlan:
    """Rows and climbs in the order in which they are painted."""

    segments: tuple[Segment, ...]

    @property
    def vertices(self) -> np.ndarray:
        """Start, end, and every corner between a row and a climb, (V, 2) [m]."""
        ends = [segment.points[[0, -1]] for segment in self.segments]
        return np.unique(np.round(np.concatenate(ends), 9), axis=0)

    @property
    def polyline(self) -> np.ndarray:
        """All points from start to end, (K, 2) [m]."""
        return np.concatenate([segment.points for segment in self.segments])

    def near(self, kind: str, row: int) -> list[Segment]:
        """The segment of this kind and row with its neighbours; rows further away must not count as nearest."""
        for index, segment in enumerate(self.segments):
            if (segment.kind, segment.row) == (kind, row):
                return list(self.segments[max(index - 1, 0) : index + 2])
        return []


def nominal_plan(scene: Scene) -> PaintPlan:
    """The polyline of a perfect flight: straight rows, one pitch apart."""
    return plan_as_painted(scene, {})


def plan_as_painted(scene: Scene, painted: dict[int, np.ndarray]) -> PaintPlan:
    """The polyline whose row k follows the upper edge of row k - 1 as painted.

    The tip of row k belongs ``pitch - brush_width / 2`` above that edge, and the edge lies half a brush width above
    the path of the tip. Even rows end where the row below ends. The start of row 1 has no guide, so a touch further
    right than planned lengthens row 1.

    Args:
        scene: The scene flown.
        painted: Tip path of every row painted in contact, (S, 2) each, board coordinates; rows may be missing.

    Returns:
        The plan; rows without a painted path below them are straight.
    """
    paint, board = scene.paint, BoardGeometry(scene)
    left, right = board.row_ends
    right = max(right, _extreme(painted, 1, right))
    segments: list[Segment] = []
    height = np.array([[left, board.row_height(1)], [right, board.row_height(1)]])
    for row in range(1, paint.rows + 1):
        to_left = row % 2 == 1
        if row > 1:
            begin = segments[-1].points[-1]
            if not to_left and row - 1 in painted:
                right = _extreme(painted, row - 1, right)
            edge = _upper_edge(painted.get(row - 1), height, paint.brush_width_m)
            height = edge + np.array([0.0, paint.pitch_m - 0.5 * paint.brush_width_m])
            target = [begin[0], float(np.interp(begin[0], *height.T))]
            segments.append(Segment(kind="climb", row=row, points=np.array([begin, target])))
        segments.append(Segment(kind="row", row=row, points=_row_points(height, left, right, to_left)))
    return PaintPlan(segments=tuple(segments))


def _extreme(painted: dict[int, np.ndarray], row: int, default: float) -> float:
    path = painted.get(row)
    return default if path is None or not len(path) else float(path[:, 0].max())


def _upper_edge(path: np.ndarray | None, planned: np.ndarray, brush_width_m: float) -> np.ndarray:
    """Upper edge of a row, (K, 2) with increasing first column: the tip's path averaged over pieces of `BIN_M`."""
    if path is None or not len(path):
        path = planned
        centres, heights = path[:, 0], path[:, 1]
    else:
        first = path[:, 0].min()
        piece = ((path[:, 0] - first) / BIN_M).astype(int)
        count = np.bincount(piece)
        used = count > 0
        centres = np.bincount(piece, path[:, 0])[used] / count[used]
        heights = np.bincount(piece, path[:, 1])[used] / count[used]
    return np.column_stack((centres, heights + 0.5 * brush_width_m))


def _row_points(height: np.ndarray, left: float, right: float, to_left: bool) -> np.ndarray:
    inside = height[(height[:, 0] > left) & (height[:, 0] < right), 0]
    along = np.concatenate(([left], inside, [right]))
    points = np.column_stack((along, np.interp(along, *height.T)))
    return points[::-1] if to_left else points


def distance_to_polyline(points: np.ndarray, polyline: np.ndarray) -> np.ndarray:
    """Unsigned distance of every point to a polyline.

    Args:
        points: (N, 2) [m].
        polyline: (K, 2) [m], K >= 2.

    Returns:
        (N,) [m].
    """
    best = np.full(len(points), np.inf)
    for begin, end in itertools.pairwise(polyline):
        leg = end - begin
        fraction = np.clip((points - begin) @ leg / max(float(leg @ leg), 1e-18), 0.0, 1.0)
        best = np.minimum(best, np.hypot(*(points - begin - fraction[:, None] * leg).T))
    return best


def band_mask(scene: Scene, plan: PaintPlan, shape: tuple[int, int], px_per_m: float) -> np.ndarray:
    """Pixels of the canvas within half a brush width of the polyline, (H, W) bool.

    Row 0 of the canvas is the top of the board, column 0 its left edge; pixel centres lie half a pixel inside.
    """
    along = (np.arange(shape[1]) + 0.5) / px_per_m
    up = scene.board.height_m - (np.arange(shape[0]) + 0.5) / px_per_m
    pixels = np.stack(np.meshgrid(along, up), axis=-1).reshape(-1, 2)
    mask = np.zeros(len(pixels), bool)
    radius = 0.5 * scene.paint.brush_width_m
    for segment in plan.segments:
        low, high = segment.points.min(axis=0) - radius, segment.points.max(axis=0) + radius
        inside = np.flatnonzero(np.all((pixels >= low) & (pixels <= high), axis=1))
        mask[inside] |= distance_to_polyline(pixels[inside], segment.points) <= radius
    return mask.reshape(shape)
