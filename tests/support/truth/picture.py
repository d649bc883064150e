"""The colour picture of a truth scene: supersampled, edges by their exact coverage of every pixel."""

from __future__ import annotations

import functools

import cv2
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from sim.sensors.cameras.outdoor import Outdoor
from sim.world.clutter import clutter_board
from sim.world.errors import OutdoorErrors
from sim.world.textures import flat, shade, smooth_noise, wall_surface
from tests.support.truth.device_picture import exposure_gain, through_device
from tests.support.truth.scenes import TruthScene

#: Subpixels per pixel and side; resolution of the textures [px/m]; width of the wall beyond the board [m].
SUPERSAMPLING, _PX_M, _WALL_M = 3, 1100.0, 0.5
#: Modules per side of a printed tag: as an AprilTag of 6 x 6 with its border.
_MODULES = 8
#: Number of different walls of one kind.
_WALLS = 4


def outdoors(scene: TruthScene) -> Outdoor | None:
    """The effects outside of a scene, those of flights; None inside."""
    if scene.outdoor == OutdoorErrors():
        return None
    width, height, _ = scene.camera
    return Outdoor(scene.outdoor, scene.ground, VehicleParams(), (height, width), scene.seed)


def paint_picture(
    scene: TruthScene, rng: np.random.Generator, outside: Outdoor | None = None, plain: np.ndarray | None = None
) -> np.ndarray:
    """Colours of board, strokes and wall with blur, shading and noise, uint8 (H, W, 3).

    Args:
        scene: The scene.
        rng: Source of the noise.
        outside: Of `outdoors`.
        plain: Of `plain_picture`, if it is known.
    """
    width = scene.camera[0]
    picture = plain_picture(scene, rng) if plain is None else plain
    if outside is not None:
        picture = outside.scene(picture, scene.view, painted(scene) if fresh(scene) else None)
    light = np.linspace(1.0 - scene.shading, 1.0 + scene.shading, width, dtype=np.float32)[None, :, None]
    picture = picture * light
    kernel = _motion_kernel(scene.motion_px)
    if kernel is not None:
        picture = cv2.filter2D(picture, -1, kernel, borderType=cv2.BORDER_REPLICATE)
    # averaging over the pixel blurs by 1/sqrt(12) of it already
    sigma = float(np.sqrt(max(scene.blur_px**2 - 1.0 / 12.0, 0.0)))
    if sigma > 0.05:
        picture = cv2.GaussianBlur(picture, (0, 0), sigma)
    if outside is not None:
        picture = outside.lens(np.asarray(picture, np.float32))
    picture = picture + scene.noise * rng.standard_normal(picture.shape, np.float32)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def plain_picture(scene: TruthScene, rng: np.random.Generator) -> np.ndarray:
    """Colours of board, strokes and wall in even light, float32 (H, W, 3); arguments as for `paint_picture`."""
    width, height, _ = scene.camera
    textures = np.random.default_rng(np.random.SeedSequence([scene.seed, 0x7478]))
    wall = _warp(_wall(scene), scene, scene.gap_m)
    board = _warp(_board(scene, textures), scene, 0.0)
    for (left, top, right, bottom), color in scene.strokes:
        corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
        coverage = quad_coverage(scene, corners)[..., None]
        board = board * (1.0 - coverage) + coverage * np.array(color, np.float32)
    coverage = quad_coverage(scene, scene.corners)[..., None]
    picture = coverage * board + (1.0 - coverage) * wall
    if scene.device is not None:
        picture = through_device(picture, scene, SUPERSAMPLING) * np.float32(exposure_gain(scene, rng))
    return cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)


def fresh(scene: TruthScene) -> bool:
    """Whether the strokes are wet; else they are of older paint, with rust and stains on it."""
    return scene.outdoor.wet_gloss > 0.0 or scene.outdoor.wet_holes > 0.0


def painted(scene: TruthScene) -> np.ndarray:
    """Fraction of every pixel that strokes cover, float32 (H, W)."""
    width, height, _ = scene.camera
    cover = np.zeros((SUPERSAMPLING * height, SUPERSAMPLING * width), np.float32)
    for (left, top, right, bottom), _ in scene.strokes:
        corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
        np.maximum(cover, quad_coverage(scene, corners), out=cover)
    return cv2.resize(cover, (width, height), interpolation=cv2.INTER_AREA)


def quad_coverage(scene: TruthScene, corners: np.ndarray) -> np.ndarray:
    """Fraction 0..1 of every subpixel inside a convex quadrilateral of the board, float32 (S H, S W).

    Args:
        scene: For pose and camera.
        corners: Its corners in order (right, down) [m], (4, 2).
    """
    width, height, _ = scene.camera
    u = (np.arange(SUPERSAMPLING * width, dtype=np.float32) + 0.5) / SUPERSAMPLING - 0.5
    v = (np.arange(SUPERSAMPLING * height, dtype=np.float32) + 0.5) / SUPERSAMPLING - 0.5
    fx, fy, cx, cy = scene.intrinsics
    coverage = np.ones((len(v), len(u)), np.float32)
    for a, b, c in scene.edge_planes(corners):
        p, q, r = a / fx, b / fy, c - a * cx / fx - b * cy / fy
        scale = SUPERSAMPLING / float(np.hypot(p, q))
        distance = (scale * p * u)[None] + (scale * q * v + scale * r)[:, None]
        coverage *= np.clip(distance + 0.5, 0.0, 1.0).astype(np.float32)
    return coverage


