"""Depth of a real stereo camera, and lost pictures: every error has its stated size."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from camera_scenes import PLAIN, VEHICLE, facing
from defect_scenes import AT_LEFT, camera_of, taken, with_errors

from ibvs_qp.measurement import RgbdFrame
from sim.sensors.cameras import CameraStream, Dropouts, camera_intrinsics
from sim.world.random_streams import stream

FOCAL, BASELINE = camera_intrinsics(PLAIN.camera)[0], 0.05


def step_column(frame: RgbdFrame, row: int) -> int:
    """First column of the board behind the wall on its left."""
    depth = frame.depth[row, :250]
    return int(np.flatnonzero(depth < depth[0] - 0.03)[0])


def test_disparity_is_rounded_to_its_step() -> None:
    depth_m, step = 0.5, 0.2
    tip, camera = np.array(VEHICLE.tip_position_m), np.array(VEHICLE.camera_position_m)
    pose = facing(PLAIN, 0.7, 0.3, depth_m - float(tip[0] - camera[0]), 0.0, 0.0, 4.0)
    readings = taken(with_errors(depth={"disparity_step_px": step}), pose).depth[300:470, 20:620]
    steps = FOCAL * BASELINE / readings / step
    assert np.abs(steps - np.rint(steps)).max() < 1e-3
    values = np.unique(readings)
    near = values[np.argsort(np.abs(values - depth_m))[:2]]
    assert abs(near[1] - near[0]) == pytest.approx(depth_m**2 * step / (FOCAL * BASELINE), rel=0.03)  # 1.6 mm
    ideal = taken(PLAIN, pose).depth[300:470, 20:620]
    assert np.abs(readings - ideal).max() < 0.55 * ideal.max() ** 2 * step / (FOCAL * BASELINE)


@pytest.mark.parametrize("growth", [1, 5, 12])
def test_board_grows_over_the_wall_and_planes_stay(growth: int) -> None:
    scene = with_errors(depth={"edge_fattening_px": float(growth)})
    frame, ideal = taken(scene), taken(PLAIN)
    assert step_column(ideal, 300) - step_column(frame, 300) == growth
    changed = np.abs(frame.depth - ideal.depth) > 1e-6
    assert not changed[250:330, step_column(ideal, 300) + 1 : 620].any()
    assert not changed[:, : step_column(ideal, 300) - growth].any()


def test_tilted_plane_does_not_grow() -> None:
    pose = facing(PLAIN, 0.7, 0.3, 0.1, 3.0, 4.0, 15.0)
    frame, ideal = taken(with_errors(depth={"edge_fattening_px": 4.0}), pose), taken(PLAIN, pose)
    below = slice(300, 470)
    assert np.array_equal(frame.depth[below, 20:620], ideal.depth[below, 20:620])


def test_holes_lie_beyond_the_grown_board_and_arm() -> None:
    scene = with_errors(depth={"edge_fattening_px": 6.0})
    holes = camera_of(scene, noise=True).capture(*AT_LEFT, 0).depth[150:330, :250] == 0.0
    rim = step_column(taken(PLAIN), 300)
    assert holes[:, rim - 12 : rim - 6].any(axis=1).all() and not holes[:, rim - 4 : rim + 1].any()
    ideal, grown = camera_of(PLAIN).finish, camera_of(scene).finish
    assert not np.isin(np.flatnonzero(ideal.defects.depth.grown(ideal.mask)), grown.no_depth).all()
    assert not grown.defects.depth.grown(grown.mask).reshape(-1)[grown.no_depth].any()


def test_white_noise_has_its_stated_size() -> None:
    truth = taken(PLAIN).depth
    quiet = dataclasses.replace(PLAIN, camera=dataclasses.replace(PLAIN.camera, depth_noise_relative=0.0))
    camera = camera_of(with_errors(quiet, depth={"noise_relative": 0.02}), noise=True)
    errors = (camera.capture(*AT_LEFT, 0).depth / truth - 1.0)[200:300, 260:600]
    assert errors.std() == pytest.approx(0.02, rel=0.03)
    neighbours = np.corrcoef(errors[:, 1:].ravel(), errors[:, :-1].ravel())[0, 1]
    assert abs(neighbours) < 0.03


def test_depth_is_shifted_against_colour_in_a_direction_of_the_seed() -> None:
    scene, ideal = with_errors(depth={"misregistration_px": 8.0}), taken(PLAIN)
    seen = set()
    for seed in range(4):
        camera = camera_of(scene, seed)
        shift = camera.finish.defects.depth.shift_px
        assert np.hypot(*shift) == pytest.approx(8.0)
        right, down = np.rint(shift).astype(int).tolist()
        frame = camera.capture(*AT_LEFT, 0)
        rolled = np.roll(ideal.depth, (down, right), (0, 1))
        assert np.array_equal(frame.depth[20:-20, 20:-20], rolled[20:-20, 20:-20])
        assert np.array_equal(frame.rgb, ideal.rgb)
        seen.add((right, down))
    assert len(seen) == 4


def test_distorted_depth_keeps_its_readings() -> None:
    frame, ideal = taken(with_errors(camera={"distortion_k1": 0.1})), taken(PLAIN)
    assert set(np.unique(frame.depth)) <= set(np.unique(ideal.depth))
    assert step_column(frame, 300) < step_column(ideal, 300)


@pytest.mark.parametrize("probability", [0.0, 0.3])
def test_pictures_are_lost_with_their_probability(probability: float) -> None:
    class Counter:
        intrinsics = (1.0, 1.0, 0.0, 0.0)

        def capture(self, *_: object) -> RgbdFrame:
            blank = np.zeros((1, 1, 3), np.uint8)
            return RgbdFrame(rgb=blank, depth=np.ones((1, 1), np.float32), intrinsics=self.intrinsics, stamp_ns=0)

    pictures = CameraStream(Counter(), 100.0, 0.0, Dropouts(probability, stream(1, "dropped pictures")))
    pose = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    got = sum(pictures.tick(k * 10_000_000, *pose) is not None for k in range(2000))
    assert got / 2000 == pytest.approx(1.0 - probability, abs=0.03 if probability else 0.0)
