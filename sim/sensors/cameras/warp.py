"""Geometry of a real picture: lens distortion, and rows that are exposed in sequence."""

from __future__ import annotations

import cv2
import numpy as np

from sim.sensors.image_motion import image_velocity

#: Distance of the nodes between which the map is interpolated: errs by 0.01 px at k1 = 0.05 [px].
_NODE_PX = 16
#: Second part of a map that has but one.
_ONE_PART = np.empty(0, np.float32)


class PictureWarp:
    """Map from the pixels of the real picture to those of the ideal one, which the camera drew at the stamp.

    A row shows the board's plane from the pose at the row's own time: the points have moved by their image velocity
    times that time. One warp costs less than drawing bands at their own poses, and serves every back end.

    Args:
        intrinsics: (fx, fy, cx, cy) [px].
        shape: (height, width) of the picture [px].
        distortion_k1: Radial distortion left after rectification, x' = x (1 + k1 r^2).
        readout_s: First to last row [s]; the middle row is exposed at the stamp.
    """

    def __init__(
        self,
        intrinsics: tuple[float, float, float, float],
        shape: tuple[int, int],
        distortion_k1: float,
        readout_s: float,
    ) -> None:
        self._shape, self._readout_s = shape, readout_s
        self._focal, self._center = np.array(intrinsics[:2]), np.array(intrinsics[2:])
        height, width = shape
        # Nodes start one cell before the picture: OpenCV's resize puts pixel j at node (j + 0.5) / cell - 0.5.
        v, u = (np.mgrid[: height // _NODE_PX + 3, : width // _NODE_PX + 3] - 0.5) * _NODE_PX - 0.5
        matrix = np.array([[self._focal[0], 0.0, self._center[0]], [0.0, self._focal[1], self._center[1]], [0, 0, 1.0]])
        seen = np.stack((u, v), axis=-1).reshape(-1, 1, 2)
        ideal = cv2.undistortPoints(seen, matrix, np.array([distortion_k1, 0.0, 0.0, 0.0]))
        self._ideal = ideal.reshape(*u.shape, 2)
        self._row_time = ((v - self._center[1]) / (height - 1) * readout_s)[..., None]
        # Written at every picture: fresh memory of this size costs as much as the arithmetic.
        self._nodes = np.empty((u.shape[0] * _NODE_PX, u.shape[1] * _NODE_PX, 2), np.float32)
        self._moving = np.empty((height, width, 2), np.int16), np.empty((height, width), np.uint16)
        self._warped = np.empty((height, width, 3), np.uint8)
        self._lens = None
        if distortion_k1:
            self._lens = cv2.convertMaps(self._dense(self._ideal, np.zeros(2)), _ONE_PART, cv2.CV_16SC2)

    def picture(self, picture: np.ndarray, plane: np.ndarray, twist: np.ndarray | None) -> np.ndarray:
        """The picture, uint8 (H, W, 3), as lens and shutter show it; unchanged without both.

        A warped picture holds until the next call.

        Args:
            picture: The ideal one.
            plane: (a, b, c) of the board, 1/Z = a x + b y + c [1/m].
            twist: Of the camera in its axes [m/s, rad/s], (6,), or None at rest.
        """
        maps = self._lens
        if self._readout_s and twist is not None:
            x, y = self._ideal[..., 0], self._ideal[..., 1]
            shifted = self._ideal - self._row_time * np.stack(image_velocity(x, y, plane, twist), axis=-1)
            maps = cv2.convertMaps(self._dense(shifted, np.zeros(2)), _ONE_PART, cv2.CV_16SC2, *self._moving)
        if maps is None:
            return picture
        return cv2.remap(picture, *maps, cv2.INTER_LINEAR, self._warped, cv2.BORDER_REPLICATE)

    def layer(self, layer: np.ndarray) -> np.ndarray:
        """A layer fixed to the camera, uint8 (H, W) or (H, W, C), as the lens shows it; from the nearest pixels."""
        return nearest_remap(layer, self.nearest(np.zeros(2)), cv2.BORDER_REPLICATE)

    def nearest(self, shift_px: np.ndarray) -> np.ndarray | None:
        """Map of a shifted layer for `nearest_remap`, int16 (H, W, 2), or None where nothing moves.

        Args:
            shift_px: To the right and down, (2,).
        """
        if self._lens is None and not np.any(shift_px):
            return None
        return cv2.convertMaps(self._dense(self._ideal, shift_px), _ONE_PART, cv2.CV_16SC2, nninterpolation=True)[0]

    def _dense(self, ideal: np.ndarray, shift_px: np.ndarray) -> np.ndarray:
        nodes = (ideal * self._focal + self._center - shift_px).astype(np.float32)
        height, width = self._shape
        cv2.resize(nodes, self._nodes.shape[1::-1], self._nodes, interpolation=cv2.INTER_LINEAR)
        return self._nodes[_NODE_PX : _NODE_PX + height, _NODE_PX : _NODE_PX + width]


def nearest_remap(layer: np.ndarray, places: np.ndarray | None, border: int) -> np.ndarray:
    """A layer, (H, W) or (H, W, C), from the nearest pixels of a map; itself without one.

    Args:
        layer: Whose values must not mix.
        places: Of `PictureWarp.nearest`.
        border: OpenCV's rule beyond the picture; the constant one gives zero.
    """
    return layer if places is None else cv2.remap(layer, places, _ONE_PART, cv2.INTER_NEAREST, borderMode=border)
