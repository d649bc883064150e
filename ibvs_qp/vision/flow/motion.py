"""Motion of the camera between two pictures, by the gyro or by points of the surface, and lines and planes after it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np

from ibvs_qp.frames import R_BODY_CAMERA, align_line
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.picture.picture import camera_matrix, half_resolution
from ibvs_qp.vision.surface.plane import PlaneEstimate, SurfaceRegion

#: Least fraction of the distance to a surface that is left after a motion.
_LEAST_LEFT = 0.05
#: Corners followed, their least quality (fraction of the best) and distance [px at half resolution].
_POINTS, _QUALITY, _SPACING = 80, 0.01, 8.0
#: Side of the Lucas-Kanade window and pyramid levels above the picture.
_WINDOW, _LEVELS = (21, 21), 3
#: A point followed forth and back must return within this distance [px at half resolution].
_RETURN_PX = 0.5
#: Pixel error of a point that agrees with the motion; least number of those; rounds of the search.
_AGREE_PX, _LEAST, _ROUNDS = 1.0, 10, 60


@dataclass(frozen=True)
class CameraMotion:
    """Motion between two pictures: P_before = rotation @ P_now + translation, in camera frames."""

    rotation: np.ndarray  # now to before, (3, 3)
    translation: np.ndarray  # camera centre now, in the frame before [m], (3,)
    turn: np.ndarray  # turn of the body from before to now, in B [rad], (3,)
    by_surface: bool = False  # whether points of the surface gave it, instead of a gyro

    @classmethod
    def of_body(
        cls, turn: np.ndarray, velocity: np.ndarray | None, interval_s: float, camera_position: np.ndarray
    ) -> CameraMotion:
        """Motion of the camera, whose centre lies somewhere in B [m], from that of the body.

        The body turns from before to now, in B [rad], its centre of mass moves at a velocity in B [m/s], if known.
        """
        rotation = cv2.Rodrigues(np.asarray(turn, float))[0]
        moved = rotation @ camera_position - camera_position
        if velocity is not None:
            moved = moved + np.asarray(velocity, float) * interval_s
        return cls(R_BODY_CAMERA.T @ rotation @ R_BODY_CAMERA, R_BODY_CAMERA.T @ moved, turn)

    def plane(self, inverse_depth: np.ndarray) -> np.ndarray:
        """(a, b, c) of the same surface now: R^T N / (1 - N t)."""
        remaining = 1.0 - float(inverse_depth @ self.translation)
        return self.rotation.T @ inverse_depth / max(remaining, _LEAST_LEFT)

    @cached_property
    def _numbers(self) -> tuple[list[list[float]], list[float]]:
        return self.rotation.tolist(), self.translation.tolist()

    def line(self, rho: float, theta: float, inverse_depth: np.ndarray | None) -> tuple[float, float]:
        """The same line now; translation counts only where the line's plane is known."""
        (r, s, t), (tx, ty, tz) = self._numbers  # rows of the rotation; plain numbers, as there are only three of each
        x, y, z = math.cos(theta), math.sin(theta), -rho
        if inverse_depth is not None:
            # before^T (R + t plane^T) with the plane now, plane = R^T N / (1 - N t)
            nx, ny, nz = inverse_depth.tolist()
            gain = (x * tx + y * ty + z * tz) / max(1.0 - nx * tx - ny * ty - nz * tz, _LEAST_LEFT)
            x, y, z = x + gain * nx, y + gain * ny, z + gain * nz
        a, b, c = (x * r[k] + y * s[k] + z * t[k] for k in range(3))
        length = math.hypot(a, b)
        return (rho, theta) if length < 1e-9 else align_line(-c / length, math.atan2(b, a), theta)


class SurfaceMotion:
    """Motion of the camera by points of the surface, where no gyro measures it."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the picture before."""
        self._grey: np.ndarray | None = None

    def motion_by_points(
        self, frame: RgbdFrame, plane: PlaneEstimate | None, region: SurfaceRegion | None
    ) -> CameraMotion | None:
        """Motion since the picture before, or None where too few points can be followed.

        The plane is the surface's in the picture before, which gives the points their depth, the region that of the
        last search; None if unknown.
        """
        small, factor = half_resolution(frame.rgb)
        now = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY)
        before, self._grey = self._grey, now
        if before is None or plane is None or region is None:
            return None
        mask = cv2.resize(region.cells.astype(np.uint8), before.shape[::-1], interpolation=cv2.INTER_NEAREST)
        corners = cv2.goodFeaturesToTrack(before, _POINTS, _QUALITY, _SPACING, mask=mask)
        if corners is None or len(corners) < _LEAST:
            return None
        corners, search = np.asarray(corners, np.float32).reshape(-1, 1, 2), {"winSize": _WINDOW, "maxLevel": _LEVELS}
        follow: Any = cv2.calcOpticalFlowPyrLK
        moved, found, _ = follow(before, now, corners, None, **search)
        back, again, _ = follow(now, before, moved, None, **search)
        good = (found.ravel() > 0) & (again.ravel() > 0)
        good &= np.linalg.norm((back - corners).reshape(-1, 2), axis=1) < _RETURN_PX
        if int(good.sum()) < _LEAST:
            return None
        shift = 0.5 * (factor - 1.0)
        start = corners.reshape(-1, 2)[good].astype(float) * factor + shift
        stop = moved.reshape(-1, 2)[good].astype(float) * factor + shift
        fx, fy, cx, cy = frame.intrinsics
        rays = np.column_stack(((start[:, 0] - cx) / fx, (start[:, 1] - cy) / fy, np.ones(len(start))))
        inverse = rays @ plane.inverse_depth
        kept = inverse > 1e-3
        points, stop = rays[kept] / inverse[kept, None], stop[kept]
        if len(points) < _LEAST:
            return None
        solved, turn, shifted, agreeing = cv2.solvePnPRansac(
            points,
            stop,
            camera_matrix(frame.intrinsics),
            None,  # type: ignore[arg-type]
            rvec=np.zeros((3, 1)),
            tvec=np.zeros((3, 1)),
            useExtrinsicGuess=True,
            iterationsCount=_ROUNDS,
            reprojectionError=_AGREE_PX * factor,
            flags=cv2.SOLVEPNP_ITERATIVE,
        )
        if not solved or agreeing is None or len(agreeing) < _LEAST:
            return None
        rotation = cv2.Rodrigues(turn)[0]  # P_now = rotation P_before + shifted
        if not (np.isfinite(rotation).all() and np.isfinite(shifted).all()):
            return None
        turn = cv2.Rodrigues(R_BODY_CAMERA @ rotation.T @ R_BODY_CAMERA.T)[0].ravel()
        return CameraMotion(rotation.T, -(rotation.T @ shifted).ravel(), turn, by_surface=True)
