"""Lens distortion: points of lines are straightened, never whole pictures."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np

from ibvs_qp.frames import align_line
from ibvs_qp.vision.mask import Intrinsics
from ibvs_qp.vision.survey.detection import DetectedLine

#: Points of a line that are straightened.
_POINTS = 32


def undistorted_line(line: DetectedLine, intrinsics: Intrinsics, coefficients: tuple[float, ...]) -> DetectedLine:
    """A line fitted in a distorted picture with the (rho, theta) of the straight line it shows.

    The image of a straight edge is bowed; the fit is its chord by least squares. Points along the chord, undistorted,
    bow the other way by the same amount, so that their own least-squares line is the edge to second order.

    Args:
        line: The line; its pixels stay those of the picture as taken.
        intrinsics: (fx, fy, cx, cy) [px].
        coefficients: (k1, k2, p1, p2, k3) of the Brown-Conrady model, as OpenCV orders them.
    """
    fx, fy, cx, cy = intrinsics
    camera = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    share = np.linspace(0.0, 1.0, _POINTS)[:, None]
    pixels = line.pixels[0] + share * (line.pixels[1] - line.pixels[0])
    points = cv2.undistortPoints(pixels[:, None], camera, np.array(coefficients)).reshape(-1, 2)
    middle = points.mean(axis=0)
    _, axes = np.linalg.eigh((points - middle).T @ (points - middle))
    normal = axes[:, 0]
    theta = math.atan2(normal[1], normal[0])
    rho, theta = align_line(float(middle @ normal), theta, line.theta)
    return replace(line, rho=rho, theta=theta)
