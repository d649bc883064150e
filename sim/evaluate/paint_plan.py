"""The nominal polyline of a paint job and its intended band (truth, for metrics and figures only).

Plans are in board coordinates (along, up) [m] of `BoardGeometry` and computed in pattern coordinates (u, v). Stroke 1
runs parallel to its board edge, the first climb parallel to the edge at which stroke 1 ends, and stroke k follows the
outer edge of stroke k - 1 as it was painted. Strokes of any direction are called rows.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from sim.evaluate.window import CONTACT_N, board_tip, in_phase
from sim.flight.trace import Trace
from sim.world.board import BoardGeometry
from sim.world.scene import Scene

#: A painted stroke is averaged over pieces of this length [m], shorter than any bend that the vehicle can paint.
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
    """The polyline of a perfect flight: straight strokes at their nominal places."""
    return plan_as_painted(scene, {})


def plan_as_painted(scene: Scene, painted: dict[int, np.ndarray]) -> PaintPlan:
    """The polyline whose stroke k follows the outer edge of stroke k - 1 as painted.

    That edge lies half a brush width beyond the path of the tip, so stroke k belongs one pitch beyond that path. Even
    strokes end where the one before begins. The start of stroke 1 has no guide, so a touch further outside than
    planned lengthens stroke 1.

    Args:
        scene: The scene flown.
        painted: Tip path of every stroke painted in contact, (S, 2) each, board coordinates; strokes may be missing.

    Returns:
        The plan; strokes without a painted path before them are straight.
    """
    board = BoardGeometry(scene)
    paths = {stroke: board.to_pattern(path) for stroke, path in painted.items() if len(path)}
    begin, end = board.stroke_ends
    begin = min(begin, _begin(paths, 1, begin))
    segments: list[Segment] = []
    line = np.array([[begin, board.stroke_place(1)], [end, board.stroke_place(1)]])
    for stroke in range(1, board.strokes + 1):
        if stroke > 1:
            if stroke % 2 == 0:
                begin = _begin(paths, stroke - 1, begin)
            before = averaged(paths[stroke - 1]) if stroke - 1 in paths else line
            pitch = board.stroke_place(stroke) - board.stroke_place(stroke - 1)
            line = before + np.array([0.0, pitch])
            corner = segments[-1].points[-1]
            climb = np.array([corner, [corner[0], float(np.interp(corner[0], *line.T))]])
            segments.append(Segment(kind="climb", row=stroke, points=climb))
        segments.append(Segment(kind="row", row=stroke, points=_points(line, begin, end, stroke % 2 == 0)))
    return PaintPlan(segments=tuple(replace(each, points=board.from_pattern(each.points)) for each in segments))


def _begin(paths: dict[int, np.ndarray], stroke: int, default: float) -> float:
    """Painted point of a stroke nearest to the edge at which stroke 1 begins, u [m]."""
    return float(paths[stroke][:, 0].min()) if stroke in paths else default


def averaged(path: np.ndarray) -> np.ndarray:
    """Line of a tip path (u, v): means over pieces of `BIN_M` along u, (K, 2) with increasing u [m]."""
    piece = ((path[:, 0] - path[:, 0].min()) / BIN_M).astype(int)
    count = np.bincount(piece)
    used = count > 0
    return np.column_stack([np.bincount(piece, path[:, axis])[used] / count[used] for axis in (0, 1)])


def _points(line: np.ndarray, begin: float, end: float, backwards: bool) -> np.ndarray:
    """Points of a stroke between its ends u, in the order of travel, (K, 2) [m]."""
    inside = line[(line[:, 0] > begin) & (line[:, 0] < end), 0]
    along = np.concatenate(([begin], inside, [end]))
    points = np.column_stack((along, np.interp(along, *line.T)))
    return points[::-1] if backwards else points


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


#: Distance from a vertex of the polyline within which a sample belongs to the corner [m].
CORNER_M = 0.10
#: Phases that paint, and the kind of segment that each one follows.
PAINTING_PHASES = {"paint": "row", "climb": "climb"}


@dataclass(frozen=True, kw_only=True)
class PathError:
    """Path error of every control tick; NaN or False outside painting."""

    plan: PaintPlan  # the reference polyline
    tip: np.ndarray  # tip in board coordinates (along, up), (N, 2) [m]
    painting: np.ndarray  # the vehicle paints a row or a climb, (N,) bool
    corner: np.ndarray  # painting within 0.10 m of a vertex, (N,) bool
    distance: np.ndarray  # unsigned distance to the polyline, (N,) [m]
    height: np.ndarray  # tip beyond (+) or before (-) its stroke, across it, in phase ``paint``, (N,) [m]

    @property
    def travelled(self) -> np.ndarray:
        """Distance painted so far at every painting tick [m], (painting ticks,)."""
        steps = np.linalg.norm(np.diff(self.tip[self.painting], axis=0), axis=1)
        return np.concatenate(([0.0], np.cumsum(steps)))


def painted_rows(trace: Trace, tip: np.ndarray) -> dict[int, np.ndarray]:
    """Tip path of every row while painting in contact, board coordinates, (S, 2) each [m]."""
    touching = in_phase(trace, "paint") & (trace.push_true > CONTACT_N)
    rows = {int(row) for row in np.unique(trace.row[touching]) if row > 0}
    return {row: tip[touching & (trace.row == row)] for row in sorted(rows)}


def path_error(trace: Trace) -> PathError:
    """Compare the true tip with the nominal polyline of its scene.

    The error is the distance to the nearest point of the current segment or of its neighbours. It contains no time
    lag, and another row is never the nearest segment.
    """
    tip, board = board_tip(trace), BoardGeometry(trace.scene)
    uv = board.to_pattern(tip)
    plan = plan_as_painted(trace.scene, painted_rows(trace, tip))
    painting = np.zeros(len(tip), bool)
    distance, height = np.full(len(tip), np.nan), np.full(len(tip), np.nan)
    if trace.legs is not None:  # its path is not the scene's
        painting, plan = in_phase(trace, *PAINTING_PHASES), PaintPlan(segments=())
    for segment in plan.segments:
        phases = [phase for phase, kind in PAINTING_PHASES.items() if kind == segment.kind]
        ticks = np.flatnonzero(in_phase(trace, *phases) & (trace.row == segment.row))
        near = plan.near(segment.kind, segment.row)
        distance[ticks] = np.min([distance_to_polyline(tip[ticks], other.points) for other in near], axis=0)
        painting[ticks] = True
        if segment.kind == "row":
            line = board.to_pattern(segment.points)
            line = line[np.argsort(line[:, 0])]
            height[ticks] = uv[ticks, 1] - np.interp(uv[ticks, 0], *line.T)
    vertices = plan.vertices if plan.segments else np.full((1, 2), np.inf)
    to_vertex = np.min(np.linalg.norm(tip[:, None] - vertices[None], axis=2), axis=1)
    return PathError(
        plan=plan,
        tip=tip,
        painting=painting,
        corner=painting & (to_vertex <= CORNER_M),
        distance=distance,
        height=height,
    )
