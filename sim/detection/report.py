"""Output of `ibvs-qp detect`: one JSON line, a table, and pictures with surface, lines and guides."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from ibvs_qp.config.errors import ConfigError
from sim.detection.detection import GUIDE_SIDES, DetectedLine, Detection
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


#: RGB colours of the guides, of other lines, the surface's tint, the seed, text and its ground.
_COLORS = {"top": (255, 150, 0), "bottom": (255, 0, 200), "left": (0, 190, 255), "right": (120, 255, 0)}
_FAINT, _SURFACE, _SEED = (200, 200, 90), (60, 220, 90), (255, 40, 40)
_INK, _GROUND = (255, 255, 255), (20, 20, 20)
#: Weight of the tint; text size for a picture 640 wide; margin of the ground around text [px].
_TINT, _TEXT, _PAD = 0.20, 0.45, 3
_FONT = cv2.FONT_HERSHEY_SIMPLEX
#: Sub-pixel bits of the drawing functions.
_SHIFT = 4
#: Confidence from which a guide is drawn full, below it is dashed; length of a dash [px].
_SURE, _DASH = 0.8, 9.0


def draw_detection(rgb: np.ndarray, result: Detection, seed: tuple[float, float] | None = None) -> np.ndarray:
    """Draw the result into a copy of the picture.

    Args:
        rgb: The picture, uint8 (H, W, 3).
        result: Result of the detection.
        seed: (u, v) of the place on the surface, or None.

    Returns:
        uint8 (H, W, 3).
    """
    drawn = np.ascontiguousarray(rgb).copy()
    height, width = drawn.shape[:2]
    plane = result.plane
    if plane is not None and getattr(plane, "component", None) is not None and plane.component.ndim == 2:
        region = cv2.resize(plane.component.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST) > 0
        drawn[region] = (drawn[region] * (1.0 - _TINT) + np.array(_SURFACE) * _TINT).astype(np.uint8)
    chosen = [line for line in result.guides.values() if line is not None]
    for line in result.candidates:
        if not any(line is guide for guide in chosen):
            _segment(drawn, np.asarray(line.pixels, float), _FAINT, 1)
    for side in GUIDE_SIDES:
        guide = result.guides.get(side)
        if guide is not None:
            _guide(drawn, guide, _COLORS[side])
    for side in GUIDE_SIDES:  # last: no line runs through a label
        guide = result.guides.get(side)
        if guide is not None:
            middle = np.asarray(guide.pixels, float).mean(axis=0)
            _write(drawn, f"{side} {guide.confidence:.2f}", middle)
    if seed is not None:
        place = (round(seed[0]), round(seed[1]))
        cv2.drawMarker(drawn, place, _SEED, cv2.MARKER_CROSS, 14, 2)
    _write(drawn, _caption(result), np.array([0.5 * width, height - 12.0]))
    return drawn


def _caption(result: Detection) -> str:
    if result.plane is None:
        return f"{result.refused or 'no surface'}; {len(result.candidates)} lines"
    tracked = ", tracked" if result.tracked else ""
    return f"surface {result.plane.distance_m:.3f} m away{tracked}; {len(result.candidates)} lines"


def _guide(drawn: np.ndarray, line: DetectedLine, color: tuple[int, int, int]) -> None:
    ends = np.asarray(line.pixels, float)
    if line.confidence >= _SURE:
        _segment(drawn, ends, color, 2)
        return
    length = float(np.hypot(*(ends[1] - ends[0])))
    steps = np.arange(0.0, length, 2.0 * _DASH) / max(length, 1.0)
    for start in steps:
        stop = min(start + _DASH / max(length, 1.0), 1.0)
        _segment(drawn, ends[0] + np.array([[start], [stop]]) * (ends[1] - ends[0]), color, 2)


def _segment(drawn: np.ndarray, ends: np.ndarray, color: tuple[int, int, int], thick: int) -> None:
    first, second = (tuple(np.rint(end * (1 << _SHIFT)).astype(int).tolist()) for end in ends)
    cv2.line(drawn, first, second, color, thick, cv2.LINE_AA, _SHIFT)


def _write(drawn: np.ndarray, text: str, middle: np.ndarray) -> None:
    """Write on a filled ground around a place, moved into the picture."""
    height, width = drawn.shape[:2]
    size = max(_TEXT * width / 640.0, 0.3)
    (wide, high), descent = cv2.getTextSize(text, _FONT, size, 1)
    x = round(min(max(middle[0] - 0.5 * wide, _PAD), max(width - wide - _PAD, _PAD)))
    y = round(min(max(middle[1] + 0.5 * high, high + _PAD), height - descent - _PAD))
    cv2.rectangle(drawn, (x - _PAD, y - high - _PAD), (x + wide + _PAD, y + descent), _GROUND, -1)
    cv2.putText(drawn, text, (x, y), _FONT, size, _INK, 1, cv2.LINE_AA)


def write_overlay(result: FrameResult, folder: Path) -> Path | None:
    """Write NAME_overlay.png into a folder; returns its path, or None for an unreadable frame.

    Raises:
        ConfigError: When the file cannot be written.
    """
    if result.frame is None:
        return None
    name = re.sub(r"[^\w.-]+", "_", str(Path(result.entry.color).with_suffix(""))).strip("_")
    file = folder / f"{name}_overlay.png"
    drawn = draw_detection(result.frame.rgb, result.detection, result.entry.seed)
    _, data = cv2.imencode(".png", cv2.cvtColor(drawn, cv2.COLOR_RGB2BGR))
    try:
        file.write_bytes(np.asarray(data).tobytes())
    except OSError as error:
        raise ConfigError(f"cannot write {file}: {error.strerror or error}") from None
    return file
