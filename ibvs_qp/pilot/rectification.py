"""Pictures of a turned camera with a distorting lens, as an ideal one that looks along +x takes them."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np

from ibvs_qp.estimation.turned_camera import TurnedCamera
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.pilot.config import CameraConfig
from ibvs_qp.vision.checks import PictureGate

#: Least depth of a ray of the real camera per depth in C [-]: the others come from beside or behind it.
LEAST_DEPTH = 0.1


class Rectification:
    r"""Rotates and undistorts pictures: the ray of every pixel is looked up in the real picture.

    The pixel of the ray :math:`r` in C shows what the real camera sees along :math:`R^T r`, bent by its lens; a depth z
    of the real picture is :math:`z / (R^T r)_z` in C, with r scaled to a depth of 1. Beyond the border of the real
    picture the colour of the border goes on, so that no edge is added, and the depth is invalid.

    Args:
        camera: Mount of the real camera.
        settings: Distortion of its lens.
    """

    def __init__(self, camera: TurnedCamera, settings: CameraConfig) -> None:
        self._rotation, self._distortion = camera.rotation, np.array(settings.distortion, float)
        self.none = camera.straight and not self._distortion.any()
        self._gate = PictureGate()
        self._key: tuple[tuple[int, int], tuple[float, ...]] | None = None
        self._maps: tuple[np.ndarray, ...] = ()

    def reset(self) -> None:
        """As before the first picture; the tables of its camera stay."""
        self._gate.reset()

    def picture(self, frame: RgbdFrame) -> RgbdFrame:
        """The rectified picture; one that perception refuses is passed on as it is."""
        if self.none or self._gate.problem(frame) is not None:
            return frame
        horizontal, vertical, depth_ratio = self._tables(frame.depth.shape, tuple(frame.intrinsics))
        rgb = cv2.remap(frame.rgb, horizontal, vertical, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        depth = cv2.remap(
            frame.depth.astype(np.float32, copy=False), horizontal, vertical, cv2.INTER_NEAREST, borderValue=0
        )
        return dataclasses.replace(frame, rgb=rgb, depth=depth * depth_ratio)

    def _tables(self, shape: tuple[int, int], intrinsics: tuple[float, ...]) -> tuple[np.ndarray, ...]:
        """Column and row in the real picture, and depth in C per depth there, of every pixel, (H, W) each."""
        if self._key != (shape, intrinsics):
            fx, fy, cx, cy = intrinsics
            matrix = np.array(((fx, 0.0, cx), (0.0, fy, cy), (0.0, 0.0, 1.0)))
            size = shape[1], shape[0]
            horizontal, vertical = cv2.initUndistortRectifyMap(
                matrix, self._distortion, self._rotation, matrix, size, cv2.CV_32FC1
            )
            x = (np.arange(shape[1]) - cx) / fx
            y = (np.arange(shape[0])[:, None] - cy) / fy
            a, b, c = self._rotation.T[2]
            depth = (a * x + b * y + c).astype(np.float32)
            horizontal[depth < LEAST_DEPTH] = -np.inf
            self._key = shape, intrinsics
            self._maps = horizontal, vertical, 1.0 / np.maximum(depth, np.float32(LEAST_DEPTH))
        return self._maps
