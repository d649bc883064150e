"""Velocity from sparse optical flow, depth and gyro, with a covariance that admits what was not seen."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.vision.config import FlowConfig
from ibvs_qp.vision.flow_solve import FlowVelocity, half_resolution, information_root, inverse_depths, solve_velocity
from ibvs_qp.vision.mask import Intrinsics
from ibvs_qp.vision.plane import PlaneEstimate

#: Pyramid levels beyond the first.
_LEVELS = 2


class SparseFlow:
    """Follows points from picture to picture at half resolution."""

    def __init__(self, config: FlowConfig) -> None:
        """Take the settings; no picture yet."""
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Forget the last picture and its points."""
        self._pyramid: tuple[np.ndarray, ...] | None = None
        self._points = np.zeros((0, 2), np.float32)
        self._root = np.zeros((0, 2, 2))
        self._inverse = np.zeros(0)
        self._frames = 0
        self._stamp_ns = 0

    def update(
        self,
        rgb: np.ndarray,
        depth: np.ndarray,
        excluded: np.ndarray,
        intrinsics: Intrinsics,
        stamp_ns: int,
        rotation: np.ndarray,
        plane: PlaneEstimate | None,
        camera_position: np.ndarray,
    ) -> FlowVelocity | str:
        """Take the next picture.

        Args:
            rgb: Colour, uint8 (H, W, 3).
            depth: Depth [m], (H, W).
            excluded: uint8 (H/2, W/2), non-zero where no points may lie.
            intrinsics: Of the full picture [px].
            stamp_ns: Capture time.
            rotation: Turn of the body since the picture before, in B [rad], (3,).
            plane: The surface in this picture, or None.
            camera_position: Camera centre in B [m], (3,).

        Returns:
            The velocity, or the reason why there is none.
        """
        config = self._config
        grey = cv2.cvtColor(
            cv2.resize(rgb, (rgb.shape[1] // 2, rgb.shape[0] // 2), interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2GRAY
        )
        window = (config.window_px, config.window_px)
        _, pyramid = cv2.buildOpticalFlowPyramid(grey, window, _LEVELS)
        interval = (stamp_ns - self._stamp_ns) * 1e-9
        result: FlowVelocity | str = "first picture"
        if self._pyramid is not None and pyramid[0].shape == self._pyramid[0].shape:
            if not 0.0 < interval <= config.interval_max_s:
                self._points = self._points[:0]
                result = f"{interval:.3f} s between pictures"
            elif len(self._points) < config.min_points:
                result = "too few points: nothing to follow"
            else:
                result = self._follow(tuple(pyramid), excluded, intrinsics, interval, rotation, camera_position)
        if isinstance(result, FlowVelocity):
            middle = self._stamp_ns + (stamp_ns - self._stamp_ns) // 2
            result = FlowVelocity(
                velocity=result.velocity, covariance=result.covariance, stamp_ns=middle, points=result.points
            )
        self._frames += 1
        if len(self._points) < config.points_low or self._frames >= config.redetect:
            self._find(grey, excluded)
        self._inverse = inverse_depths(self._points, depth, intrinsics, plane)
        self._pyramid, self._stamp_ns = tuple(pyramid), stamp_ns
        return result

    def _find(self, grey: np.ndarray, excluded: np.ndarray) -> None:
        """New points where the picture has structure, with the information each carries."""
        config, self._frames = self._config, 0
        allowed = np.where(excluded == 0, np.uint8(255), np.uint8(0))
        corners = cv2.goodFeaturesToTrack(
            grey, config.points, config.quality, config.spacing_px, mask=allowed, blockSize=5
        )
        self._points = np.zeros((0, 2), np.float32) if corners is None else corners.reshape(-1, 2)
        self._root = information_root(grey, self._points, config)

    def _follow(
        self,
        pyramid: tuple[np.ndarray, ...],
        excluded: np.ndarray,
        intrinsics: Intrinsics,
        interval: float,
        rotation: np.ndarray,
        camera_position: np.ndarray,
    ) -> FlowVelocity | str:
        config = self._config
        window = (config.window_px, config.window_px)
        assert self._pyramid is not None
        criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 15, 0.01)
        moved, status, _ = cv2.calcOpticalFlowPyrLK(
            self._pyramid[0],
            pyramid[0],
            self._points,
            self._points.copy(),
            winSize=window,
            maxLevel=_LEVELS,
            criteria=criteria,
        )
        height, width = pyramid[0].shape
        place = np.round(moved).astype(np.intp)
        alive = (
            (status.ravel() == 1)
            & (place[:, 0] >= 0)
            & (place[:, 0] < width)
            & (place[:, 1] >= 0)
            & (place[:, 1] < height)
        )
        alive[alive] &= excluded[place[alive, 1], place[alive, 0]] == 0
        before, now, inverse, root = (
            self._points[alive],
            moved[alive],
            self._inverse[alive],
            self._root[alive],
        )
        self._points, self._root = now, root
        known = inverse > 0
        if int(known.sum()) < config.min_points:
            return "too few points with depth"
        half = half_resolution(intrinsics)
        return solve_velocity(
            before[known],
            now[known],
            inverse[known],
            root[known],
            half,
            interval,
            rotation,
            camera_position,
            config,
        )