def _warp(texture: tuple[np.ndarray, np.ndarray, float], scene: TruthScene, behind_m: float) -> np.ndarray:
    """Camera view of a texture with its corner (right, down) [m] and step [m], float32 (S H, S W, 3)."""
    picture, corner, step = texture
    fx, fy, cx, cy = scene.intrinsics
    camera = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    origin = scene.translation + behind_m * scene.rotation[:, 2]
    base = scene.rotation[:, :2] @ (corner + 0.5 * step) + origin
    forward = camera @ np.column_stack((scene.rotation[:, 0] * step, scene.rotation[:, 1] * step, base))
    times = SUPERSAMPLING
    finer = np.array([[times, 0.0, 0.5 * (times - 1)], [0.0, times, 0.5 * (times - 1)], [0.0, 0.0, 1.0]])
    size = (times * scene.camera[0], times * scene.camera[1])
    warped = cv2.warpPerspective(picture, finer @ forward, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    return warped[..., :3].astype(np.float32)


def _wall(scene: TruthScene) -> tuple[np.ndarray, np.ndarray, float]:
    """Texture, its corner (right, down) [m] and its step [m]; mirrored beyond its border."""
    reach = np.array(scene.size_m) * 0.5 + _WALL_M * max(1.0, scene.gap_m)
    scale = _PX_M / max(1.0, 2.0 * scene.gap_m)  # a far wall needs no finer texture
    shape = (round(2 * reach[1] * scale), round(2 * reach[0] * scale))
    return _wall_texture(scene.seed % _WALLS, shape, scene.wall_color, scale, scene.wall), -reach, 1.0 / scale


@functools.lru_cache(maxsize=8)
def _wall_texture(seed: int, shape: tuple[int, int], color: tuple[int, int, int], px_m: float, kind: str) -> np.ndarray:
    rng = np.random.default_rng(np.random.SeedSequence([seed, 0x776C]))
    if kind == "plain":
        return flat(*shape, color)
    return wall_surface(rng, shape, color, px_m, brick=kind == "brick")


def _board(scene: TruthScene, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, float]:
    half = 0.5 * np.array(scene.size_m)
    width, height = (round(2 * entry * _PX_M) for entry in half)
    picture = flat(height, width, scene.board_color)
    shade(picture, 1.5 * smooth_noise(rng, (height, width), 2.0) + 1.5 * smooth_noise(rng, (height, width), 120.0))
    if scene.clutter:
        clutter_board(rng, picture, scene.clutter, _PX_M)
    if scene.prints:
        _print_tags(picture, scene.prints, rng)
    return picture, -half, 1.0 / _PX_M


def _print_tags(picture: np.ndarray, columns: int, rng: np.random.Generator) -> None:
    """Rows of black tags with random modules, a third of a tag apart and from the edges."""
    height, width = picture.shape[:2]
    pitch = width / (columns + 0.25)
    side = int(pitch * 0.75)
    for row in range(int((height - 0.25 * pitch) // pitch)):
        for column in range(columns):
            top, left = int((row + 0.25) * pitch), int((column + 0.25) * pitch)
            tag = np.zeros((_MODULES, _MODULES), np.uint8)
            tag[1:-1, 1:-1] = rng.integers(0, 2, (_MODULES - 2, _MODULES - 2))
            dark = cv2.resize(tag, (side, side), interpolation=cv2.INTER_NEAREST) == 0
            picture[top : top + side, left : left + side, :3][dark] = (32, 30, 30)


def _motion_kernel(motion_px: tuple[float, float]) -> np.ndarray | None:
    """Kernel of a straight motion blur (right, down) [px], symmetric so that no line moves; None for none."""
    length = float(np.hypot(*motion_px))
    if length < 0.2:
        return None
    reach = int(np.ceil(0.5 * length)) + 1
    fine = 16
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1), np.float32)
    for place in (np.arange(fine * reach * 2) + 0.5) / (fine * reach * 2) - 0.5:
        x, y = place * motion_px[0] + reach, place * motion_px[1] + reach
        i, j = int(np.floor(y)), int(np.floor(x))
        for di, dj in ((0, 0), (0, 1), (1, 0), (1, 1)):
            weight = (1 - abs(y - i - di)) * (1 - abs(x - j - dj))
            if weight > 0:
                kernel[i + di, j + dj] += weight
    return kernel / kernel.sum()
