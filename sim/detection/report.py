"""What `ibvs-qp detect` prints: one JSON line, or a table for people."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ibvs_qp.vision.survey.detection import GUIDE_SIDES
from sim.detection.run import SeenFrame

if TYPE_CHECKING:
    from rich.table import Table

SCHEMA = 1


def as_json(frames: list[SeenFrame], method: str) -> str:
    """All frames as one line of JSON; what is not finite becomes null."""
    content = {"schema": SCHEMA, "frames": [frame_dict(frame, method) for frame in frames]}
    return json.dumps(_finite(content), allow_nan=False)


def frame_dict(seen: SeenFrame, method: str) -> dict[str, Any]:
    """One frame as plain values."""
    result = seen.result
    return {
        "color": seen.entry.color,
        "depth": seen.entry.depth or None,
        "method": method,
        "refused": result.refused,
        "plane": None if result.plane is None else plane_dict(result.plane),
        "candidates": [line_dict(line) for line in result.candidates],
        "guides": {side: _guide(result.guides.get(side)) for side in GUIDE_SIDES},
        "tracked": bool(result.tracked),
        "time_ms": seen.time_ms,
    }


def plane_dict(plane: Any) -> dict[str, Any]:
    """A surface: (A, B, C, D) with D = -1, outward normal, distance [m], share of inliers, covariance of (A, B, C)."""
    return {
        "abcd": [float(value) for value in plane.abcd],
        "normal": np.asarray(plane.normal, float).tolist(),
        "distance_m": float(plane.distance_m),
        "inlier_share": float(plane.inlier_share),
        "covariance": np.asarray(plane.covariance, float).tolist(),
    }


def line_dict(line: Any) -> dict[str, Any]:
    """A line: end points [px], (rho, theta) normalised, its covariance and how sure it is."""
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


def _guide(line: Any) -> dict[str, Any] | None:
    return None if line is None else line_dict(line)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def frame_table(frames: list[SeenFrame]) -> Table:
    """One row a guide: frame and surface, which edge, where, its slope and how sure it is."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    words = ("frame", "guide")
    for heading in ("frame", "surface", "guide", "middle, px", "slope", "conf.", "ms"):
        table.add_column(heading, no_wrap=True, justify="left" if heading in words else "right")
    for seen in frames:
        result = seen.result
        surface = "none" if result.plane is None else f"{result.plane.distance_m:.3f} m"
        found = {side: line for side in GUIDE_SIDES if (line := result.guides.get(side)) is not None}
        rows = [_words(line, side) for side, line in found.items()] or [("none", "", "", "")]
        tail = (f"{seen.time_ms:.0f}",)
        table.add_row(Path(seen.entry.color).stem, surface, *rows[0], *tail)
        for row in rows[1:]:
            table.add_row("", "", *row)
    return table


def refusals(frames: list[SeenFrame]) -> list[str]:
    """One line for every frame without a surface: why."""
    return [f"{Path(seen.entry.color).name}: {seen.result.refused}" for seen in frames if seen.result.refused]


def _words(line: Any, side: str) -> tuple[str, str, str, str]:
    """A guide, the middle of its segment, its slope against level or upright, and its confidence."""
    (x1, y1), (x2, y2) = np.asarray(line.pixels, float).tolist()
    level = side in ("top", "bottom")
    slope = math.degrees(math.atan2(y2 - y1, x2 - x1) if level else math.atan2(x1 - x2, y2 - y1))
    middle = f"{0.5 * (x1 + x2):.1f}, {0.5 * (y1 + y2):.1f}"
    return side, middle, f"{math.remainder(slope, 180.0):+.2f}°", f"{line.confidence:.2f}"
