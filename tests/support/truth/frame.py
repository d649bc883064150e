"""A truth frame: supersampled picture, noisy depth, and the exact lines and plane behind them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.picture.camera import RgbdCamera
from sim.sensors.cameras.arm import vehicle_layer
from sim.world.scene import CameraScene, Scene
from tests.support.truth.device_depth import device_depth
from tests.support.truth.picture import fresh, outdoors, paint_picture, painted
from tests.support.truth.range import measure_depth
from tests.support.truth.scenes import TruthScene

#: Shortest visible piece of an edge in view, and margin from the border of a picture 640 px wide [px].
_SHORTEST_PX, _MARGIN_PX = 40.0, 8.0
#: Points along an edge for the test of its visibility.
_STEPS = 200


@dataclass(frozen=True, kw_only=True)
class TrueLine:
    """The exact position of an edge."""

    rho: float  # distance from the image centre, normalised
    theta: float  # angle of the normal [rad]
    pixels: np.ndarray  # ends of its visible piece [px], (2, 2); empty below the shortest piece


@dataclass(frozen=True, kw_only=True)
class TruthFrame:
    """A rendered frame and the truth."""

    frame: RgbdFrame  # the pictures
    edges: dict[str, TrueLine]  # edges of the board in view by name (top, bottom, left, right)
    strokes: dict[str, TrueLine]  # upper and lower edge of every stroke in view, as "0 top", "0 bottom", ..
    plane: np.ndarray  # (a, b, c) of 1/Z = a x + b y + c of the board
    seed: tuple[float, float]  # (u, v) of a point on the board [px]
    mask: np.ndarray  # pixels that the vehicle covers, bool (H, W)
    raw: RgbdFrame | None = (
        None  # raw frame of the device: distorted, depth in its own picture; None for an ideal camera
    )


def render_frame(
    scene: TruthScene, stamp_ns: int = 0, noise_seed: int | None = None, plain: np.ndarray | None = None
) -> TruthFrame:
    """Render a scene.

    Args:
        scene: The scene.
        stamp_ns: Time of capture.
        noise_seed: Seed of the noise for frames of one sequence; None takes the seed of the scene.
        plain: Its `plain_picture`, if it is known.

    Raises:
        ValueError: For the vehicle's arm in the picture of a device: it is drawn in registered pictures only.
    """
    if scene.arm and scene.device is not None:
        raise ValueError("a device takes no picture with the arm")
    rng = np.random.default_rng(np.random.SeedSequence([scene.seed if noise_seed is None else noise_seed, 0x6E6F]))
    width, height, _ = scene.camera
    outside = outdoors(scene)
    rgb = paint_picture(scene, rng, outside, plain)
    mask, layer = np.zeros((height, width), bool), None
    if scene.arm:
        flight = Scene(camera=CameraScene(width=width, height=height))
        layer = vehicle_layer(flight, VehicleParams(), scene.intrinsics, rng)
        mask = layer.mask > 0
        rgb[mask] = layer.picture[mask, :3]
    frame, raw = None, None
    if scene.device is None:
        depth = measure_depth(scene, _inverse_depths(scene), rng)
    else:
        depth = device_depth(scene, scene.device, rng)
        raw = RgbdFrame(rgb=rgb, depth=depth, intrinsics=scene.intrinsics, stamp_ns=stamp_ns)
        frame = RgbdCamera(scene.device.settings).picture(raw)
    if outside is not None and fresh(scene):
        depth.reshape(-1)[outside.holes(painted(scene))] = 0.0
    if layer is not None:
        depth[mask] = 1.0 / layer.inverse_depth[mask]
        depth[(layer.holes > 0) & ~mask] = 0.0
    half_w, half_h = 0.5 * scene.size_m[0], 0.5 * scene.size_m[1]
    corners = {
        "top": ((-half_w, -half_h), (half_w, -half_h)),
        "bottom": ((-half_w, half_h), (half_w, half_h)),
        "left": ((-half_w, -half_h), (-half_w, half_h)),
        "right": ((half_w, -half_h), (half_w, half_h)),
    }
    edges = {name: true_line(scene, *ends, mask) for name, ends in corners.items()}
    strokes: dict[str, TrueLine] = {}
    for number, ((left, top, right, bottom), _) in enumerate(scene.strokes):
        strokes[f"{number} top"] = true_line(scene, (left, top), (right, top), mask)
        strokes[f"{number} bottom"] = true_line(scene, (left, bottom), (right, bottom), mask)
    return TruthFrame(
        frame=frame or RgbdFrame(rgb=rgb, depth=depth, intrinsics=scene.intrinsics, stamp_ns=stamp_ns),
        raw=raw,
        edges={name: line for name, line in edges.items() if len(line.pixels)},
        strokes={name: line for name, line in strokes.items() if len(line.pixels)},
        plane=plane_of(scene, 0.0),
        seed=_seed(scene, mask),
        mask=mask,
    )


def plane_of(scene: TruthScene, behind_m: float) -> np.ndarray:
    """(a, b, c) of the plane `behind_m` behind the board."""
    normal = scene.rotation[:, 2]
    return normal / float(normal @ (scene.translation + behind_m * normal))


def project(scene: TruthScene, points: np.ndarray) -> np.ndarray:
    """Pixels of board points (right, down) [m], (..., 2)."""
    at = points @ scene.rotation[:, :2].T + scene.translation
    fx, fy, cx, cy = scene.intrinsics
    return at[..., :2] / at[..., 2:] * (fx, fy) + (cx, cy)


def true_line(scene: TruthScene, first: tuple[float, float], second: tuple[float, float], mask: np.ndarray) -> TrueLine:
    """The line through two points of the board, exact in (rho, theta)."""
    rays = np.array([first, second]) @ scene.rotation[:, :2].T + scene.translation
    a, b, c = np.cross(rays[0], rays[1])
    length = math.hypot(a, b)
    fraction = np.linspace(0.0, 1.0, _STEPS)[:, None]
    pixels = project(scene, np.array(first) + fraction * (np.array(second) - np.array(first)))
    height, width = mask.shape
    margin = _MARGIN_PX * width / 640.0
    inside = (pixels[:, 0] > margin) & (pixels[:, 0] < width - 1 - margin)
    inside &= (pixels[:, 1] > margin) & (pixels[:, 1] < height - 1 - margin)
    at = np.clip(np.rint(pixels), 0, (width - 1, height - 1)).astype(np.intp)
    visible = pixels[inside & ~mask[at[:, 1], at[:, 0]]]
    long = len(visible) > 1 and np.hypot(*(visible[-1] - visible[0])) > _SHORTEST_PX * width / 640.0
    return TrueLine(rho=-c / length, theta=math.atan2(b, a), pixels=visible[[0, -1]] if long else np.zeros((0, 2)))


def _inverse_depths(scene: TruthScene) -> tuple[np.ndarray, np.ndarray]:
    """1/Z of board and wall at every pixel, (H, W) each."""
    width, height, _ = scene.camera
    fx, fy, cx, cy = scene.intrinsics
    x, y = np.meshgrid((np.arange(width) - cx) / fx, (np.arange(height) - cy) / fy)
    board, wall = ((p[0] * x + p[1] * y + p[2]) for p in (plane_of(scene, 0.0), plane_of(scene, scene.gap_m)))
    return board, wall


def _seed(scene: TruthScene, mask: np.ndarray) -> tuple[float, float]:
    """A point on the board in view: of a grid the one nearest to the middle of the picture."""
    half = 0.5 * np.array(scene.size_m)
    grid = np.linspace(-0.7, 0.7, 15)
    pixels = project(scene, np.stack(np.meshgrid(grid * half[0], grid * half[1]), axis=-1).reshape(-1, 2))
    height, width = mask.shape
    inside = (pixels > 20.0).all(axis=1) & (pixels < (width - 20, height - 20)).all(axis=1)
    pixels = pixels[inside]
    free = ~mask[np.rint(pixels[:, 1]).astype(int), np.rint(pixels[:, 0]).astype(int)]
    pixels = pixels[free]
    best = np.argmin(np.linalg.norm(pixels - 0.5 * np.array([width, height]), axis=1))
    return float(pixels[best, 0]), float(pixels[best, 1])
