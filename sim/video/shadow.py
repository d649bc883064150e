"""Soft shadows on wall and board, which show how far in front of them a thing is."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from sim.video.rasterizer import LIGHT, OVERSAMPLING, Rasterizer

#: Darkness of a shadow 0..1, and its softness [px].
_DARKNESS, _SOFT_PX = 0.36, 6


def cast(points: np.ndarray, depth_m: float) -> np.ndarray:
    """Where the light casts points onto the plane x = depth_m of MuJoCo's world [m], (N, 3)."""
    return points + (depth_m - points[:, :1]) / LIGHT[0] * LIGHT


def shadow(rasterizer: Rasterizer, outlines: Sequence[np.ndarray], opacities: Sequence[float]) -> np.ndarray:
    """Soft shadow of convex things whose points were cast onto a plane.

    Args:
        rasterizer: For its camera.
        outlines: Points of every thing on the plane, MuJoCo's world [m], (N, 3); the most opaque last.
        opacities: Of every thing, 0..1.

    Returns:
        Fraction of the light that is gone, float32, at the size of the finished picture.
    """
    width, height = rasterizer.camera.size
    dark = np.zeros((height, width), np.uint8)
    pixels = rasterizer.camera.project(np.concatenate(outlines)).astype(np.float32)
    ends = np.cumsum([len(points) for points in outlines])
    for points, opacity in zip(np.split(pixels, ends[:-1]), opacities, strict=True):
        hull = np.rint(cv2.convexHull(points)).astype(np.int32)
        cv2.fillConvexPoly(dark, hull, round(255 * _DARKNESS * opacity), cv2.LINE_AA)
    soft = cv2.blur(cv2.blur(dark, (_SOFT_PX, _SOFT_PX)), (_SOFT_PX, _SOFT_PX))
    return soft.astype(np.float32) / np.float32(255.0)


def darken(colour: np.ndarray, share: np.ndarray) -> None:
    """Take the light of a shadow from a picture `OVERSAMPLING` times larger, in place."""
    rows, columns = (np.flatnonzero(share.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return
    r0, r1, c0, c1 = rows[0], rows[-1] + 1, columns[0], columns[-1] + 1
    light = np.float32(1.0) - share[r0:r1, c0:c1]
    large = cv2.resize(light, None, fx=OVERSAMPLING, fy=OVERSAMPLING)
    colour[OVERSAMPLING * r0 : OVERSAMPLING * r1, OVERSAMPLING * c0 : OVERSAMPLING * c1] *= large[..., None]
