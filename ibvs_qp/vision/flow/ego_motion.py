"""How the camera moved between two pictures, from points of the surface alone: no gyro is needed."""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.vision.flow.camera_motion import CameraMotion
from ibvs_qp.vision.picture.lens import camera_matrix
from ibvs_qp.vision.picture.mask import Intrinsics
from ibvs_qp.vision.surface.region import SurfaceRegion

#: Corners followed, their least quality (share of the best) and distance [px at half resolution].
_POINTS, _QUALITY, _SPACING = 80, 0.01, 8.0
#: Side of the Lucas-Kanade window and pyramid levels above the picture.
_WINDOW, _LEVELS = 21, 3
#: A point followed forth and back must return within this distance [px at half resolution].
_RETURN_PX = 0.5
#: Pixel error of a point that agrees with the motion; least number of those; rounds of the search.
_AGREE_PX, _LEAST, _ROUNDS = 1.0, 10, 60


def surface_motion(
    before: np.ndarray, now: np.ndarray, factor: float, region: SurfaceRegion, intrinsics: Intrinsics
) -> CameraMotion | None:
    """Motion of the camera by the points of a plane it sees, or None where too few of them can be followed.

    Args:
        before: Brightness of the picture before, uint8 (h, w).
        now: The same of this picture.
        factor: Pixels of the full picture per pixel of these.
        region: The surface in the picture before: its plane gives the points their depth.
        intrinsics: (fx, fy, cx, cy) of the full picture [px].
    """
    wanted = cv2.resize(region.cells.astype(np.uint8), before.shape[::-1], interpolation=cv2.INTER_NEAREST)
    corners = cv2.goodFeaturesToTrack(before, _POINTS, _QUALITY, _SPACING, mask=wanted)
    if corners is None or len(corners) < _LEAST:
        return None
    corners = np.asarray(corners, np.float32).reshape(-1, 1, 2)
    window = (_WINDOW, _WINDOW)
    moved, found, _ = cv2.calcOpticalFlowPyrLK(before, now, corners, None, winSize=window, maxLevel=_LEVELS)  # type: ignore[call-overload]
    back, again, _ = cv2.calcOpticalFlowPyrLK(now, before, moved, None, winSize=window, maxLevel=_LEVELS)  # type: ignore[call-overload]
    good = (found.ravel() > 0) & (again.ravel() > 0)
    good &= np.linalg.norm((back - corners).reshape(-1, 2), axis=1) < _RETURN_PX
    if int(good.sum()) < _LEAST:
        return None
    shift = 0.5 * (factor - 1.0)
    start = corners.reshape(-1, 2)[good].astype(float) * factor + shift
    stop = moved.reshape(-1, 2)[good].astype(float) * factor + shift
    fx, fy, cx, cy = intrinsics
    rays = np.column_stack(((start[:, 0] - cx) / fx, (start[:, 1] - cy) / fy, np.ones(len(start))))
    inverse = rays @ region.plane.inverse_depth
    kept = inverse > 1e-3
    points, stop = rays[kept] / inverse[kept, None], stop[kept]
    if len(points) < _LEAST:
        return None
    solved, turn, shifted, agreeing = cv2.solvePnPRansac(
        points,
        stop,
        camera_matrix(intrinsics),
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
    return CameraMotion(rotation.T, -(rotation.T @ shifted).ravel())
