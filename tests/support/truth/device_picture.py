"""The colour picture of a device: its lens and the rows of its shutter, as places in the ideal picture."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.vision.picture.camera import Lens
from sim.sensors.image_motion import image_velocity
from tests.support.truth.scenes import TruthScene


def through_device(picture: np.ndarray, scene: TruthScene, times: int) -> np.ndarray:
    """An ideal picture as lens and rolling shutter show it, of the same size and type.

    Args:
        picture: Without noise, with `times` subpixels per pixel and side, (times H, times W, 3).
        scene: Camera, device, and the motion of the camera.
        times: Subpixels.
    """
    device = scene.device
    assert device is not None
    height, width = picture.shape[:2]
    rows, columns = np.mgrid[:height, :width]
    pixels = np.stack(((columns + 0.5) / times - 0.5, (rows + 0.5) / times - 0.5), axis=-1).reshape(-1, 2)
    fx, fy, cx, cy = scene.intrinsics
    points = Lens(device.distortion).ideal(pixels, scene.intrinsics)
    if any(scene.twist):
        normal = scene.rotation[:, 2]
        plane = normal / float(normal @ scene.translation)
        after_s = (pixels[:, 1] - cy) / (scene.camera[1] - 1) * device.readout_s
        velocity = image_velocity(points[:, 0], points[:, 1], plane, scene.twist)
        points = points - after_s[:, None] * np.stack(velocity, axis=-1)
    columns, rows = ((points * (fx, fy) + (cx, cy) + 0.5) * times - 0.5).astype(np.float32).T.reshape(2, height, width)
    return cv2.remap(picture, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def exposure_gain(scene: TruthScene, rng: np.random.Generator) -> float:
    """Brightness of one picture: the automatic exposure is right, or one step off."""
    assert scene.device is not None
    return 1.0 + scene.device.exposure_step * float(rng.integers(-1, 2))
