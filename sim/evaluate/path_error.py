"""Distance of the true tip to the nominal polyline at every control tick."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.evaluate.paint_plan import PaintPlan, distance_to_polyline, plan_as_painted
from sim.evaluate.window import CONTACT_N, board_tip, in_phase
from sim.flight.trace import Trace
from sim.world.board import BoardGeometry

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
