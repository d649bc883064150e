"""Pictures outside: sunlight on the wall, the camera's exposure, and the weather of surface and lens (`weathering`).

Everything is drawn from the seed and applied to a drawn picture from the geometry of the view: shadows of beams are
fixed on the wall, the vehicle's own shadow and reflections move with it, drops and dust are fixed in the picture. The
wall lies in the board's plane here, so a shadow runs straight on past the board.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from allocation.geometry import disc_rim
from ibvs_qp.config.vehicle import VehicleParams
from sim.sensors.cameras.arm import to_camera
from sim.sensors.cameras.view import View
from sim.sensors.cameras.weathering import Glass, Ground, Weathering
from sim.world.errors import OutdoorErrors
from sim.world.random_streams import stream

#: The sun is behind the vehicle: height above the horizon and way aside [deg], low enough that it is mirrored in view.
_HEIGHT_DEG, _ASIDE_DEG = (5.0, 25.0), 25.0
#: Radius of the sun's disc [rad], which makes the edge of a shadow wide.
_SUN_RAD = 0.0047
#: Width of a beam's shadow, and of its soft edge [m]: 0.3 to 1.5 m from the wall.
_BEAM_M, _SOFT_M = (0.04, 0.20), (0.003, 0.014)
#: Chance that a beam runs level or upright rather than askew, and its error then [deg].
_SQUARE, _SQUARE_DEG = 0.7, 5.0
#: Light that a shadow takes of red, green and blue: the sky that lights it is blue.
_SHADE_TINT = np.array((1.0, 0.98, 0.95), np.float32)
#: Width of the sun's mirror image on dull paint and on wet paint [rad], and its colour.
_DULL_RAD, _WET_RAD, _SUN_COLOR = (0.06, 0.14), 0.25, np.array((255.0, 250.0, 238.0), np.float32)
#: Sky in wet paint away from the sun, fraction of the sun's part.
_SKY = 0.3
#: Fraction of the light that spinning propellers take of a solid part; radius of hub over rotor distance.
_BLADES, _HUB_SHARE = 0.4, 0.25
#: Radius of an arm of the vehicle [m], and points along the rim of a disc.
_ARM_M, _RIM_POINTS = 0.011, 24
#: Noise of the sensor where all light is gone, beyond its usual one [grey levels]; rows added to its bank.
_DARK_NOISE, _SPARE = 6.0, 64


def strength(size: float, rng: np.random.Generator) -> float:
    """Strength of an effect in a flight: between half of its size and all of it."""
    return size * float(rng.uniform(0.5, 1.0))


class Outdoor:
    """Outdoor light, surface and lens of one flight.

    Args:
        errors: Sizes of the effects.
        ground: Where the board lies, and its colours.
        vehicle: Parts that cast the own shadow, and where the camera is.
        shape: (height, width) of the picture [px].
        seed: Seed of the flight.
    """

    def __init__(
        self, errors: OutdoorErrors, ground: Ground, vehicle: VehicleParams, shape: tuple[int, int], seed: int
    ) -> None:
        self._errors, self._ground = errors, ground
        light = stream(seed, "outdoor light")
        low, high = np.radians(_HEIGHT_DEG)
        height, aside = float(light.uniform(low, high)), math.radians(float(light.uniform(-_ASIDE_DEG, _ASIDE_DEG)))
        # x into the wall, y right, z down
        self._sun = np.array(
            (-math.cos(height) * math.cos(aside), math.cos(height) * math.sin(aside), -math.sin(height))
        )
        self._glare, self._gloss = strength(errors.glare, light), strength(errors.wet_gloss, light)
        self._dull_rad = float(light.uniform(*_DULL_RAD))
        self._own_shade, self._beam_shade = strength(errors.own_shade, light), strength(errors.beam_shade, light)
        self._gain = (1.0 + strength(errors.overexposure, light)) * (1.0 - strength(errors.low_light, light))
        self._beams = [_beam(ground.size, light) for _ in range(errors.beams)]
        self._solid, self._discs = _parts(vehicle)
        self._surface = Weathering(errors, ground, seed)
        self._glass = Glass(errors, shape, seed)
        self._rng, self._dark = stream(seed, "outdoor noise"), np.zeros(0, np.int8)
        if errors.low_light:
            sigma = _DARK_NOISE * (1.0 - min(self._gain, 1.0))
            bank = sigma * self._rng.standard_normal((shape[0] + _SPARE, shape[1], 3), np.float32)
            self._dark = np.rint(bank).astype(np.int8)
        v, u = np.indices(shape, np.float32)
        self._u, self._v = u, v

    @property
    def needs_paint(self) -> bool:
        """Whether the place of fresh paint matters: it is wet, and covers rust, stains and dirt."""
        return self._surface.present or self._errors.wet_gloss > 0.0 or self._errors.wet_holes > 0.0

    def scene(self, picture: np.ndarray, view: View, painted: np.ndarray | None) -> np.ndarray:
        """Surface and light on board and wall, before lens and vehicle; float32 (H, W, 3).

        Args:
            picture: As drawn, uint8 or float32 (H, W, 3).
            view: Pose of the camera.
            painted: Fraction of every pixel that is freshly painted, 0..1, float32 (H, W), or None.
        """
        picture = picture.astype(np.float32)
        p, q, r = view.pixel_plane(0.0)
        depth = 1.0 / np.maximum(p * self._u + q * self._v + r, 1e-3)  # of the board's plane
        fx, fy, cx, cy = view.intrinsics
        rays = np.stack(((self._u - cx) / fx, (self._v - cy) / fy, np.ones_like(self._u)), axis=-1)
        rays = (rays @ view.rotation.astype(np.float32)).astype(np.float32)  # in the world, depth 1 in the camera
        points = view.center[1:].astype(np.float32) + rays[..., 1:] * depth[..., None].astype(np.float32)
        right, down = self._ground.places(points)
        self._surface.cover(picture, right, down, painted)
        if self._beams or self._own_shade:
            taken = self._beam_shadow(right, down)
            if self._own_shade:
                taken = np.maximum(taken, self._own_shade * self._own_shadow(view))
            picture *= 1.0 - taken[..., None] * _SHADE_TINT
        if self._glare or (self._gloss and painted is not None):
            rays /= np.linalg.norm(rays, axis=2, keepdims=True)
            rays[..., 0] *= -1.0  # as the wall mirrors them
            off = 1.0 - rays @ self._sun.astype(np.float32)  # half the squared angle from the sun
            if self._glare:
                picture += self._glare * np.exp(-off / self._dull_rad**2)[..., None] * _SUN_COLOR
            if self._gloss and painted is not None:
                mirrored = self._gloss * (_SKY + (1.0 - _SKY) * np.exp(-off / _WET_RAD**2))
                mirrored *= painted * self._surface.ripple(right, down)
                picture += mirrored[..., None] * (_SUN_COLOR - picture)
        return picture

    def lens(self, picture: np.ndarray) -> np.ndarray:
        """A picture, uint8 or float32 (H, W, 3), with drops and dust, exposure, and the noise of low light."""
        if not (self._glass.present or self._gain != 1.0 or self._dark.size):
            return picture
        seen = self._glass.seen(picture.astype(np.float32)) * np.float32(self._gain)
        if self._dark.size:
            row = int(self._rng.integers(_SPARE))
            seen += np.roll(self._dark[row : row + len(seen)], int(self._rng.integers(seen.shape[1])), axis=1)
        if picture.dtype != np.uint8:
            return seen
        return np.clip(np.rint(seen), 0.0, 255.0).astype(np.uint8)

    def holes(self, painted: np.ndarray | None) -> np.ndarray:
        """Flat indices of pixels without depth on shiny paint; painted as in `scene`."""
        if painted is None or not self._errors.wet_holes:
            return np.zeros(0, np.intp)
        height, width = painted.shape
        patches = self._rng.standard_normal((height // 4 + 1, width // 4 + 1), np.float32)
        patches = cv2.resize(cv2.GaussianBlur(patches, (0, 0), 1.5), (4 * patches.shape[1], 4 * patches.shape[0]))
        limit = np.quantile(patches, self._errors.wet_holes)
        return np.flatnonzero((painted > 0.5) & (patches[:height, :width] < limit))

    def _beam_shadow(self, right: np.ndarray, down: np.ndarray) -> np.ndarray:
        """Fraction of the light that the beams take, float32 (H, W)."""
        taken = np.zeros(right.shape, np.float32)
        for a, b, c, half, soft in self._beams:
            cover = np.float32(half) - np.abs(np.float32(a) * right + np.float32(b) * down - np.float32(c))
            np.maximum(taken, np.clip(cover / np.float32(soft) + np.float32(0.5), 0.0, 1.0), out=taken)
        return taken * np.float32(self._beam_shade)

    def _own_shadow(self, view: View) -> np.ndarray:
        """How much of the sun the vehicle hides, 0..1, float32 (H, W)."""
        plane, sun = view.plane(0.0), view.rotation @ self._sun
        fx, fy, cx, cy = view.intrinsics
        mask = np.zeros(self._u.shape, np.uint8)

        def cast(points: np.ndarray) -> np.ndarray:
            """Pixels of the shadow of points (n, 3) in the camera."""
            at = points - ((points @ plane - 1.0) / (plane @ sun))[:, None] * sun
            z = np.maximum(at[:, 2], 0.05)
            return np.rint(16.0 * np.column_stack((fx * at[:, 0] / z + cx, fy * at[:, 1] / z + cy)))

        for rim in self._discs:
            cv2.fillConvexPoly(mask, np.clip(cast(rim), -1e6, 1e6).astype(np.int32), 255.0 * _BLADES, cv2.LINE_AA, 4)
        for start, stop, radius in self._solid:
            ends = np.clip(cast(np.stack((start, stop))), -1e6, 1e6).astype(np.int32)
            thick = max(1, round(2.0 * radius * fx * float(plane[2])))
            cv2.line(mask, ends[0].tolist(), ends[1].tolist(), 255.0, thick, cv2.LINE_AA, 4)
        away = max(1.0 - float(plane @ (self._solid[0][0])), 0.0) / float(np.linalg.norm(plane))  # of the hub
        return cv2.GaussianBlur(mask, (0, 0), max(_SUN_RAD * away * fx * float(plane[2]), 0.5)) / np.float32(255.0)


def _beam(size: tuple[float, float], rng: np.random.Generator) -> tuple[float, float, float, float, float]:
    """A band a right + b down = c +- half on the board, and the width of its soft edge [m]."""
    width, soft = float(rng.uniform(*_BEAM_M)), float(rng.uniform(*_SOFT_M))
    askew = float(rng.uniform(0.0, math.pi))
    square = 0.5 * math.pi * int(rng.integers(2)) + math.radians(_SQUARE_DEG * float(rng.standard_normal()))
    angle = square if rng.random() < _SQUARE else askew
    a, b = math.cos(angle), math.sin(angle)
    right, down = rng.uniform(0.0, 1.0, 2) * size
    return a, b, a * float(right) + b * float(down), 0.5 * width, soft


def _parts(vehicle: VehicleParams) -> tuple[list[tuple[np.ndarray, np.ndarray, float]], list[np.ndarray]]:
    """Solid parts (start, end, radius), hub first, and rims of the propellers (n, 3), in the camera's axes [m]."""
    turn, camera = to_camera(vehicle), np.asarray(vehicle.camera_position_m)
    places, axes = np.asarray(vehicle.geometry.positions), np.asarray(vehicle.geometry.axes)
    middle, base = turn @ -camera, turn @ (np.asarray(vehicle.force_torque_position_m) - camera)
    tip = turn @ (np.asarray(vehicle.tip_position_m) - camera)
    radius = _HUB_SHARE * float(np.median(np.linalg.norm(places, axis=1)))
    solid = [(middle, middle + 1e-3, radius), (base, tip, vehicle.arm_radius_m), (middle, base, vehicle.arm_radius_m)]
    solid += [(middle, turn @ (place - camera), _ARM_M) for place in places]
    rims = [
        (place - camera + disc_rim(axis, vehicle.propeller_radius_m, _RIM_POINTS)) @ turn.T
        for place, axis in zip(places, axes, strict=True)
    ]
    return solid, rims
