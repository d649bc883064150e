"""Seeded textures of board, paint and wall."""

from __future__ import annotations

import cv2
import numpy as np

#: Texture arrays have a fourth, unused channel: OpenCV warps four bytes a pixel three times as fast as three.
CHANNELS = 4

# Brick format with its joint [m] (standard brick 0.215 x 0.065 with 10 mm mortar).
_BRICK_LENGTH, _BRICK_HEIGHT, _JOINT = 0.225, 0.075, 0.010


def flat(height: int, width: int, color: tuple[int, int, int] | np.ndarray) -> np.ndarray:
    """Texture of one colour, uint8 (height, width, 4)."""
    picture = np.full((height, width, CHANNELS), 255, np.uint8)
    picture[..., :3] = color
    return picture


def smooth_noise(rng: np.random.Generator, shape: tuple[int, int], grain_px: float) -> np.ndarray:
    """Noise of unit standard deviation whose grains measure ``grain_px``, float32."""
    scale = max(1.0, grain_px)
    small = shape if scale == 1.0 else (int(shape[0] / scale) + 2, int(shape[1] / scale) + 2)
    noise = rng.standard_normal(small, np.float32)
    if scale > 1.0:
        noise = cv2.resize(noise, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return noise / float(noise.std())


def shade(picture: np.ndarray, grey: np.ndarray) -> None:
    """Add a signed grey picture to every colour channel in place, saturating."""
    for start in range(0, len(picture), 256):  # by bands: a whole float copy of a large board costs memory
        rows = slice(start, start + 256)
        lifted = picture[rows, :, :3].astype(np.float32) + grey[rows, :, None]
        picture[rows, :, :3] = np.clip(np.rint(lifted), 0, 255).astype(np.uint8)


def board_surface(
    rng: np.random.Generator, shape: tuple[int, int], color: tuple[int, int, int], rim_px: int
) -> np.ndarray:
    """Painted board: fine grain, faint clouds, and a rim a few grey levels darker.

    Args:
        rng: Source of the grain.
        shape: (height, width) [px].
        color: RGB 0..255.
        rim_px: Width of the rim [px].

    Returns:
        Texture uint8 (height, width, 4).
    """
    picture = flat(*shape, color)
    grain = 1.5 * smooth_noise(rng, shape, 1.0) + 1.2 * smooth_noise(rng, shape, 6.0)
    grain += 2.0 * smooth_noise(rng, shape, 150.0)
    rim = np.zeros(shape, bool)
    rim[:rim_px], rim[-rim_px:], rim[:, :rim_px], rim[:, -rim_px:] = True, True, True, True
    grain[rim] -= 7.0
    shade(picture, grain)
    return picture


def paint_surface(rng: np.random.Generator, shape: tuple[int, int], color: tuple[int, int, int]) -> np.ndarray:
    """Fresh paint: its colour with faint streaks along the rows, uint8 (height, width, 4)."""
    picture = flat(*shape, color)
    streaks = cv2.blur(smooth_noise(rng, shape, 2.0), (61, 1))
    shade(picture, 3.0 * streaks / max(float(streaks.std()), 1e-6))
    return picture


def wall_surface(
    rng: np.random.Generator,
    shape: tuple[int, int],
    color: tuple[int, int, int],
    px_m: float,
    brick: bool | None = None,
) -> np.ndarray:
    """Brick or plaster wall with visible texture, uint8 (height, width, 4); the seed chooses unless ``brick`` does."""
    picture = flat(*shape, color)
    fine = 3.0 * smooth_noise(rng, shape, 1.5) + 3.0 * smooth_noise(rng, shape, 0.01 * px_m)
    clouds = 6.0 * smooth_noise(rng, shape, 0.25 * px_m)
    drawn = rng.random() < 0.5
    if drawn if brick is None else brick:
        _lay_bricks(rng, picture, px_m)
        shade(picture, fine + clouds)
    else:
        pits = smooth_noise(rng, shape, 0.006 * px_m)
        shade(picture, fine + clouds - 14.0 * (pits > 1.4) + 8.0 * (pits < -1.6))
    return picture


def _lay_bricks(rng: np.random.Generator, picture: np.ndarray, px_m: float) -> None:
    height, width = picture.shape[:2]
    base = picture[0, 0, :3].astype(float)
    mortar = np.clip(base * 0.55 + 85.0, 0, 255)
    picture[..., :3] = mortar.astype(np.uint8)
    joint = 0.5 * _JOINT * px_m
    for course in range(int(height / (_BRICK_HEIGHT * px_m)) + 2):
        top = course * _BRICK_HEIGHT * px_m
        shift = 0.5 * (course % 2) * _BRICK_LENGTH * px_m
        for k in range(-1, int(width / (_BRICK_LENGTH * px_m)) + 2):
            left = shift + k * _BRICK_LENGTH * px_m
            tone = np.clip(base + rng.normal(0.0, 9.0) + rng.normal(0.0, 3.0, 3), 0, 255)
            wobble = rng.normal(0.0, 0.0012 * px_m, 4)
            right, bottom = left + _BRICK_LENGTH * px_m, top + _BRICK_HEIGHT * px_m
            start = (round(left + joint + wobble[0]), round(top + joint + wobble[1]))
            stop = (round(right - joint + wobble[2]), round(bottom - joint + wobble[3]))
            cv2.rectangle(picture, start, stop, (*tone.tolist(), 255.0), -1)
