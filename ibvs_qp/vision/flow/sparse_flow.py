"""Velocity from sparse optical flow, depth and gyro, with a covariance that is large without visible features."""

from __future__ import annotations

import dataclasses
import math

import cv2
import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.compilation import inner, kernel
from ibvs_qp.vision.config import FlowConfig
from ibvs_qp.vision.flow.motion import CameraMotion
from ibvs_qp.vision.flow.velocity import FlowVelocity, solve_velocity
from ibvs_qp.vision.medians import upper_median
from ibvs_qp.vision.picture.layout import Intrinsics
from ibvs_qp.vision.surface.plane import PlaneEstimate

#: Pyramid levels beyond the first, needed only where the last velocity does not predict the points.
_LEVELS = 2
#: Most points lie this near to where they were expected [px]: then one level finds them as well as three, to 2e-3 px.
_NEAR_PX, _MOST = 1.5, 0.8
#: Points expected farther off than this fraction of the picture start where they were: the gyro must be wrong.
_FAR = 0.25
#: When following a point ends: rounds, step [px].
_CRITERIA = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 15, 0.01)

#: A point within this many residual sigmas of the surface takes the surface's depth, which is far less noisy, and the
#: least gate, fraction of 1/Z.
_ON_PLANE_SIGMAS, _ON_PLANE = 4.0, 0.01
#: Sum of squares of a 3x3 Sobel kernel, and the square of its scale: its weights are eight times those of a derivative.
_SOBEL_NOISE, _SOBEL = 12.0, 64.0
#: Distance of the four further places at which the depth of a point is read, and how many must be valid [px].
_CROSS_PX, _READINGS = 2, 3
_NO_SURFACE = np.empty(0)


class SparseFlow:
    """Follows points from picture to picture at half resolution.

    Args:
        config: Settings.
        camera_position: Camera centre in B [m], (3,).
    """

    def __init__(self, config: FlowConfig, camera_position: np.ndarray) -> None:
        self._config, self._camera_position = config, camera_position
        self.reset()

    def reset(self) -> None:
        """Forget the last picture and its points."""
        self._grey: np.ndarray | None = None
        self._velocity: np.ndarray | None = None
        self._points, self._bearings = np.zeros((0, 2), np.float32), np.zeros((0, 2))
        self._root = np.zeros((0, 2, 2))
        self._inverse = np.zeros(0)
        self._frames = self._stamp_ns = 0

    def update(
        self,
        frame: RgbdFrame,
        excluded: np.ndarray,
        motion: CameraMotion,
        plane: PlaneEstimate | None,
        busy: bool = False,
    ) -> FlowVelocity | str:
        """Take the next picture.

        Args:
            frame: Colour and depth.
            excluded: uint8 (H/2, W/2), non-zero where no points may lie.
            motion: Turn since the picture before.
            plane: The surface in this picture, or None.
            busy: Whether the renewal of live points shall wait for the next picture: this one has cost much.

        Returns:
            The velocity, or the reason why it is missing.
        """
        config, half, before = self._config, half_resolution(frame.intrinsics), self._grey
        rows, columns = frame.rgb.shape[0] // 2, frame.rgb.shape[1] // 2
        whole = cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2GRAY)  # one channel is shrunk eight times as fast as three
        self._grey = cv2.resize(whole[: 2 * rows, : 2 * columns], (columns, rows), interpolation=cv2.INTER_AREA)
        last_ns, self._stamp_ns = self._stamp_ns, frame.stamp_ns
        interval = (frame.stamp_ns - last_ns) * 1e-9
        result: FlowVelocity | str = "first picture"
        if before is not None and before.shape == self._grey.shape:
            if not 0.0 < interval <= config.interval_max_s:
                self._keep(np.zeros(0, np.intp))
                result = f"{interval:.3f} s between pictures"
            elif len(self._points) < config.min_points:
                result = "too few points: nothing to follow"
            else:
                result = self._follow(before, self._grey, excluded, half, interval, motion)
        self._velocity = None
        if isinstance(result, FlowVelocity):
            self._velocity = R_BODY_CAMERA.T @ result.velocity
            result = dataclasses.replace(result, stamp_ns=last_ns + (frame.stamp_ns - last_ns) // 2)
        self._frames += 1
        if len(self._points) < config.points_low or (self._frames >= config.redetect and not busy):
            self._find(self._grey, excluded, half)
        self._inverse = inverse_depths(self._bearings, frame.depth, frame.intrinsics, plane)
        return result

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
        motion: CameraMotion,
    ) -> FlowVelocity | str:
        """Velocity by the points of the last picture that are found in this one."""
        config = self._config
        still = _unturned(self._bearings, motion.rotation)
        velocity = np.zeros(3) if self._velocity is None else self._velocity
        start = expected_points(still, self._inverse, velocity, interval, half)
        near = np.abs(start - self._points) < _FAR * grey.shape[1]  # false for NaN
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
            motion.turn,
            self._camera_position,
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


def half_resolution(intrinsics: Intrinsics) -> Intrinsics:
    """Camera of the picture at half resolution (2x2 means: pixel centres shift by half a pixel)."""
    fx, fy, cx, cy = intrinsics
    return 0.5 * fx, 0.5 * fy, 0.5 * (cx - 0.5), 0.5 * (cy - 0.5)


