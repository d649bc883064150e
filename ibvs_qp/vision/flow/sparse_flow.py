"""Velocity from sparse optical flow, depth and gyro, with a covariance that admits what was not seen."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA
from ibvs_qp.vision.config import FlowConfig
from ibvs_qp.vision.flow.solve_velocity import (
    FlowSurface,
    FlowVelocity,
    expected_points,
    half_resolution,
    information_root,
    inverse_depths,
    solve_velocity,
    unturned,
)
from ibvs_qp.vision.picture.mask import Intrinsics
from ibvs_qp.vision.surface.plane import PlaneEstimate

#: Pyramid levels beyond the first, needed only where the last velocity does not say where the points are.
_LEVELS = 2
#: Most points lie this near to where they were expected [px]: then one level finds them as well as three, to 2e-3 px.
_NEAR_PX, _MOST = 1.5, 0.8
#: Points expected farther off than this share of the picture start where they were: the gyro must be wrong.
_FAR = 0.25
#: When following a point ends: rounds, step [px].
_CRITERIA = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 15, 0.01)


class SparseFlow:
    """Follows points from picture to picture at half resolution."""

    def __init__(self, config: FlowConfig) -> None:
        """Take the settings; no picture yet."""
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Forget the last picture and its points."""
        self._grey: np.ndarray | None = None
        self._velocity: np.ndarray | None = None
        self._points, self._bearings = np.zeros((0, 2), np.float32), np.zeros((0, 2))
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
        camera_rotation: np.ndarray,
        plane: PlaneEstimate | None,
        camera_position: np.ndarray,
        busy: bool = False,
    ) -> FlowVelocity | str:
        """Take the next picture.

        Args:
            rgb: Colour, uint8 (H, W, 3).
            depth: Depth [m], (H, W).
            excluded: uint8 (H/2, W/2), non-zero where no points may lie.
            intrinsics: Of the full picture [px].
            stamp_ns: Capture time.
            rotation: Turn of the body since the picture before, in B [rad], (3,).
            camera_rotation: The same turn as a matrix in camera frames, now to before, (3, 3).
            plane: The surface in this picture, or None.
            camera_position: Camera centre in B [m], (3,).
            busy: Whether the renewal of live points shall wait for the next picture: this one has cost much.

        Returns:
            The velocity, or the reason why there is none.
        """
        result = self._velocity_of(rgb, excluded, intrinsics, stamp_ns, rotation, camera_rotation, camera_position)
        surface = None if plane is None else FlowSurface(plane.inverse_depth, plane.residual_sigma)
        self._prepare_points(depth, excluded, intrinsics, surface, busy)
        return result

    def _velocity_of(
        self,
        rgb: np.ndarray,
        excluded: np.ndarray,
        intrinsics: Intrinsics,
        stamp_ns: int,
        rotation: np.ndarray,
        camera_rotation: np.ndarray,
        camera_position: np.ndarray,
    ) -> FlowVelocity | str:
        """First half of `update`: the velocity, from the points of the picture before."""
        config, half = self._config, half_resolution(intrinsics)
        rows, columns = rgb.shape[0] // 2, rgb.shape[1] // 2
        whole = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)  # grey first: one channel is shrunk eight times as fast as three
        grey = cv2.resize(whole[: 2 * rows, : 2 * columns], (columns, rows), interpolation=cv2.INTER_AREA)
        interval = (stamp_ns - self._stamp_ns) * 1e-9
        result: FlowVelocity | str = "first picture"
        if self._grey is not None and grey.shape == self._grey.shape:
            if not 0.0 < interval <= config.interval_max_s:
                self._keep(np.zeros(0, np.intp))
                result = f"{interval:.3f} s between pictures"
            elif len(self._points) < config.min_points:
                result = "too few points: nothing to follow"
            else:
                result = self._follow(
                    self._grey, grey, excluded, half, interval, rotation, camera_rotation, camera_position
                )
        self._velocity = None
        if isinstance(result, FlowVelocity):
            self._velocity = R_BODY_CAMERA.T @ result.velocity
            middle = self._stamp_ns + (stamp_ns - self._stamp_ns) // 2
            result = FlowVelocity(
                velocity=result.velocity, covariance=result.covariance, stamp_ns=middle, points=result.points
            )
        self._grey, self._stamp_ns = grey, stamp_ns
        return result

    def _prepare_points(
        self,
        depth: np.ndarray,
        excluded: np.ndarray,
        intrinsics: Intrinsics,
        surface: FlowSurface | None,
        busy: bool,
    ) -> None:
        """Second half of `update`: makes the points of the followed picture ready for the next one."""
        config = self._config
        assert self._grey is not None
        self._frames += 1
        if len(self._points) < config.points_low or (self._frames >= config.redetect and not busy):
            self._find(self._grey, excluded, half_resolution(intrinsics))
        self._inverse = inverse_depths(self._bearings, depth, intrinsics, surface)

    def _find(self, grey: np.ndarray, excluded: np.ndarray, half: Intrinsics) -> None:
        """New points where the picture has structure, with the information each carries."""
        config, self._frames = self._config, 0
        allowed = (excluded == 0).view(np.uint8)
        corners = cv2.goodFeaturesToTrack(
            grey, config.points, config.quality, config.spacing_px, mask=allowed, blockSize=5
        )
        self._points = np.zeros((0, 2), np.float32) if corners is None else corners.reshape(-1, 2)
        self._bearings = (self._points - half[2:]) / half[:2]
        self._root = information_root(grey, self._points, config)

    def _keep(self, chosen: np.ndarray) -> None:
        """Forget all points but the chosen ones."""
        self._points, self._bearings = self._points.take(chosen, axis=0), self._bearings.take(chosen, axis=0)
        self._root, self._inverse = self._root.take(chosen, axis=0), self._inverse.take(chosen)

    def _follow(
        self,
        last: np.ndarray,
        grey: np.ndarray,
        excluded: np.ndarray,
        half: Intrinsics,
        interval: float,
        rotation: np.ndarray,
        camera_rotation: np.ndarray,
        camera_position: np.ndarray,
    ) -> FlowVelocity | str:
        config = self._config
        still = unturned(self._bearings, camera_rotation)
        velocity = np.zeros(3) if self._velocity is None else self._velocity
        start = expected_points(still, self._inverse, velocity, interval, half)
        near = np.abs(start - self._points) < _FAR * grey.shape[1]  # false for what is not a number
        start = start if near.all() else np.where(near, start, self._points)
        self._points, status = self._search(last, grey, start, self._velocity is not None)
        height, width = grey.shape
        column, row = np.rint(self._points).astype(np.intp).T
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height) & (status.reshape(-1) == 1)
        alive = np.flatnonzero(inside)
        alive = alive[excluded.reshape(-1).take(row[alive] * width + column[alive]) == 0]
        self._bearings = (self._points - half[2:]) / half[:2]
        self._keep(alive)
        known = np.flatnonzero(self._inverse > 0)
        if len(known) < config.min_points:
            return "too few points with depth"
        return solve_velocity(
            still.take(alive[known], axis=0),
            self._bearings.take(known, axis=0),
            self._inverse.take(known),
            self._root.take(known, axis=0),
            half[0],
            interval,
            rotation,
            camera_position,
            config,
        )

    def _search(
        self, last: np.ndarray, grey: np.ndarray, start: np.ndarray, expected: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """The points in this picture, searched from a start, and whether each was found."""
        found, status = self._lucas_kanade(last, grey, start, 0 if expected else _LEVELS)
        near = (np.abs(found - start) < _NEAR_PX).all(axis=1)
        if expected and np.count_nonzero(near) < _MOST * len(start):
            found, status = self._lucas_kanade(last, grey, start, _LEVELS)
        return found, status

    def _lucas_kanade(
        self, last: np.ndarray, grey: np.ndarray, start: np.ndarray, levels: int
    ) -> tuple[np.ndarray, np.ndarray]:
        found, status, _ = cv2.calcOpticalFlowPyrLK(
            last,
            grey,
            self._points,
            start.copy(),  # the search writes into it
            winSize=(self._config.window_px, self._config.window_px),
            maxLevel=levels,
            criteria=_CRITERIA,
            flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        )
        return found, status
