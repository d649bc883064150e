"""Prediction of lines and planes under camera motion, against points that are really moved."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from ibvs_qp.frames import R_BODY_CAMERA, align_line
from ibvs_qp.vision.flow.motion import CameraMotion

CAMERA = np.array([0.2, 0.0, 0.08])


def seen(points_body: np.ndarray, turn: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Camera coordinates of fixed points after the body has turned and moved (in the body frame before), (n, 3)."""
    return ((points_body - moved) @ turn - CAMERA) @ R_BODY_CAMERA


@pytest.mark.parametrize("seed", range(20))
def test_prediction_is_exact(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vector, velocity, interval = rng.uniform(-0.2, 0.2, 3), rng.uniform(-1.0, 1.0, 3), 0.05
    turn = cv2.Rodrigues(vector)[0]
    points = np.array([0.7, 0.0, 0.0]) + rng.uniform(
        -0.2, 0.2, (3, 3)
    )  # the first two make the line, all three the wall
    before, now = seen(points, np.eye(3), np.zeros(3)), seen(points, turn, velocity * interval)
    plane_before, plane_now = np.linalg.solve(before, np.ones(3)), np.linalg.solve(now, np.ones(3))
    motion = CameraMotion.of_body(vector, velocity, interval, CAMERA)
    np.testing.assert_allclose(motion.plane(plane_before), plane_now, rtol=1e-9)
    lines = []
    for ends in (before, now):
        a, b, c = np.cross(ends[0] / ends[0, 2], ends[1] / ends[1, 2])
        lines.append((-c / math.hypot(a, b), math.atan2(b, a)))
    rho, theta = motion.line(*lines[0], plane_before)
    assert (rho, theta) == pytest.approx(align_line(*lines[1], theta), abs=1e-9)


def test_line_keeps_its_sign() -> None:
    motion = CameraMotion.of_body(np.array([0.1, 0.0, 0.0]), None, 0.03, CAMERA)
    for rho, theta in ((0.1, 0.5 * math.pi), (-0.1, -0.5 * math.pi), (0.1, math.pi), (-0.1, 7.0)):
        assert abs(motion.line(rho, theta, None)[1] - theta) < 0.2
