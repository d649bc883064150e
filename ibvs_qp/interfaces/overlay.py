"""A picture with the results of perception drawn in, for videos and for viewing."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.vision.lines.tracks import TrackState
from ibvs_qp.vision.perception import PerceptionResult
from ibvs_qp.vision.picture.picture import denormalise

#: RGB colours: surface tint, mask tint, tracks by kind, tentative or lost tracks, text and its ground.
_SURFACE, _MASK = (60, 220, 90), (200, 60, 60)
_KINDS = {"board": (255, 160, 0), "paint": (255, 0, 200), "": (120, 120, 120)}
_FAINT, _INK, _GROUND = (150, 150, 150), (255, 255, 255), (20, 20, 20)
#: Weight of a tint in the picture; length of the tick towards the surface [px]; size of the text.
_TINT, _TICK_PX, _TEXT = 0.22, 14, 0.42
#: Font, margin of the ground around the text, and distance of a label from its line [px].
_FONT, _PAD_PX, _CLEAR_PX = cv2.FONT_HERSHEY_SIMPLEX, 3, 10


def draw_overlay(rgb: np.ndarray, seen: PerceptionResult, *, words: bool = True, tints: bool = True) -> np.ndarray:
    """Draw surface, mask, tracks and velocity into a copy of the picture.

    Args:
        rgb: The picture, uint8 (H, W, 3).
        seen: Result of perception.
        words: Whether to label each track, and write distance and velocity; too small to read in print.
        tints: Whether to tint surface and mask, which takes milliseconds.

    Returns:
        uint8 (H, W, 3).
    """
    result = np.ascontiguousarray(rgb).copy()
    height, width = result.shape[:2]
    if tints and seen.plane is not None:
        region = cv2.resize(seen.plane.component.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
        _tint(result, region > 0, _SURFACE)
    if tints and seen.mask is not None and seen.mask.shape == (height, width):
        _tint(result, seen.mask > 0, _MASK)
    if seen.intrinsics is not None:
        segments = [denormalise(track.segment, seen.intrinsics) for track in seen.tracks]
        for track, ends in zip(seen.tracks, segments, strict=True):
            _draw_track(result, track, ends)
        for track, ends in zip(seen.tracks, segments, strict=True) if words else ():  # last: no line covers a label
            _label_track(result, track, ends)
    if words:
        _write(result, _caption(seen), (6, height - 8))
    return result


def _tint(picture: np.ndarray, where: np.ndarray, color: tuple[int, int, int]) -> None:
    picture[where] = (picture[where] * (1.0 - _TINT) + np.array(color) * _TINT).astype(np.uint8)


def _draw_track(picture: np.ndarray, track: TrackState, ends: np.ndarray) -> None:
    color = _KINDS.get(track.kind, _FAINT) if track.confirmed and track.seen else _FAINT
    first, second = (tuple(int(value) for value in np.round(end)) for end in ends)
    cv2.line(picture, first, second, color, 2, cv2.LINE_AA)
    for end, reason in zip((first, second), track.line.ends, strict=True):
        if reason == "end":
            cv2.circle(picture, end, 4, color, -1, cv2.LINE_AA)
    middle = ends.mean(axis=0)
    side = track.surface_side * np.array([np.cos(track.theta), np.sin(track.theta)])
    tip = middle + _TICK_PX * side
    cv2.line(
        picture,
        tuple(np.round(middle).astype(int).tolist()),
        tuple(np.round(tip).astype(int).tolist()),
        color,
        2,
        cv2.LINE_AA,
    )


def _label_track(picture: np.ndarray, track: TrackState, ends: np.ndarray) -> None:
    """Label a track on the side away from the surface, where no other edge of it runs."""
    name = f" {track.hint}" if track.hint else ""
    text = f"{track.track_id} {track.kind} {track.weight:.1f}{name}"
    (width, height), _ = cv2.getTextSize(text, _FONT, _TEXT, 1)
    away = -1.0 if track.surface_side > 0 else 1.0
    cos, sin = away * np.cos(track.theta), away * np.sin(track.theta)
    x, y = ends.mean(axis=0)
    x, y = x + (0.5 * width + _CLEAR_PX) * cos, y + (0.5 * height + _CLEAR_PX) * sin
    _write(picture, text, (round(x - 0.5 * width), round(y + 0.5 * height)))


def _caption(seen: PerceptionResult) -> str:
    if seen.plane is None:
        return seen.refused or "no surface"
    parts = [f"{seen.plane.distance_m:.3f} m"]
    if seen.features.velocity is not None:
        parts.append("v " + " ".join(f"{1e3 * value:+.0f}" for value in seen.features.velocity) + " mm/s")
    return "  ".join(parts)


def _write(picture: np.ndarray, text: str, place: tuple[int, int]) -> None:
    """Write on a small filled ground, moved into the picture: thin strokes stay legible on brick and paint."""
    (width, height), descent = cv2.getTextSize(text, _FONT, _TEXT, 1)
    x = min(max(place[0], _PAD_PX), max(picture.shape[1] - width - _PAD_PX - 1, _PAD_PX))
    y = min(max(place[1], height + _PAD_PX), max(picture.shape[0] - descent - _PAD_PX - 1, height + _PAD_PX))
    corners = (x - _PAD_PX, y - height - _PAD_PX), (x + width + _PAD_PX, y + descent + _PAD_PX - 1)
    cv2.rectangle(picture, *corners, _GROUND, -1)
    cv2.putText(picture, text, (x, y), _FONT, _TEXT, _INK, 1, cv2.LINE_AA)
