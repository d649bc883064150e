"""The depth picture of a device: its own pose and lens, noise of the disparity, holes beside edges, whole steps."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.frames import rotation_from_vector
from ibvs_qp.vision.picture.camera import Lens
from tests.support.truth.devices import Device
from tests.support.truth.scenes import TruthScene

#: Length along an edge over which the width of a hole, or the growth of a surface, changes [px].
_EDGE_STEP_PX, _GROWTH_STEP_PX = 6, 20.0


def device_depth(scene: TruthScene, device: Device, rng: np.random.Generator) -> np.ndarray:
    """Depth in steps of the device, uint16 (h, w), 0 where there is no reading."""
    width, height, focal = device.depth_camera
    to_depth = rotation_from_vector(device.depth_rotation).T
    rotation = to_depth @ scene.rotation
    origin = to_depth @ (scene.translation - np.array(device.depth_translation_m))
    rows, columns = np.mgrid[:height, :width]
    pixels = np.stack((columns, rows), axis=-1).reshape(-1, 2)
    rays = Lens(device.depth_distortion).rays(pixels, device.depth_intrinsics)
    normal = rotation[:, 2]
    board, wall = (
        (rays @ (normal / float(normal @ (origin + behind * normal)))).reshape(height, width)
        for behind in (0.0, scene.gap_m)
    )
    outline = _outline(rays, rotation[:, :2], origin, scene.corners).reshape(height, width)
    grown = _grown(outline, device.fattening_px, rng)
    inverse = np.where(grown, board, np.maximum(wall, 1e-3))
    disparity = focal * device.baseline_m * inverse + device.subpixel * _noise((height, width), device, rng)
    if device.disparity_step_px:
        disparity = np.rint(disparity / device.disparity_step_px) * device.disparity_step_px
    steps = focal * device.baseline_m / np.maximum(disparity, 1e-3) / device.depth_step_m
    steps[_holes(grown, focal * device.baseline_m * (board - wall), device, rng)] = 0.0
    return np.where((steps > 0.0) & (steps < 65535.0), np.rint(steps), 0.0).astype(np.uint16)


def _outline(rays: np.ndarray, axes: np.ndarray, origin: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Rays through the board, bool (n,)."""
    ends = corners @ axes.T + origin
    inside = np.ones(len(rays), bool)
    for first, second in zip(ends, np.roll(ends, -1, axis=0), strict=True):
        inside &= rays @ np.cross(first, second) > 0.0
    return inside


def _grown(outline: np.ndarray, most_px: float, rng: np.random.Generator) -> np.ndarray:
    """The outline grown by a width that changes along it."""
    patches = cv2.GaussianBlur(rng.standard_normal(outline.shape, np.float32), (0, 0), _GROWTH_STEP_PX)
    reach = np.clip(0.5 + patches / (4.0 * float(patches.std())), 0.0, 1.0) * most_px
    return cv2.distanceTransform((~outline).astype(np.uint8), cv2.DIST_L2, 5) <= reach


def _noise(shape: tuple[int, int], device: Device, rng: np.random.Generator) -> np.ndarray:
    """Errors of the disparity with standard deviation 1, alike over the matcher's window, (h, w)."""
    soft = cv2.GaussianBlur(rng.standard_normal(shape, np.float32), (0, 0), 0.5 * device.correlation_px)
    return soft / float(soft.std())


def _holes(near: np.ndarray, step_px: np.ndarray, device: Device, rng: np.random.Generator) -> np.ndarray:
    """Pixels without a reading beside the board: the shadow of the second eye, and lost ones on the other side.

    Args:
        near: The board, bool (h, w).
        step_px: Disparity of the board less that of the wall, (h, w): the width of the shadow.
        device: Side and widths.
        rng: Of the widths on the other side.
    """
    rows, columns = near.shape
    shape = (rows // _EDGE_STEP_PX + 1, columns // _EDGE_STEP_PX + 1)
    coarse = rng.uniform(0.0, device.other_hole_px, shape).astype(np.float32)
    other = cv2.resize(coarse, (columns, rows), interpolation=cv2.INTER_NEAREST)
    holes = cv2.distanceTransform((~near).astype(np.uint8), cv2.DIST_L2, 5) <= other
    shadow = np.zeros_like(near)
    for shift in range(1, int(np.ceil(step_px.max())) + 1):
        beside = np.zeros_like(near)  # a board lies `shift` px towards the inner side
        if device.shadow_side < 0:
            beside[:, :-shift] = near[:, shift:]
        else:
            beside[:, shift:] = near[:, :-shift]
        shadow |= beside & (shift <= step_px)
    return (holes | shadow) & ~near
