"""Output of `ibvs-qp detect`: one JSON line, or a table."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sim.detection.detection import GUIDE_SIDES
from sim.detection.run import FrameResult
from sim.evaluate.table import plain, terminal_table
from sim.report import rundir

if TYPE_CHECKING:
    from rich.table import Table

SCHEMA = 1


def as_json(results: list[FrameResult], method: str) -> str:
    """All frames as one line of JSON; numbers that are not finite become null."""
    return rundir.as_json({"schema": SCHEMA, "frames": [_frame_dict(result, method) for result in results]})


def _frame_dict(result: FrameResult, method: str) -> dict[str, Any]:
    found = result.detection
    return {
        "color": result.entry.color,
        "depth": result.entry.depth or None,
        "method": method,
        "refused": found.refused,
        "plane": None if found.plane is None else _plane_dict(found.plane),
        "candidates": [_line_dict(line) for line in found.candidates],
        "guides": {side: _line_dict(found.guides.get(side)) for side in GUIDE_SIDES},
        "tracked": bool(found.tracked),
        "time_ms": result.time_ms,
    }


def _plane_dict(plane: Any) -> dict[str, Any]:
    """A surface: (A, B, C, D) with D = -1, outward normal, distance [m], inlier ratio, covariance of (A, B, C)."""
    return {
        "abcd": [float(value) for value in plane.abcd],
        "normal": np.asarray(plane.normal, float).tolist(),
        "distance_m": float(plane.distance_m),
        "inlier_share": float(plane.inlier_share),
        "covariance": np.asarray(plane.covariance, float).tolist(),
    }


def _line_dict(line: Any) -> dict[str, Any] | None:
    """A line: end points [px], (rho, theta) normalised, its covariance and its confidence."""
    if line is None:
        return None
    (x1, y1), (x2, y2) = np.asarray(line.pixels, float).tolist()
    return {
        "x1": x1,
        "y1": y1,
        "x2": x2,
        "y2": y2,
        "rho": float(line.rho),
        "theta": float(line.theta),
        "covariance": np.asarray(line.covariance, float).tolist(),
        "score": float(line.score),
        "confidence": float(line.confidence),
        "length_px": float(line.length_px),
        "borders_plane": bool(line.borders_plane),
        "id": int(line.line_id),
    }


def frame_table(results: list[FrameResult]) -> Table:
    """One row per guide: frame, surface, side, position, slope, confidence and time."""
    table = []
    for result in results:
        found = result.detection
        surface = "none" if found.plane is None else f"{found.plane.distance_m:.3f} m"
        lines = {side: line for side in GUIDE_SIDES if (line := found.guides.get(side)) is not None}
        rows = [_guide_row(line, side) for side, line in lines.items()] or [("none", "", "", "")]
        table.append((plain(Path(result.entry.color).stem), surface, *rows[0], f"{result.time_ms:.0f}"))
        table += [("", "", *row, "") for row in rows[1:]]
    headings = ("frame", "surface", "guide", "middle, px", "slope", "conf.", "ms")
    return terminal_table(headings, table, text=("frame", "guide"))


def refusals(results: list[FrameResult]) -> list[str]:
    """One line with the reason for every frame without a surface."""
    lines = (f"{Path(each.entry.color).name}: {each.detection.refused}" for each in results if each.detection.refused)
    return [line if line.isprintable() else repr(line) for line in lines]


def _guide_row(line: Any, side: str) -> tuple[str, str, str, str]:
    """A guide, the middle of its segment, its slope against horizontal or vertical, and its confidence."""
    (x1, y1), (x2, y2) = np.asarray(line.pixels, float).tolist()
    horizontal = side in ("top", "bottom")
    slope = math.degrees(math.atan2(y2 - y1, x2 - x1) if horizontal else math.atan2(x1 - x2, y2 - y1))
    middle = f"{0.5 * (x1 + x2):.1f}, {0.5 * (y1 + y2):.1f}"
    return side, middle, f"{math.remainder(slope, 180.0):+.2f}°", f"{line.confidence:.2f}"
