"""Every line of a picture, on the surface or not, fitted to a fraction of a pixel."""

from __future__ import annotations

import dataclasses
import math

import cv2
import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import REFERENCE_WIDTH, LineConfig, VisionConfig
from ibvs_qp.vision.lines.refine import FIT_BEYOND, LineFits
from ibvs_qp.vision.paper.result import normalised_line
from ibvs_qp.vision.picture.layout import PictureLayout
from ibvs_qp.vision.picture.picture import Picture, normalise
from sim.detection.detection import DetectedLine
from sim.detection.segments import find_segments

#: A fit farther from its segment than this has found another edge [px at 640].
_STRAY_PX = 1.5
#: Error of a segment's end across it where no fit improved it [px].
_SEGMENT_SIGMA_PX = 0.3
#: A line this long has the full score, fraction of the picture's width.
_FULL_LENGTH = 0.25


def every_line(frame: RgbdFrame, config: LineConfig) -> tuple[DetectedLine, ...]:
    """All straight lines of a picture, longest first; needs colour and intrinsics only."""
    rgb = np.require(frame.rgb, np.uint8, ("C", "W"))  # the one type of the kernel
    frame = dataclasses.replace(frame, rgb=rgb)
    picture = Picture(frame, PictureLayout(frame, VisionConfig(), None))
    segments = find_segments(cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2GRAY), picture.scale)
    fits = LineFits(config, SurfaceColors(None, None, config.color_gate)).fit_segments(
        picture, segments, np.full(len(segments), FIT_BEYOND)
    )
    lines = []
    for segment, fit in zip(segments.reshape(-1, 2, 2), fits, strict=True):
        if fit is None or _apart(segment, fit.rho, fit.theta, picture) > _STRAY_PX * picture.scale:
            rho, theta, covariance = _plain_line(segment, picture)
            pixels, share = segment, 1.0
        else:
            rho, theta, covariance = fit.rho, fit.theta, fit.covariance
            pixels, share = fit.ends_px, fit.inlier_share
        length = float(np.hypot(*(pixels[1] - pixels[0])))
        score = share * min(length / (_FULL_LENGTH * REFERENCE_WIDTH * picture.scale), 1.0)
        lines.append(DetectedLine(pixels=pixels, rho=rho, theta=theta, covariance=covariance, score=score))
    return tuple(lines)


def _apart(segment: np.ndarray, rho: float, theta: float, picture: Picture) -> float:
    """Largest distance of a segment's ends from a line [px]."""
    offset = normalise(segment, picture.intrinsics) @ np.array([math.cos(theta), math.sin(theta)]) - rho
    return float(np.abs(offset).max()) * picture.intrinsics[0]


def _plain_line(segment: np.ndarray, picture: Picture) -> tuple[float, float, np.ndarray]:
    """(rho, theta) of a segment and their covariance, each end being off by the same standard deviation."""
    (u1, v1), (u2, v2) = segment.tolist()
    rho, theta = normalised_line(v1 - v2, u2 - u1, u1 * v2 - u2 * v1, picture.intrinsics)
    ends = normalise(segment, picture.intrinsics)
    along = ends @ np.array([-math.sin(theta), math.cos(theta)])
    variance = (_SEGMENT_SIGMA_PX / picture.intrinsics[0]) ** 2
    size, middle = float(np.ptp(along)), float(along.mean())
    angle = 2.0 * variance / max(size, 1e-6) ** 2
    # rho = value at the middle minus (distance of the middle from the foot) times the angle's error
    return rho, theta, np.array([[0.5 * variance + middle**2 * angle, -middle * angle], [-middle * angle, angle]])
