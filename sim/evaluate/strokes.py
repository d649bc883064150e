"""Painted strokes against their nominal lines, in pattern coordinates (u, v) [m] of `ibvs_qp.pilot.painting.pattern`.

Stroke k belongs on the line v = `BoardGeometry.stroke_place`, counted from the board's edge, independent of the
strokes before it. A stroke's line is the mean of its tip path over pieces along u, of the part on the board in contact;
its band is the cover of a round brush along this line and the line along which it was painted again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.pilot.painting.stroke_map import band_edge
from sim.evaluate.paint_plan import BIN_M, averaged
from sim.evaluate.window import CONTACT_N, board_tip, in_phase, physics_ticks
from sim.flight.trace import Trace
from sim.world.board import BoardGeometry
from sim.world.scene import Scene

#: Length of the ends of a stroke that do not belong to its straight part [m].
CORNER_M = 0.10
#: A stroke may leave the band of the stroke before within this distance of its end [m].
END_M = 0.02


@dataclass(frozen=True, kw_only=True)
class Stroke:
    """One painted stroke; NaN where there is no data."""

    number: int  # from 1
    length_m: float  # painted in contact on the board, along u
    place_error_m: float  # mean of (true tip line - nominal line) over the straight part, + away from the first edge
    overlap_m: float  # least overlap with the band of the stroke before, without its end; < 0 is a gap
    most_overlap_m: float  # largest one
    nominal_overlap_m: float  # that of the scene
    hole_m: float  # longest way along u without contact between two places with it


def nominal_lines(board: BoardGeometry) -> np.ndarray:
    """Place v, first and last u of every stroke in the order of travel, (strokes, 3) [m]."""
    ends = board.stroke_ends
    return np.array([(board.stroke_place(k), *ends[:: 1 if k % 2 else -1]) for k in range(1, board.strokes + 1)])


def on_board(scene: Scene, spots: np.ndarray) -> np.ndarray:
    """Whether board coordinates (along, up) lie on the board, (N,) bool."""
    return np.all((spots >= 0.0) & (spots <= (scene.board.width_m, scene.board.height_m)), axis=1)


def painted_strokes(trace: Trace) -> dict[int, Stroke]:
    """Every stroke that left paint on the board, by number."""
    spots, board = board_tip(trace), BoardGeometry(trace.scene)
    tip, nominal, width = board.to_pattern(spots), nominal_lines(board), trace.scene.paint.brush_width_m
    touching = (trace.push_true > CONTACT_N) & on_board(trace.scene, spots)
    painting, again = touching & in_phase(trace, "paint"), touching & in_phase(trace, "retouch")
    strokes: dict[int, Stroke] = {}
    before: np.ndarray | None = None
    for number, (place, first, last) in enumerate(nominal, start=1):
        path = tip[painting & (trace.row == number)]
        if not len(path):
            before = None
            continue
        second = tip[again & (trace.row == number)]
        filled = second[~np.isin((second[:, 0] // BIN_M), (path[:, 0] // BIN_M))]  # holes of the first pass
        line = averaged(np.concatenate((path, filled)))
        inner, outer = _band(line, second)
        straight = (np.abs(line[:, 0] - first) > CORNER_M) & (np.abs(line[:, 0] - last) > CORNER_M)
        error = line[straight if straight.any() else slice(None), 1] - place
        overlap = _overlap(inner, before, width, first > last) if before is not None else np.array([])
        places = np.sort(np.concatenate((path[:, 0], second[:, 0])))
        strokes[number] = Stroke(
            number=number,
            length_m=float(places[-1] - places[0]),
            hole_m=float(np.diff(places).max(initial=0.0)),
            place_error_m=float(np.mean(error)),
            overlap_m=float(overlap.min()) if len(overlap) else math.nan,
            most_overlap_m=float(overlap.max()) if len(overlap) else math.nan,
            nominal_overlap_m=width - (place - nominal[number - 2, 0]) if number > 1 else math.nan,
        )
        before = outer
    return strokes


def _band(line: np.ndarray, again: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lines of the brush at the inner and the outer side of a stroke's band, of its line and the path painted again."""
    low = high = line[:, 1]
    piece, second = (((u[:, 0] - line[0, 0] + 0.5 * BIN_M) // BIN_M).astype(int) for u in (line, again))
    starts = np.flatnonzero(np.diff(second, prepend=second[:1] - 1)) if len(second) else []
    for visit in np.split(np.arange(len(second)), starts)[1:]:  # each pass over a piece for itself
        v, here = float(np.mean(again[visit, 1])), piece == second[visit[0]]
        low, high = np.where(here, np.minimum(low, v), low), np.where(here, np.maximum(high, v), high)
    return np.column_stack((line[:, 0], low)), np.column_stack((line[:, 0], high))


def _overlap(line: np.ndarray, before: np.ndarray, width: float, backwards: bool) -> np.ndarray:
    """Overlap of the bands of two strokes at every piece of the second, without its last `END_M` [m]."""
    radius, end = 0.5 * width, line[0, 0] if backwards else line[-1, 0]
    inner, outer = band_edge(line[:, 0], line[:, 1], radius, -1), band_edge(before[:, 0], before[:, 1], radius, 1)
    counts = np.abs(line[:, 0] - end) > END_M
    u, v = line[counts, 0], inner[counts]
    beyond = np.maximum(0.0, np.maximum(before[0, 0] - u, u - before[-1, 0]) - radius)  # past its round end
    return width - (v - np.interp(u, before[:, 0], outer)) - beyond


def contact_share(trace: Trace, ticks: np.ndarray) -> float:
    """Fraction of the physics steps of painting within some control ticks (N,) bool that are in contact."""
    inside = ticks[physics_ticks(trace)] & trace.painting_1khz.astype(bool)
    return float(np.mean(trace.contact_1khz[inside] > CONTACT_N)) if inside.any() else math.nan
