"""Lines of a distorted picture become those of the straight edges, without touching the picture."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from ibvs_qp.vision.picture import normalised_line
from ibvs_qp.vision.survey import DetectedLine
from ibvs_qp.vision.survey.distortion import undistorted_line

INTRINSICS = (520.9, 521.0, 325.1, 249.7)
LENS = (0.2312, -0.7849, -0.0033, -0.0001, 0.9172)


@pytest.mark.parametrize(("theta", "rho"), [(1.57, 0.3), (1.4, -0.25), (0.05, 0.4), (-0.1, -0.3), (0.8, 0.1)])
def test_chord_of_a_bowed_edge_becomes_the_edge(theta: float, rho: float) -> None:
    normal, along = np.array([math.cos(theta), math.sin(theta)]), np.array([-math.sin(theta), math.cos(theta)])
    points = rho * normal + np.linspace(-0.35, 0.35, 80)[:, None] * along
    camera = np.array([[INTRINSICS[0], 0, INTRINSICS[2]], [0, INTRINSICS[1], INTRINSICS[3]], [0, 0, 1.0]])
    seen = cv2.projectPoints(
        np.column_stack((points, np.ones(len(points)))), np.zeros(3), np.zeros(3), camera, np.array(LENS)
    )[0].reshape(-1, 2)
    middle = seen.mean(axis=0)
    _, axes = np.linalg.eigh((seen - middle).T @ (seen - middle))
    reach = (seen - middle) @ axes[:, 1]
    pixels = middle + np.array([[reach.min()], [reach.max()]]) * axes[:, 1]
    (u1, v1), (u2, v2) = pixels.tolist()
    chord = normalised_line(v1 - v2, u2 - u1, u1 * v2 - u2 * v1, INTRINSICS)
    line = DetectedLine(pixels=pixels, rho=chord[0], theta=chord[1], covariance=np.eye(2))

    def error_px(found: DetectedLine) -> float:
        across = points @ np.array([math.cos(found.theta), math.sin(found.theta)]) - found.rho
        return float(np.abs(across).max()) * INTRINSICS[0]

    straight = undistorted_line(line, INTRINSICS, LENS)
    assert error_px(line) > 0.4
    assert error_px(straight) < 0.1 * error_px(line) + 0.05
    assert straight.pixels is line.pixels
