"""Pictures of real devices: their depth and lens, and what is left of their errors after registration."""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
import pytest

from ibvs_qp.frames import R_BODY_CAMERA
from ibvs_qp.measurement import FeatureFrame, LineFeature
from ibvs_qp.pilot.rolling_shutter import RollingShutter
from ibvs_qp.vision.picture.camera import Lens
from sim.detection.own import OwnMethod
from tests.support.truth import FAMILIES, TruthFrame, TruthScene, render_frame, sample_scene
from tests.support.truth.accuracy import line_errors, measure_family
from tests.support.truth.device_depth import device_depth
from tests.support.truth.device_picture import exposure_gain
from tests.support.truth.devices import ORBBEC, REALSENSE_D435, Device

DEVICES = {"realsense_d435": REALSENSE_D435, "orbbec": ORBBEC}


@functools.cache
def scene(name: str, seed: int = 1) -> TruthScene:
    return sample_scene(FAMILIES[name], seed)


@functools.cache
def truth(name: str) -> TruthFrame:
    return render_frame(scene(name))


def facing(device: Device, distance_m: float) -> TruthScene:
    """A board that fills the view."""
    return TruthScene(size_m=(9.0, 9.0), gap_m=0.1, translation=np.array([0.0, 0.0, distance_m]), device=device)


@pytest.mark.slow
@pytest.mark.parametrize("name", DEVICES)
def test_edges_are_found_from_raw_pictures(name: str) -> None:
    scenes = [sample_scene(FAMILIES[name], seed) for seed in (3, 4)]
    errors = measure_family(scenes, lambda truth: OwnMethod().detect(truth.frame, truth.seed))
    assert errors.found == 1.0 and not errors.wrong and not errors.refused, errors.missed
    assert np.median(errors.offset_px) <= 0.1 and max(errors.offset_px) <= 0.4
    assert max(errors.angle_deg) <= 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", DEVICES)
def test_the_slant_of_the_shutter_is_removed_by_the_known_motion(name: str) -> None:
    at, made = truth(name), scene(name)
    device, velocity, rate = DEVICES[name], np.array(made.twist[:3]), np.array(made.twist[3:])
    shutter = RollingShutter(device.readout_s, Lens(device.distortion), np.zeros(3))
    found, plane = OwnMethod().detect(at.frame, at.seed), (*at.plane.tolist(), -1.0)
    before, after = [], []
    fx, fy, cx, cy = at.frame.intrinsics
    for side, edge in at.edges.items():
        guide = found.guides[side]
        assert guide is not None
        segment = (guide.pixels - (cx, cy)) / (fx, fy)
        line = LineFeature(rho=guide.rho, theta=guide.theta, covariance=np.eye(2), role="horizontal", segment=segment)
        features = FeatureFrame(lines=(line,), plane=None, stamp_ns=0)
        body = R_BODY_CAMERA @ velocity, (R_BODY_CAMERA @ rate).tolist()
        [straight] = shutter.features(features, at.frame, plane, *body).lines
        before.append(line_errors(edge, line.rho, line.theta, at.frame.intrinsics)[1])
        after.append(line_errors(edge, straight.rho, straight.theta, at.frame.intrinsics)[1])
    assert max(before) > 0.02 and max(after) < 0.5 * max(before), (before, after)


@pytest.mark.parametrize("name", DEVICES)
def test_registered_depth_is_that_of_the_scene(name: str) -> None:
    at, made = truth(name), scene(name)
    assert at.raw is not None and at.raw.depth.dtype == np.uint16
    assert at.raw.depth.shape == DEVICES[name].depth_camera[1::-1] and at.frame.depth.shape == at.raw.rgb.shape[:2]
    u, v = (round(entry) for entry in at.seed)
    patch = np.s_[v - 15 : v + 16, u - 15 : u + 16]
    fx, fy, cx, cy = made.intrinsics
    rows, columns = np.mgrid[patch]
    exact = 1.0 / (at.plane[0] * (columns - cx) / fx + at.plane[1] * (rows - cy) / fy + at.plane[2])
    assert abs(np.median(at.frame.depth[patch] - exact)) < 1e-3


@pytest.mark.parametrize("device", DEVICES.values(), ids=DEVICES)
@pytest.mark.parametrize("distance", [1.2, 2.4])
def test_depth_noise_grows_with_the_square_of_the_distance(device: Device, distance: float) -> None:
    device = dataclasses.replace(device, disparity_step_px=0.0)
    depth = 1e-3 * device_depth(facing(device, distance), device, np.random.default_rng(2))
    middle = depth[100:-100, 100:-100]
    middle = middle - np.median(middle, axis=0)  # the device is turned by a few milliradians
    expected = math.hypot(distance**2 * device.subpixel / (device.depth_camera[2] * device.baseline_m), 3e-4)
    assert np.std(middle - np.median(middle, axis=1)[:, None]) == pytest.approx(expected, rel=0.15)


@pytest.mark.parametrize("name", DEVICES)
def test_the_shadow_lies_on_the_side_of_the_second_eye(name: str) -> None:
    device = DEVICES[name]
    board = dataclasses.replace(facing(device, 0.9), size_m=(0.5, 0.3), gap_m=0.4)
    depth = device_depth(board, device, np.random.default_rng(0))
    row = depth[device.depth_camera[1] // 2 - 20 :][:40]
    near = (row > 0) & (row < 1100)
    first, last = near.argmax(axis=1), near.shape[1] - near[:, ::-1].argmax(axis=1)
    left = np.median([(line[start - 25 : start] == 0).sum() for line, start in zip(row, first, strict=True)])
    right = np.median([(line[end : end + 25] == 0).sum() for line, end in zip(row, last, strict=True)])
    width = device.depth_camera[2] * device.baseline_m * (1 / 0.9 - 1 / 1.3)
    shadow, other = (left, right) if device.shadow_side < 0 else (right, left)
    assert shadow == pytest.approx(width, abs=2.0) and other <= device.other_hole_px


def test_exposure_steps_between_pictures() -> None:
    gains = {round(exposure_gain(scene("orbbec"), np.random.default_rng(k)), 3) for k in range(20)}
    assert gains == {0.85, 1.0, 1.15}


def test_the_arm_is_refused() -> None:
    with pytest.raises(ValueError, match="arm"):
        render_frame(dataclasses.replace(scene("orbbec"), arm=True))
