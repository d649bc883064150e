"""Weather on surface and lens: rust, stains of paint, dirt over an edge, ripples of wet paint; drops and dust."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from sim.world.board import BoardGeometry
from sim.world.errors import OutdoorErrors
from sim.world.random_streams import stream
from sim.world.textures import smooth_noise

#: Resolution of the layer on the surface [px/m], its rim beyond the board [m], and most pixels of it.
_PX_M, _RIM_M, _MOST_PX = 500.0, 0.12, 6e6
#: Rust: colour, width and length of a streak [m], and its strongest cover.
_RUST, _RUST_WIDTH_M, _RUST_LENGTH_M, _RUST_COVER = (112, 58, 30), (0.004, 0.028), (0.05, 0.35), (0.35, 0.9)
#: Stains: radius of a blot [m] and its squeeze; width of a run and its length [m].
_BLOT_M, _SQUEEZE, _RUN_M = (0.006, 0.035), (0.5, 2.0), (0.002, 0.12)
#: Dirt over an edge: half width across the edge [m], and roughness of its outline in half widths.
_DIRT_M, _ROUGH = (0.015, 0.035), 0.35
#: Drops: radius [px at 640], blur seen through one, and softness of its outline [radii].
_DROP_PX, _DROP_BLUR, _DROP_SOFT = (7.0, 24.0), 0.35, 0.2
#: Light from above through a drop: its top is darker and its bottom brighter by this fraction.
_DROP_LIGHT = 0.18
#: Dust: radius [px at 640] and fraction of the light that a speck takes.
_DUST_PX, _DUST_TAKES = (2.0, 7.0), (0.08, 0.35)
#: Size of the ripples of wet paint [m], and how much the reflection varies by them.
_RIPPLE_M, _RIPPLE = 0.02, 0.5


@dataclass(frozen=True)
class Ground:
    """Where a board lies in the plane x = 0 of the world, and its colours."""

    corner: np.ndarray  # (y, z) of its top left corner [m], (2,)
    along: np.ndarray  # unit vector to the right in (y, z), (2,)
    down: np.ndarray  # unit vector downwards in (y, z), (2,)
    size: tuple[float, float]  # width and height [m]
    paint: tuple[int, int, int]  # colour of the paint, RGB
    wall: tuple[int, int, int]  # colour of the wall, RGB

    @staticmethod
    def of(geometry: BoardGeometry) -> Ground:
        """That of a flight's board."""
        scene = geometry.scene
        corner = geometry.point(0.0, scene.board.height_m)
        size = scene.board.width_m, scene.board.height_m
        return Ground(corner, geometry.along, -geometry.up, size, scene.paint.color, scene.wall.color)

    def places(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ways to the right of and down from the top left corner [m] of points (y, z), float32 (H, W) each."""
        y, z = points[..., 0] - np.float32(self.corner[0]), points[..., 1] - np.float32(self.corner[1])
        (a, b), (c, d) = self.along.astype(np.float32), self.down.astype(np.float32)
        return y * a + z * b, y * c + z * d


class Weathering:
    """Rust, stains and dirt as one layer on the board's plane.

    Args:
        errors: How much of them.
        ground: The board.
        seed: Seed of the flight.

    Attributes:
        present: Whether there is any.
    """

    def __init__(self, errors: OutdoorErrors, ground: Ground, seed: int) -> None:
        width, height = ground.size[0] + 2.0 * _RIM_M, ground.size[1] + 2.0 * _RIM_M
        self._px_m = min(_PX_M, math.sqrt(_MOST_PX / (width * height)))
        shape = math.ceil(height * self._px_m), math.ceil(width * self._px_m)
        self._color, self._cover = np.zeros((*shape, 3), np.float32), np.zeros(shape, np.float32)
        rng = stream(seed, "outdoor surface")
        self._grain = smooth_noise(rng, shape, 2.0)
        self._ripples = 1.0 + _RIPPLE * np.clip(smooth_noise(rng, shape, _RIPPLE_M * self._px_m), -1.5, 1.5)
        self._ripples = (self._ripples / float(self._ripples.max())).astype(np.float32)
        for _ in range(rng.poisson(errors.rust_per_m * ground.size[0])):
            self._rust(ground, rng)
        for _ in range(rng.poisson(errors.stains_per_m2 * ground.size[0] * ground.size[1])):
            self._stain(ground, rng)
        if errors.broken_m:
            self._dirt(ground, errors.broken_m, rng)
        self.present = bool(self._cover.any())

    def cover(self, picture: np.ndarray, right: np.ndarray, down: np.ndarray, painted: np.ndarray | None) -> None:
        """Lay it over a picture in place, under fresh paint.

        Args:
            picture: Board and wall, float32 (H, W, 3).
            right: Places to the right of the board's top left corner [m], float32 (H, W).
            down: Places down from there [m], float32 (H, W).
            painted: Fraction of every pixel that is freshly painted, 0..1, float32 (H, W), or None.
        """
        if not self.present:
            return
        at = self._at(right), self._at(down)
        cover = cv2.remap(self._cover, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        color = cv2.remap(self._color, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        if painted is not None:
            cover *= 1.0 - painted
            color *= 1.0 - painted[..., None]
        picture *= 1.0 - cover[..., None]
        picture += color  # weighted with the cover already

    def ripple(self, right: np.ndarray, down: np.ndarray) -> np.ndarray:
        """How much of the sky wet paint mirrors at places, 0..1, float32 (H, W)."""
        places = self._at(right), self._at(down)
        return cv2.remap(self._ripples, *places, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)

    def _at(self, way: np.ndarray) -> np.ndarray:
        """Columns or rows of the layer at ways from the board's corner [m]."""
        return (way + np.float32(_RIM_M)) * np.float32(self._px_m) - np.float32(0.5)

    def _lay(self, box: tuple[slice, slice], cover: np.ndarray, color: np.ndarray) -> None:
        """Put a colour over a part of the layer."""
        self._color[box] = self._color[box] * (1.0 - cover[..., None]) + color * cover[..., None]
        self._cover[box] = self._cover[box] + cover * (1.0 - self._cover[box])

    def _window(self, center: tuple[float, float], half: tuple[float, float]) -> tuple[tuple[slice, slice], tuple]:
        """Part of the layer around a place (right, down) [m], and the ways of its pixels from there [m]."""
        (height, width), spans = self._cover.shape, []
        for at, reach, size in zip(center, half, (width, height), strict=True):
            low, high = ((at + _RIM_M + sign * reach) * self._px_m for sign in (-1.0, 1.0))
            spans.append((min(max(math.floor(low), 0), size), min(max(math.ceil(high), 0), size)))
        (c0, c1), (r0, r1) = spans
        x = (np.arange(c0, c1, dtype=np.float32) + 0.5) / self._px_m - _RIM_M - center[0]
        y = (np.arange(r0, r1, dtype=np.float32) + 0.5) / self._px_m - _RIM_M - center[1]
        return (slice(r0, r1), slice(c0, c1)), (x[None, :], y[:, None])

    def _rust(self, ground: Ground, rng: np.random.Generator) -> None:
        """A streak that runs down from a place, fading."""
        width, length = float(rng.uniform(*_RUST_WIDTH_M)), float(rng.uniform(*_RUST_LENGTH_M))
        center = float(rng.uniform(0.0, ground.size[0])), float(rng.uniform(-0.03, 0.8 * ground.size[1]))
        box, (x, y) = self._window((center[0], center[1] + 0.5 * length), (2.0 * width, 0.5 * length))
        fraction = y / length + 0.5
        half = 0.5 * width * (1.0 - 0.6 * fraction) * (1.0 + 0.25 * self._grain[box][:, :1])
        across = np.clip((half - np.abs(x + 0.15 * width * np.sin(9.0 * fraction))) / (0.25 * width) + 0.5, 0.0, 1.0)
        cover = float(rng.uniform(*_RUST_COVER)) * across * np.clip(1.0 - fraction, 0.0, 1.0) ** 0.7
        cover *= np.clip(0.85 + 0.2 * self._grain[box], 0.0, 1.0)
        self._lay(box, cover.astype(np.float32), np.array(_RUST, np.float32) * float(rng.uniform(0.8, 1.4)))

    def _stain(self, ground: Ground, rng: np.random.Generator) -> None:
        """A blot of paint with a run below it, or a part of an older stroke that was wiped off."""
        center = float(rng.uniform(0.0, ground.size[0])), float(rng.uniform(0.0, ground.size[1]))
        radius, squeeze = float(rng.uniform(*_BLOT_M)), float(np.exp(rng.uniform(*np.log(_SQUEEZE))))
        run, thin = float(rng.uniform(*_RUN_M)), float(rng.uniform(0.1, 0.3)) * radius
        box, (x, y) = self._window(center, (2.0 * radius * squeeze, 2.0 * radius + run))
        waves, phase = 0.18 * rng.standard_normal(4), rng.uniform(0.0, 2.0 * math.pi, 4)
        angle = np.arctan2(y, x / squeeze)
        outline = radius * (1.0 + sum(wave * np.cos((k + 2) * angle + phase[k]) for k, wave in enumerate(waves)))
        cover = np.clip((outline - np.hypot(x / squeeze, y)) * self._px_m + 0.5, 0.0, 1.0)
        below = (y > 0.0) & (y < radius + run)
        cover = np.maximum(cover, np.clip((thin - np.abs(x)) * self._px_m + 0.5, 0.0, 1.0) * below)
        tone = np.array(ground.paint, np.float32) * float(rng.uniform(0.8, 1.15))
        self._lay(box, (cover * float(rng.uniform(0.6, 1.0))).astype(np.float32), np.minimum(tone, 255.0))

    def _dirt(self, ground: Ground, length: float, rng: np.random.Generator) -> None:
        """Mortar over a part of one edge, of the wall's colour on both sides of it."""
        side, half = int(rng.integers(4)), float(rng.uniform(*_DIRT_M))
        level = side < 2
        size = ground.size[0] if level else ground.size[1]
        length = min(length, size)
        middle = float(rng.uniform(0.5 * length, size - 0.5 * length))
        across = (0.0, ground.size[1], 0.0, ground.size[0])[side]
        center = (middle, across) if level else (across, middle)
        reach = (0.55 * length, 1.8 * half) if level else (1.8 * half, 0.55 * length)
        box, (x, y) = self._window(center, reach)
        along, off = (x, y) if level else (y, x)
        ragged = smooth_noise(rng, (y.size, x.size), 0.012 * self._px_m)
        ragged += smooth_noise(rng, (y.size, x.size), 0.04 * self._px_m)
        inside = 1.0 - np.maximum(np.abs(off) / half, np.abs(along) / (0.5 * length)) + _ROUGH * ragged * 0.5
        cover = np.clip(inside * half * self._px_m * 0.5 + 0.5, 0.0, 1.0)
        tone = float(rng.uniform(0.85, 1.1)) + 0.05 * self._grain[box][..., None]
        self._lay(box, cover.astype(np.float32), np.clip(np.array(ground.wall, np.float32) * tone, 0.0, 255.0))


class Glass:
    """Rain drops and dust on the camera's lens, at the same place in every picture.

    Args:
        errors: How many.
        shape: (height, width) of the picture [px].
        seed: Seed of the flight.

    Attributes:
        present: Whether there are any.
    """

    def __init__(self, errors: OutdoorErrors, shape: tuple[int, int], seed: int) -> None:
        self.present = bool(errors.drops or errors.dust)
        if not self.present:
            return
        (height, width), rng = shape, stream(seed, "outdoor lens")
        v, u = np.indices(shape, np.float32)
        scale = max(shape) / 640.0
        self._through, self._light = np.zeros(shape, np.float32), np.ones(shape, np.float32)
        self._u, self._v, self._blur_px = u.copy(), v.copy(), _DROP_BLUR * _DROP_PX[1] * scale
        for _ in range(errors.drops):
            radius = scale * float(rng.uniform(*_DROP_PX))
            at_u, at_v = float(rng.uniform(0.0, width)), float(rng.uniform(0.0, height))
            x, y = u - at_u, (v - at_v) / float(rng.uniform(0.9, 1.3))
            cover = np.clip((radius - np.hypot(x, y)) / (_DROP_SOFT * radius) + 0.5, 0.0, 1.0)
            inside = cover > 0.0
            self._through = np.maximum(self._through, cover)
            self._light[inside] = 1.0 + _DROP_LIGHT * cover[inside] * y[inside] / radius
            # a drop is a short lens: it shows its surroundings upside down and smaller
            self._u[inside], self._v[inside] = at_u - 3.0 * x[inside], at_v - 3.0 * y[inside]
        for _ in range(errors.dust):
            radius = scale * float(rng.uniform(*_DUST_PX))
            x, y = u - float(rng.uniform(0.0, width)), v - float(rng.uniform(0.0, height))
            self._light *= 1.0 - float(rng.uniform(*_DUST_TAKES)) * np.exp(-(x * x + y * y) / radius**2)

    def seen(self, picture: np.ndarray) -> np.ndarray:
        """A picture, float32 (H, W, 3), through the glass."""
        if not self.present:
            return picture
        if self._through.any():
            bent = cv2.remap(picture, self._u, self._v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101)
            bent = cv2.GaussianBlur(bent, (0, 0), self._blur_px)
            picture = picture + self._through[..., None] * (bent - picture)
        return picture * self._light[..., None]
