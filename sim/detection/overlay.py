"""A picture of a frame with its surface, lines and guides."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np

from ibvs_qp.config.errors import ConfigError
from sim.detection.detection import GUIDE_SIDES, DetectedLine, Detection
from sim.detection.run import FrameResult

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
