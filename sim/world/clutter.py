"""Distracting objects: stickers, marks, lines and screws on the board; posters, pipes and cables on the wall."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

#: Objects on the board keep this distance from its outline, so that every guide stays visible [m].
BOARD_MARGIN_M = 0.018
#: Objects on the wall keep this distance from the board's outline [m] and lie within `WALL_REACH_M` of it.
WALL_MARGIN_M, WALL_REACH_M = 0.035, 0.45
_SHIFT, _ONE = 4, 16  # sub-pixel bits of OpenCV's drawing functions


def _color(rng: np.random.Generator) -> tuple[float, float, float, float]:
    grey = rng.uniform(40.0, 215.0)
    red, green, blue = np.clip(grey + rng.normal(0.0, 35.0, 3), 10, 245).tolist()
    return red, green, blue, 255.0


def _points(points: np.ndarray) -> np.ndarray:
    return np.rint(np.asarray(points) * _ONE).astype(np.int32)


def _box(center: np.ndarray, size: tuple[float, float], angle: float) -> np.ndarray:
    axis = np.array([np.cos(angle), np.sin(angle)])
    other = np.array([-axis[1], axis[0]])
    half = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * size
    return center + half[:, :1] * axis + half[:, 1:] * other


def _sticker(rng: np.random.Generator, picture: np.ndarray, center: np.ndarray, px_m: float) -> None:
    size = rng.uniform(0.03, 0.07) * px_m, rng.uniform(0.02, 0.05) * px_m
    angle = rng.normal(0.0, 0.15)
    color, ink = _color(rng), _color(rng)
    cv2.fillConvexPoly(picture, _points(_box(center, size, angle)), color, cv2.LINE_AA, _SHIFT)
    for k in range(3):
        row = center + np.array([-np.sin(angle), np.cos(angle)]) * size[1] * (0.22 * k - 0.22)
        bar = _box(row, (0.7 * size[0], 0.07 * size[1]), angle)
        cv2.fillConvexPoly(picture, _points(bar), ink, cv2.LINE_AA, _SHIFT)


def _mark(rng: np.random.Generator, picture: np.ndarray, center: np.ndarray, px_m: float) -> None:
    color, thick = _color(rng), max(1, round(0.002 * px_m))
    words = ("A3", "No 7", "48-B", "UP", "x12", "QC")
    origin = (int(center[0] - 0.02 * px_m), int(center[1]))
    word, size = str(rng.choice(words)), 0.001 * px_m
    cv2.putText(picture, word, origin, cv2.FONT_HERSHEY_SIMPLEX, size, color, thick, cv2.LINE_AA)


def _short_line(rng: np.random.Generator, picture: np.ndarray, center: np.ndarray, px_m: float) -> None:
    angle = rng.choice([0.0, 0.5 * np.pi, rng.uniform(0.0, np.pi)]) + rng.normal(0.0, 0.05)
    corners = _box(center, (rng.uniform(0.05, 0.14) * px_m, rng.uniform(0.0015, 0.004) * px_m), angle)
    cv2.fillConvexPoly(picture, _points(corners), _color(rng), cv2.LINE_AA, _SHIFT)


def _screw(rng: np.random.Generator, picture: np.ndarray, center: np.ndarray, px_m: float) -> None:
    tone, middle = float(rng.integers(70, 130)), tuple(int(v) for v in _points(center))
    cv2.circle(picture, middle, round(0.006 * px_m * _ONE), (tone, tone, tone, 255), -1, cv2.LINE_AA, _SHIFT)
    slot = _box(center, (0.010 * px_m, 0.0015 * px_m), rng.uniform(0.0, np.pi))
    cv2.fillConvexPoly(picture, _points(slot), (30, 30, 30, 255), cv2.LINE_AA, _SHIFT)


def _poster(rng: np.random.Generator, picture: np.ndarray, box: np.ndarray, px_m: float) -> None:
    """Fill the free rectangle ``box`` = (left, top, right, bottom) [px] with a poster."""
    size = np.minimum(box[2:] - box[:2], rng.uniform(0.15, 0.4, 2) * px_m)
    center = box[:2] + 0.5 * size + rng.uniform(0.0, 1.0, 2) * (box[2:] - box[:2] - size)
    angle = rng.normal(0.0, 0.03)
    cv2.fillConvexPoly(picture, _points(_box(center, tuple(size), angle)), _color(rng), cv2.LINE_AA, _SHIFT)
    for _ in range(4):
        spot = center + rng.uniform(-0.28, 0.28, 2) * size
        cv2.fillConvexPoly(picture, _points(_box(spot, tuple(0.3 * size), angle)), _color(rng), cv2.LINE_AA, _SHIFT)


def _pipe(rng: np.random.Generator, picture: np.ndarray, box: np.ndarray, px_m: float) -> None:
    """Lay a shaded pipe along the longer side of ``box``, straight across the picture."""
    size = box[2:] - box[:2]
    along = int(size[1] > size[0])
    width = min(rng.uniform(0.015, 0.04) * px_m, 0.8 * float(size.min()))
    middle = box[1 - along] + 0.5 * width + rng.uniform(0.0, 1.0) * (size[1 - along] - width)
    start, stop = int(middle - 0.5 * width), int(middle + 0.5 * width) + 1
    profile = np.sqrt(np.clip(1.0 - np.linspace(-1.0, 1.0, stop - start) ** 2, 0.05, 1.0))
    color = np.array(_color(rng)[:3])
    strip = np.clip(profile[:, None] * color, 0, 255).astype(np.uint8)
    if along:
        picture[:, start:stop, :3] = strip[None]
    else:
        picture[start:stop, :, :3] = strip[:, None]


def _cable(rng: np.random.Generator, picture: np.ndarray, box: np.ndarray, px_m: float) -> None:
    """Hang a dark cable through ``box``."""
    t = np.linspace(0.0, 1.0, 40)
    size = box[2:] - box[:2]
    wave = 0.5 + 0.35 * np.sin(2.0 * np.pi * (t * rng.uniform(0.3, 1.2) + rng.random()))
    along = int(size[1] > size[0])
    points = np.empty((40, 2))
    points[:, along] = box[along] + t * size[along]
    points[:, 1 - along] = box[1 - along] + wave * size[1 - along]
    tone = float(rng.integers(15, 60))
    thick = max(1, round(0.006 * px_m))
    cv2.polylines(picture, [_points(points)], False, (tone, tone, tone, 255), thick, cv2.LINE_AA, _SHIFT)


Painter = Callable[[np.random.Generator, np.ndarray, np.ndarray, float], None]
_ON_BOARD: tuple[Painter, ...] = (_sticker, _mark, _short_line, _screw)
_ON_WALL: tuple[Painter, ...] = (_poster, _pipe, _cable)


def clutter_board(rng: np.random.Generator, picture: np.ndarray, count: int, px_m: float) -> None:
    """Put ``count`` objects on the board's picture, none of them on its outline."""
    margin = round(BOARD_MARGIN_M * px_m)
    inner = picture[margin:-margin, margin:-margin]  # a view: parts beyond the margin are cut
    for _ in range(count):
        center = rng.uniform(0.05, 0.95, 2) * (inner.shape[1], inner.shape[0])
        _ON_BOARD[rng.integers(len(_ON_BOARD))](rng, inner, center, px_m)


def clutter_wall(
    rng: np.random.Generator, picture: np.ndarray, count: int, px_m: float, board: tuple[float, float, float, float]
) -> None:
    """Put ``count`` objects on the wall's picture around the board's box (left, top, right, bottom) [px]."""
    near, far = WALL_MARGIN_M * px_m, WALL_REACH_M * px_m
    left, top, right, bottom = board
    sides = (
        (left, bottom + near, right, bottom + far),
        (left - far, top, left - near, bottom),
        (left, top - far, right, top - near),
        (right + near, top, right + far, bottom),
    )
    first = int(rng.integers(len(sides)))
    for k in range(count):
        box = np.array(sides[(first + k) % len(sides)])
        _ON_WALL[rng.integers(len(_ON_WALL))](rng, picture, box, px_m)
