"""Painted strokes against their nominal lines, in pattern coordinates (u, v) [m].

u runs along the strokes from the board edge at which stroke 1 begins, v across them from the edge at which the pattern
begins. Stroke k belongs on the line v = edge margin + (k - 1) pitch, whatever the strokes before it did.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sim.evaluate.window import CONTACT_N, board_tip, contact_clock, in_phase
from sim.flight.trace import Trace
from sim.world.board import BoardGeometry
from sim.world.scene import Scene

#: Length of the ends of a stroke that do not belong to its straight part [m].
CORNER_M = 0.10
#: A painted stroke is averaged over pieces of this length [m], shorter than any bend that the vehicle can paint.
BIN_M = 0.01
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


@dataclass(frozen=True, kw_only=True)
class _Line:
    """Tip line of a stroke, averaged over pieces along u."""

    u: np.ndarray  # (K,) increasing [m]
    v: np.ndarray  # (K,) [m]


def pattern_coordinates(scene: Scene, spots: np.ndarray) -> np.ndarray:
    """(u, v) of board coordinates (along, up), (N, 2) [m]; rows from the bottom right corner."""
    return np.column_stack((scene.board.width_m - spots[:, 0], spots[:, 1]))


def nominal_lines(scene: Scene) -> np.ndarray:
    """Place v, first and last u of every stroke in the order of travel, (strokes, 3) [m]."""
    board, paint = BoardGeometry(scene), scene.paint
    first, last = (scene.board.width_m - end for end in reversed(board.row_ends))
    return np.array(
        [
            (board.row_height(row), *((first, last) if row % 2 else (last, first)))
            for row in range(1, paint.rows + 1)
        ]
    )  # fmt: skip


def on_board(scene: Scene, spots: np.ndarray) -> np.ndarray:
    """Whether board coordinates (along, up) lie on the board, (N,) bool."""
    return np.all((spots >= 0.0) & (spots <= (scene.board.width_m, scene.board.height_m)), axis=1)


def painted_strokes(trace: Trace) -> dict[int, Stroke]:
    """Every stroke that left paint on the board, by number."""
    spots = board_tip(trace)
    tip, nominal = pattern_coordinates(trace.scene, spots), nominal_lines(trace.scene)
    touching = in_phase(trace, "paint") & (trace.push_true > CONTACT_N) & on_board(trace.scene, spots)
    width = trace.scene.paint.brush_width_m
    strokes: dict[int, Stroke] = {}
    before: _Line | None = None
    for number, (place, first, last) in enumerate(nominal, start=1):
        path = tip[touching & (trace.row == number)]
        if not len(path):
            before = None
            continue
        line = _averaged(path)
        low, high = min(first, last) + CORNER_M, max(first, last) - CORNER_M
        straight = (line.u >= low) & (line.u <= high)
        error = line.v[straight if straight.any() else slice(None)] - place
        overlap = _overlap(line, before, width, backwards=last < first) if before is not None else np.array([])
        strokes[number] = Stroke(
            number=number,
            length_m=float(np.ptp(path[:, 0])),
            place_error_m=float(np.mean(error)),
            overlap_m=float(overlap.min()) if len(overlap) else math.nan,
            most_overlap_m=float(overlap.max()) if len(overlap) else math.nan,
            nominal_overlap_m=width - (place - nominal[number - 2, 0]) if number > 1 else math.nan,
        )
        before = line
    return strokes


def _averaged(path: np.ndarray) -> _Line:
    first = path[:, 0].min()
    piece = ((path[:, 0] - first) / BIN_M).astype(int)
    count = np.bincount(piece)
    u, v = (np.bincount(piece, path[:, axis])[count > 0] / count[count > 0] for axis in (0, 1))
    return _Line(u=u, v=v)


def _overlap(line: _Line, before: _Line, width: float, *, backwards: bool) -> np.ndarray:
    """Overlap of the bands of two strokes at every piece of the second, without its last `END_M` [m]."""
    end = line.u[0] if backwards else line.u[-1]
    inner = np.abs(line.u - end) > END_M
    u, v = line.u[inner], line.v[inner]
    beyond = np.maximum(0.0, np.maximum(before.u[0] - u, u - before.u[-1]) - 0.5 * width)  # past its round end
    return width - (v - np.interp(u, before.u, before.v)) - beyond


def contact_share(trace: Trace, ticks: np.ndarray) -> float:
    """Fraction of the physics steps of painting within some control ticks (N,) bool that are in contact."""
    if not ticks.any():
        return math.nan
    inside = ticks[np.searchsorted(trace.t, contact_clock(trace) + 1e-9, side="right") - 1]
    contact = trace.contact_1khz[inside & trace.painting_1khz.astype(bool)]
    return float(np.mean(contact > CONTACT_N)) if len(contact) else math.nan
