"""The depth picture of a truth scene: noise, holes along steps, steps shifted outwards as by depth cameras."""

from __future__ import annotations

import cv2
import numpy as np

from sim.sensors.cameras.noise import DEPTH_COMMON_SIGMA_M, DEPTH_CORRELATION_PX
from tests.support.truth.scenes import TruthScene

#: Widest hole along a step [px] and length over which its width changes [px].
_HOLE_PX, _HOLE_STEP_PX = 4, 6


def measure_depth(scene: TruthScene, inverse: tuple[np.ndarray, np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """Depth [m], float32 (H, W), 0 where there is no reading.

    Args:
        scene: For outline and noise.
        inverse: 1/Z of board and wall at every pixel [1/m], (H, W) each.
        rng: Source of the noise.
    """
    board, wall = inverse
    outline = _outline(scene)
    shape = outline.shape
    if scene.smear_px > 0.0:  # the nearer surface grows by a varying width
        patches = cv2.GaussianBlur(rng.standard_normal(shape, np.float32), (0, 0), 25.0)
        reach = np.clip(0.5 + patches / (4.0 * float(patches.std())), 0.0, 1.0) * scene.smear_px
        beyond = cv2.distanceTransform((~outline).astype(np.uint8), cv2.DIST_L2, 5)
        outline = beyond <= reach
    white = rng.standard_normal(shape, np.float32)
    soft = cv2.GaussianBlur(rng.standard_normal(shape, np.float32), (0, 0), 0.5 * DEPTH_CORRELATION_PX)
    factor = 1.0 + scene.depth_noise * (white + soft / float(soft.std()))
    depth = np.where(outline, 1.0 / board, 1.0 / np.maximum(wall, 1e-3)) * factor
    depth = depth + rng.normal(0.0, DEPTH_COMMON_SIGMA_M)
    width = cv2.resize(
        rng.uniform(0.0, _HOLE_PX, (shape[0] // _HOLE_STEP_PX + 1, shape[1] // _HOLE_STEP_PX + 1)).astype(np.float32),
        (shape[1], shape[0]),
        interpolation=cv2.INTER_NEAREST,
    )
    beyond = cv2.distanceTransform((~outline).astype(np.uint8), cv2.DIST_L2, 5)
    depth[(beyond > 0.0) & (beyond <= width)] = 0.0
    return np.where(depth > 0.0, depth, 0.0).astype(np.float32)


def _outline(scene: TruthScene) -> np.ndarray:
    """Pixels with their middle on the board, bool (H, W)."""
    width, height, _ = scene.camera
    fx, fy, cx, cy = scene.intrinsics
    x, y = (np.arange(width) - cx) / fx, (np.arange(height) - cy) / fy
    inside = np.ones((height, width), bool)
    for a, b, c in scene.edge_planes(scene.corners):
        inside &= (a * x)[None] + (b * y + c)[:, None] > 0.0
    return inside