def information_root(grey: np.ndarray, points: np.ndarray, config: FlowConfig) -> np.ndarray:
    """Square roots of the information that following each point carries [1/px], symmetric, (n, 2, 2).

    Information is the structure tensor over the window, noise removed, per noise variance, with a floor on the
    error that structure cannot lower: along a lone edge it vanishes (aperture).
    """
    noise = config.grey_sigma**2
    floor = 2.0 * config.window_px**2 * (_SOBEL_NOISE / _SOBEL) * noise
    return _information_roots(grey, points, config.window_px // 2, floor, noise, config.pixel_sigma**2)


@kernel("f8[:, :, ::1](u1[:, ::1], f4[:, ::1], i8, f8, f8, f8)")
def _information_roots(
    grey: np.ndarray, points: np.ndarray, reach: int, floor: float, noise: float, error: float
) -> np.ndarray:
    """The same for windows of a half width; `error` is the variance that structure cannot lower [px2]."""
    (height, width), roots = grey.shape, np.empty((len(points), 2, 2))
    for i in range(len(points)):
        u, v = np.int64(np.rint(points[i, 0])), np.int64(np.rint(points[i, 1]))
        sum_xx, sum_xy, sum_yy = 0, 0, 0
        for dv in range(-reach, reach + 1):
            row = min(max(v + dv, 0), height - 1)
            above, at, below = grey[_mirrored(row - 1, height)], grey[row], grey[_mirrored(row + 1, height)]
            for du in range(-reach, reach + 1):
                c = min(max(u + du, 0), width - 1)
                l, r = _mirrored(c - 1, width), _mirrored(c + 1, width)  # noqa: E741
                x = np.int64(above[r]) + 2 * np.int64(at[r]) + np.int64(below[r])
                x -= np.int64(above[l]) + 2 * np.int64(at[l]) + np.int64(below[l])
                y = np.int64(below[l]) + 2 * np.int64(below[c]) + np.int64(below[r])
                y -= np.int64(above[l]) + 2 * np.int64(above[c]) + np.int64(above[r])
                sum_xx, sum_xy, sum_yy = sum_xx + x * x, sum_xy + x * y, sum_yy + y * y
        xx, xy, yy = sum_xx / _SOBEL, sum_xy / _SOBEL, sum_yy / _SOBEL
        middle, half = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
        high, low = max(0.0, middle + half - floor) / noise, max(0.0, middle - half - floor) / noise
        high, low = math.sqrt(high / (1.0 + high * error)), math.sqrt(low / (1.0 + low * error))
        slope, level = (high - low) / (2.0 * half) if half > 0.0 else 0.0, 0.5 * (high + low)
        roots[i, 0, 0], roots[i, 1, 1] = level + slope * (xx - middle), level + slope * (yy - middle)
        roots[i, 0, 1] = roots[i, 1, 0] = slope * xy
    return roots


@inner
def _mirrored(i: int, n: int) -> int:
    """Index within a row of n, mirrored at its ends without repeating them."""
    if i < 0:
        return -i
    return i if i < n else 2 * n - 2 - i


def inverse_depths(
    bearings: np.ndarray, depth: np.ndarray, intrinsics: Intrinsics, plane: PlaneEstimate | None
) -> np.ndarray:
    """1/Z of normalised points (n, 2): the surface's where they lie on it, else their own, 0 if unknown, (n,)."""
    surface, gate = _NO_SURFACE, 0.0
    if plane is not None:
        surface = np.ascontiguousarray(plane.inverse_depth, float)
        gate = max(_ON_PLANE_SIGMAS * float(plane.residual_sigma), _ON_PLANE)
    depth = np.require(depth, np.float32, ("C", "W"))  # the one type of the kernel
    return _point_depths(bearings, depth, np.array(intrinsics, float), surface, gate)


@kernel("f8[::1](f8[:, ::1], f4[:, ::1], f8[::1], f8[::1], f8)")
def _point_depths(
    bearings: np.ndarray, depth: np.ndarray, camera: np.ndarray, plane: np.ndarray, gate: float
) -> np.ndarray:
    """The same by the median of five readings, or a plane (3,), empty if unknown, within a gate, fraction of 1/Z."""
    (height, width), (fx, fy, cx, cy), cross = depth.shape, camera, _CROSS_PX
    steps = ((0, 0), (0, -cross), (0, cross), (-cross, 0), (cross, 0))
    inverse, readings = np.empty(len(bearings)), np.empty(5)
    for i in range(len(bearings)):
        x, y = bearings[i]
        # held to the picture as floats: a point may be anywhere, or not a number
        column = np.int64(min(max(float(cross), np.rint(x * fx + cx)), float(width - 1 - cross)))
        row = np.int64(min(max(float(cross), np.rint(y * fy + cy)), float(height - 1 - cross)))
        count = 0
        for down, right in steps:
            z = depth[row + down, column + right]
            if z > 0.0 and z < np.inf:
                readings[count] = z
                count += 1
        inverse[i] = np.float32(1.0) / np.float32(upper_median(readings, count)) if count >= _READINGS else 0.0
        if plane.size and inverse[i] > 0.0:
            surface = x * plane[0] + y * plane[1] + plane[2]
            if abs(inverse[i] - surface) < gate * abs(surface):
                inverse[i] = surface
    return inverse


def _unturned(bearings: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Where normalised points would be now if the camera had only turned (now to before, (3, 3)), (n, 2)."""
    turned = bearings @ rotation[:2] + rotation[2]  # p^T R
    return turned[:, :2] / turned[:, 2:]


def expected_points(
    still: np.ndarray, inverse: np.ndarray, velocity: np.ndarray, interval: float, intrinsics: Intrinsics
) -> np.ndarray:
    """Pixels of turned points after the camera moved at a velocity in C (3,), float32 (n, 2)."""
    fx, fy, cx, cy = intrinsics
    moved = still + (interval * inverse)[:, None] * (still * velocity[2] - velocity[:2])
    return (moved * (fx, fy) + (cx, cy)).astype(np.float32)
