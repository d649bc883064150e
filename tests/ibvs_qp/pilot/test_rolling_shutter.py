"""Lines of a rolling shutter, by finite differences of an exact camera, and in the Pilot's features."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from ibvs_qp.frames import R_BODY_CAMERA, align_line, rotation_from_vector
from ibvs_qp.measurement import FeatureFrame, LineFeature, RgbdFrame
from ibvs_qp.pilot.rolling_shutter import RollingShutter
from ibvs_qp.vision.picture.camera import Lens

INTRINSICS, SHAPE, READOUT_S = (600.0, 600.0, 319.5, 239.5), (480, 640), 0.02
PLACE = np.array((0.2, 0.01, -0.05))
PLANE = (0.15, -0.1, 1.9, -1.0)
PICTURE = RgbdFrame(rgb=np.zeros((*SHAPE, 3), np.uint8), depth=np.zeros(SHAPE), intrinsics=INTRINSICS, stamp_ns=0)
VELOCITY, RATE = np.array((0.05, 0.2, -0.15)), np.array((0.1, -0.15, 0.2))
LENS = (-0.12, 0.05, 0.001, -0.001, 0.0)
TURNED = Lens(LENS, cv2.Rodrigues(np.array((0.02, -0.03, 0.4)))[0])
#: Two points of every line at the stamp, normalised.
LINES = {
    "upright": ((-0.25, -0.35), (-0.22, 0.35)),
    "level, above": ((-0.4, -0.3), (0.4, -0.28)),
    "level, below": ((-0.3, 0.33), (0.4, 0.3)),
    "slanted": ((-0.3, -0.3), (0.35, 0.25)),
}


def at(points: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """Where points of the wall, normalised at the stamp, (n, 2), are seen at times [s], (n,); by the exact motion."""
    rays = np.column_stack((points, np.ones(len(points))))
    space = rays / (rays @ PLANE[:3])[:, None]
    found = []
    for point, time in zip(space, time_s, strict=True):
        turn = R_BODY_CAMERA.T @ rotation_from_vector(RATE * time) @ R_BODY_CAMERA
        step = R_BODY_CAMERA.T @ ((VELOCITY + np.cross(RATE, PLACE)) * time)
        found.append(turn.T @ (point - step))
    return np.array([(x / z, y / z) for x, y, z in found])


def exposed(points: np.ndarray, lens: Lens) -> np.ndarray:
    """The same points where their own rows show them."""
    time = np.zeros(len(points))
    for _ in range(20):
        rows = lens.pixels(at(points, time), INTRINSICS)[:, 1]
        time = (rows - INTRINSICS[3]) / (SHAPE[0] - 1) * READOUT_S
    return at(points, time)


def fitted(points: np.ndarray) -> tuple[float, float]:
    middle = points.mean(axis=0)
    normal = np.linalg.eigh((points - middle).T @ (points - middle))[1][:, 0]
    return float(middle @ normal), math.atan2(normal[1], normal[0])


def line(points: np.ndarray) -> LineFeature:
    rho, theta = fitted(points)
    return LineFeature(rho=rho, theta=theta, covariance=np.eye(2), role="vertical", segment=points[[0, -1]])


def worst_px(found: LineFeature, points: np.ndarray) -> float:
    across = points @ (math.cos(found.theta), math.sin(found.theta)) - found.rho
    return INTRINSICS[0] * float(np.abs(across).max())


@pytest.mark.parametrize("name", LINES)
@pytest.mark.parametrize("mounted", [Lens(), TURNED], ids=["", "lens"])
def test_a_line_is_where_it_is_at_the_stamp(name: str, mounted: Lens) -> None:
    first, last = np.array(LINES[name])
    points = first + np.linspace(0.0, 1.0, 60)[:, None] * (last - first)
    seen = line(exposed(points, mounted))
    shutter = RollingShutter(READOUT_S, mounted, PLACE)
    features = FeatureFrame(lines=(seen,), plane=PLANE, stamp_ns=0)
    [found] = shutter.features(features, PICTURE, PLANE, VELOCITY, RATE.tolist()).lines
    assert worst_px(seen, points) > 0.25
    assert worst_px(found, points) < 0.03
    assert found.segment is not None and np.abs(found.segment - points[[0, -1]]).max() < 5e-5
    rho, theta = align_line(*fitted(points), seen.theta)
    assert (found.rho, found.theta) == (pytest.approx(rho, abs=5e-5), pytest.approx(theta, abs=1e-4))


def test_rotation_alone_counts_without_plane_and_velocity() -> None:
    seen = line(np.array(LINES["upright"]))
    features = FeatureFrame(lines=(seen,), plane=None, stamp_ns=0)
    shutter = RollingShutter(READOUT_S, Lens(), PLACE)
    [found] = shutter.features(features, PICTURE, None, None, (0.0, 0.0, 0.5)).lines  # turns to the right
    y0, y1 = (600.0 * y / 479.0 * READOUT_S for y in (-0.35, 0.35))
    assert found.theta - seen.theta == pytest.approx(-0.5 * (y1 - y0) / 0.7 * (1 + 0.24**2), abs=1e-3)
    assert found.theta != seen.theta


def test_a_global_shutter_and_a_line_without_a_segment_change_nothing() -> None:
    seen = line(np.array(LINES["upright"]))
    features = FeatureFrame(lines=(seen,), plane=PLANE, stamp_ns=0)
    assert RollingShutter(0.0, Lens(), PLACE).features(features, PICTURE, PLANE, VELOCITY, RATE.tolist()) is features
    bare = LineFeature(rho=0.1, theta=0.0, covariance=np.eye(2), role="vertical")
    features = FeatureFrame(lines=(bare,), plane=PLANE, stamp_ns=0)
    [same] = RollingShutter(READOUT_S, Lens(), PLACE).features(features, PICTURE, PLANE, VELOCITY, RATE.tolist()).lines
    assert same is bare
