"""Velocity from sparse optical flow, depth and gyro, with a covariance that is large without visible features."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import cv2
import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.compilation import MAD_TO_SIGMA, inner, kernel, upper_median
from ibvs_qp.vision.config import FlowConfig
from ibvs_qp.vision.flow.motion import CameraMotion
from ibvs_qp.vision.picture.layout import Intrinsics
from ibvs_qp.vision.surface.plane import PlaneEstimate

#: Rounds of reweighting.
_ROUNDS = 4
#: Columns of the system: velocity (0 to 2), flow, turn (4 to 6).
_WIDTH, _FLOW = 7, 3
_V, _TURN = slice(0, 3), slice(4, 7)
#: Points of less weight do not agree.
_AGREES = 0.1
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

#: Grey pictures before and now, uint8 (h, w) each.
Pictures = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class FlowVelocity:
    """Velocity of the centre of mass."""

    velocity: np.ndarray  # in B, at the middle of the two captures [m/s], (3,)
    covariance: np.ndarray  # (3, 3); large in directions that nothing showed
    stamp_ns: int  # time for which it holds
    points: int  # points that agreed


def solve_velocity(
    still: np.ndarray,
    end: np.ndarray,
    inverse: np.ndarray,
    root: np.ndarray,
    focal: float,
    interval: float,
    turn: np.ndarray,
    camera_position: np.ndarray,
    config: FlowConfig,
) -> FlowVelocity | str:
    """Robust weighted least squares for the camera's velocity after the full rotational flow is taken out.

    Args:
        still: Points after the turn alone, normalised, (n, 2).
        end: Points as found, normalised, (n, 2).
        inverse: 1/Z of the points [1/m], (n,).
        root: Square roots of their information [1/px], (n, 2, 2).
        focal: Focal length of the picture in which they were followed [px].
        interval: Time between the pictures [s].
        turn: Turn of the body in between, in B [rad], (3,).
        camera_position: Camera centre in B [m], (3,).
        config: Settings.

    Returns:
        The velocity, or the reason why it is missing.
    """
    prior = 1.0 / config.prior_m_s**2
    velocity, sums, square, total, agreeing = _robust_velocity(
        still, end, inverse, root, focal * interval, interval, prior, config.gate_sigmas
    )
    if not len(velocity):
        return "the points determine no velocity"
    if agreeing < config.min_points:
        return "too few points agree"
    if math.hypot(*velocity) > config.speed_max_m_s:
        return "faster than possible"
    spread = max(square / max(2.0 * total - 3.0, 1.0), 1.0)
    spreads = np.array((1.0, spread))[:, None, None]
    with_prior, spread_out = np.linalg.inv(sums[:, _V] + np.eye(3) * prior / spreads) * spreads
    leak = with_prior @ sums[:, _TURN] * (config.rotation_sigma_rad / interval)
    covariance = spread_out + leak @ leak.T
    covariance = R_BODY_CAMERA @ covariance @ R_BODY_CAMERA.T
    (wx, wy, wz), (px, py, pz) = (turn / interval).tolist(), camera_position.tolist()
    lever = np.array([wy * pz - wz * py, wz * px - wx * pz, wx * py - wy * px])
    return FlowVelocity(
        velocity=R_BODY_CAMERA @ velocity - lever,
        covariance=0.5 * (covariance + covariance.T),
        stamp_ns=0,
        points=agreeing,
    )


@inner
def _rows(still, end, inverse, root, scale, interval):
    """Whitened rows of every point, (n, 2, 7)."""
    rows, along, across = np.empty((len(still), 2, _WIDTH)), np.empty(_WIDTH), np.empty(_WIDTH)
    for i in range(len(still)):
        x, y = 0.5 * (end[i, 0] + still[i, 0]), 0.5 * (end[i, 1] + still[i, 1])
        along[0], along[1], along[2] = -inverse[i], 0.0, inverse[i] * x
        across[0], across[1], across[2] = 0.0, -inverse[i], inverse[i] * y
        along[_FLOW] = (end[i, 0] - still[i, 0]) / interval
        across[_FLOW] = (end[i, 1] - still[i, 1]) / interval
        along[4], along[5], along[6] = x * y, -(1.0 + x * x), y
        across[4], across[5], across[6] = 1.0 + y * y, -x * y, -x
        for r in range(2):
            for c in range(_WIDTH):
                rows[i, r, c] = scale * (root[i, r, 0] * along[c] + root[i, r, 1] * across[c])
    return rows


@inner
def _solved(sums, prior, velocity):
    """Velocity from the sums of products (3, 7) by cofactors; false where they determine none."""
    xx, xy, xz = sums[0, 0] + prior, sums[0, 1], sums[0, 2]
    yy, yz, zz = sums[1, 1] + prior, sums[1, 2], sums[2, 2] + prior
    c_xx, c_xy, c_xz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    c_yy, c_yz, c_zz = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    determinant = xx * c_xx + xy * c_xy + xz * c_xz
    scale = 1.0 / determinant
    xs, ys, zs = sums[0, _FLOW], sums[1, _FLOW], sums[2, _FLOW]
    velocity[0] = scale * c_xx * xs + scale * c_xy * ys + scale * c_xz * zs
    velocity[1] = scale * c_xy * xs + scale * c_yy * ys + scale * c_yz * zs
    velocity[2] = scale * c_xz * xs + scale * c_yz * ys + scale * c_zz * zs
    return determinant != 0.0


@inner
def _sum_products(rows, weight, sums):
    """Weighted sums of the products of rows (n, 2, 7): those of velocity with all, (3, 7)."""
    sums[:] = 0.0
    for i in range(len(rows)):
        if weight[i] == 0.0:
            continue
        for r in range(2):
            row = rows[i, r]
            for a in range(3):
                for b in range(_WIDTH):
                    sums[a, b] += weight[i] * row[a] * row[b]


@kernel("Tuple((f8[::1], f8[:, ::1], f8, f8, i8))(f8[:, ::1], f8[:, ::1], f8[::1], f8[:, :, ::1], f8, f8, f8, f8)")
def _robust_velocity(still, end, inverse, root, scale, interval, prior, gate_sigmas):
    """Velocity of the camera in C [m/s], (3,), empty where the points determine none.

    `scale` turns the roots of the points' information into those of a velocity [px s], `prior` is the information of
    the prior [s2/m2]; the other arguments are those of `solve_velocity`. Returns the velocity; weighted sums of the
    products of its columns with those of velocity, flow and turn in the last round, (3, 7); sum of weighted squares,
    sum of weights and points that agree.
    """
    rows, velocity, sums = _rows(still, end, inverse, root, scale, interval), np.empty(3), np.empty((3, _WIDTH))
    weight, size = np.ones(len(rows)), np.empty(len(rows))
    for _ in range(_ROUNDS):
        _sum_products(rows, weight, sums)
        if not _solved(sums, prior, velocity):
            return np.empty(0), sums, 0.0, 0.0, 0
        for i in range(len(rows)):
            size[i] = 0.0
            for r in range(2):
                row = rows[i, r]
                residual = row[0] * velocity[0] + row[1] * velocity[1] + row[2] * velocity[2] - row[_FLOW]
                size[i] += residual * residual
        spread = max(0.5, MAD_TO_SIGMA * math.sqrt(upper_median(size.copy(), len(size)))) * gate_sigmas
        for i in range(len(rows)):
            left = max(0.0, 1.0 - size[i] / (spread * spread))
            weight[i] = left * left
    square, total, agreeing = 0.0, 0.0, 0
    for i in range(len(rows)):
        square, total, agreeing = square + weight[i] * size[i], total + weight[i], agreeing + (weight[i] > _AGREES)
    return velocity, sums, square, total, agreeing


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

    def measure_velocity(
        self, frame: RgbdFrame, excluded: np.ndarray, motion: CameraMotion, plane: PlaneEstimate | None, busy: bool
    ) -> FlowVelocity | str:
        """Velocity since the picture before, or the reason why it is missing.

        Args:
            frame: Colour and depth.
            excluded: uint8 (H/2, W/2), non-zero where no points may lie.
            motion: Turn since the picture before.
            plane: The surface in this picture, or None.
            busy: Whether the renewal of live points shall wait for the next picture: this one has cost much.
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
                result = self._follow((before, self._grey), excluded, half, interval, motion)
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
        self, pictures: Pictures, excluded: np.ndarray, half: Intrinsics, interval: float, motion: CameraMotion
    ) -> FlowVelocity | str:
        """Velocity by the points of the last one of two grey pictures that are found in this one."""
        config, expected, grey = self._config, self._velocity is not None, pictures[1]
        turned = self._bearings @ motion.rotation[:2] + motion.rotation[2]  # p^T R
        still = turned[:, :2] / turned[:, 2:]  # where the points would be now if the camera had only turned
        velocity = np.zeros(3) if self._velocity is None else self._velocity
        start = expected_points(still, self._inverse, velocity, interval, half)
        near = np.abs(start - self._points) < _FAR * grey.shape[1]  # false for NaN
        start = start if near.all() else np.where(near, start, self._points)
        found, status = self._lucas_kanade(pictures, start, 0 if expected else _LEVELS)
        if expected and np.count_nonzero((np.abs(found - start) < _NEAR_PX).all(axis=1)) < _MOST * len(start):
            found, status = self._lucas_kanade(pictures, start, _LEVELS)
        self._points, (height, width) = found, grey.shape
        column, row = np.rint(found).astype(np.intp).T
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height) & (status.reshape(-1) == 1)
        alive = np.flatnonzero(inside)
        alive = alive[excluded.reshape(-1).take(row[alive] * width + column[alive]) == 0]
        self._bearings = (found - half[2:]) / half[:2]
        self._keep(alive)
        known = np.flatnonzero(self._inverse > 0)
        if len(known) < config.min_points:
            return "too few points with depth"
        still, end = still.take(alive[known], axis=0), self._bearings.take(known, axis=0)
        inverse, root = self._inverse.take(known), self._root.take(known, axis=0)
        return solve_velocity(still, end, inverse, root, half[0], interval, motion.turn, self._camera_position, config)

    def _lucas_kanade(self, pictures: Pictures, start: np.ndarray, levels: int) -> tuple[np.ndarray, np.ndarray]:
        """The points in this picture, searched from a start, and whether each was found."""
        window, flags = (self._config.window_px, self._config.window_px), cv2.OPTFLOW_USE_INITIAL_FLOW
        start = start.copy()  # the search writes into it
        found, status, _ = cv2.calcOpticalFlowPyrLK(
            *pictures, self._points, start, winSize=window, maxLevel=levels, criteria=_CRITERIA, flags=flags
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
def _information_roots(grey, points, reach, floor, noise, error):
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
def _mirrored(i, n):
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
def _point_depths(bearings, depth, camera, plane, gate):
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


def expected_points(
    still: np.ndarray, inverse: np.ndarray, velocity: np.ndarray, interval: float, intrinsics: Intrinsics
) -> np.ndarray:
    """Pixels of turned points after the camera moved at a velocity in C (3,), float32 (n, 2)."""
    fx, fy, cx, cy = intrinsics
    moved = still + (interval * inverse)[:, None] * (still * velocity[2] - velocity[:2])
    return (moved * (fx, fy) + (cx, cy)).astype(np.float32)
