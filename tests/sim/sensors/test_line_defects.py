"""Errors of a real camera in the sensor model of lines, against points projected one by one."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from camera_scenes import VEHICLE, Pose, facing
from defect_scenes import with_errors

from ibvs_qp.frames import rotation_from_quaternion
from ibvs_qp.measurement import LineFeature
from ibvs_qp.quaternion import multiply, small_turn
from sim.sensors.cameras import camera_intrinsics
from sim.sensors.cameras.view import View
from sim.sensors.features import SIGMA_DISTANCE_M, GeometricFeatures
from sim.sensors.line_defects import PLANE_READINGS
from sim.world.board import BoardGeometry
from sim.world.painted_edges import PaintedEdges
from sim.world.scene import Scene

SCENE = Scene()
FOCAL, _, _, MIDDLE_ROW = camera_intrinsics(SCENE.camera)
POSE = facing(SCENE, 0.12, 0.06, 0.05, 1.0, -2.0, 3.0)
STILL = np.zeros(3)


def features_of(scene: Scene, seed: int = 0, noise: bool = False) -> GeometricFeatures:
    return GeometricFeatures(scene, VEHICLE, PaintedEdges(scene), seed, noise=noise)


def lines_of(scene: Scene, velocity: np.ndarray = STILL, rate: np.ndarray = STILL) -> dict[int, LineFeature]:
    return {line.track_id: line for line in features_of(scene).capture(*POSE, velocity, 0, rate).lines}


def seen_at(point: np.ndarray, pose: Pose) -> np.ndarray:
    view = View.of_vehicle(*pose, VEHICLE.camera_position_m, (1.0, 1.0, 0.0, 0.0))
    return view.pixels(point)


def fit(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle and direction of the least-squares line."""
    middle = points.mean(axis=0)
    return middle, np.linalg.svd(points - middle)[2][0]


def moved_pose(time: float, velocity: np.ndarray, rate: np.ndarray) -> Pose:
    position, quaternion = POSE
    turned = np.array(multiply(quaternion.tolist(), small_turn((time * rate).tolist())))
    return position + time * rotation_from_quaternion(quaternion) @ velocity, turned


def pieces(line: LineFeature) -> np.ndarray:
    """World points along the visible part of a line of the board, from where its ends are seen, (n, 3)."""
    assert line.segment is not None
    view = View.of_vehicle(*POSE, VEHICLE.camera_position_m, (1.0, 1.0, 0.0, 0.0))
    rays = np.column_stack((np.linspace(*line.segment, 41), np.ones(41))) @ view.rotation
    return view.center - rays * (view.center[0] / rays[:, :1])


@pytest.mark.parametrize("track", [1, 4])
def test_rolling_shutter_shows_every_row_from_its_own_pose(track: int) -> None:
    readout, velocity, rate = 0.02, np.array([0.1, 0.5, -0.3]), np.array([0.4, -0.3, 0.2])
    ideal = lines_of(SCENE)[track]
    line = lines_of(with_errors(SCENE, camera={"rolling_shutter_s": readout}), velocity, rate)[track]
    points = []
    for point in pieces(ideal):
        place = seen_at(point, POSE)
        for _ in range(5):
            place = seen_at(point, moved_pose(float(place[1]) * FOCAL / (2 * MIDDLE_ROW) * readout, velocity, rate))
        points.append(place)
    middle, along = fit(np.array(points))
    normal = np.array([math.cos(line.theta), math.sin(line.theta)])
    assert abs(normal @ middle - line.rho) < 0.05 / FOCAL and abs(normal @ along) < 2e-4
    assert abs(line.theta - ideal.theta) > 8e-4 and abs(line.rho - ideal.rho) > 0.1 / FOCAL


@pytest.mark.parametrize("track", [1, 4])
def test_distortion_moves_a_line_to_the_fit_of_its_points(track: int) -> None:
    k1 = -0.1
    ideal, line = lines_of(SCENE)[track], lines_of(with_errors(SCENE, camera={"distortion_k1": k1}))[track]
    points = np.array([seen_at(point, POSE) for point in pieces(ideal)])
    points *= 1.0 + k1 * (points**2).sum(axis=1, keepdims=True)
    middle, along = fit(points)
    normal = np.array([math.cos(line.theta), math.sin(line.theta)])
    assert abs(normal @ middle - line.rho) < 0.05 / FOCAL and abs(normal @ along) < 3e-4
    assert line.segment is not None
    assert np.abs(line.segment @ normal - line.rho).max() < 1e-9
    assert np.abs(line.segment - points[[0, -1]]).max() < 2.0 / FOCAL
    assert abs(line.theta - ideal.theta) > 1.5e-3 and abs(line.rho - ideal.rho) > 0.2 / FOCAL


def test_depth_noise_and_quantisation_widen_the_plane() -> None:
    def spread(scene: Scene) -> np.ndarray:
        features = features_of(scene, noise=True)
        planes = np.array([features.capture(*facing(SCENE, 0.7, 0.06, 0.3), STILL, k).plane for k in range(2000)])
        sizes = np.linalg.norm(planes[:, :3], axis=1)
        return np.array([(1.0 / sizes).std(), (planes[:, 0] / sizes).std(), (1.0 / sizes).mean()])

    step, noise = 0.5, 0.2
    plain = spread(SCENE)
    wide = spread(with_errors(SCENE, depth={"disparity_step_px": step, "noise_relative": noise}))
    distance = plain[2]
    rounding = distance**2 * step / (FOCAL * 0.05) / math.sqrt(12.0)
    white = distance * noise / math.sqrt(PLANE_READINGS)
    assert plain[0] == pytest.approx(SIGMA_DISTANCE_M, rel=0.05)
    assert wide[0] == pytest.approx(math.sqrt(SIGMA_DISTANCE_M**2 + rounding**2 + white**2), rel=0.05)
    assert wide[1] > 1.5 * plain[1]


def test_frames_are_lost_with_their_probability_and_the_others_stay() -> None:
    def stamps(scene: Scene) -> list[int]:
        scene = dataclasses.replace(scene, camera=dataclasses.replace(scene.camera, latency_s=0.0))
        features = features_of(scene)
        frames = [features.tick(k * 40_000_000, *POSE, STILL) for k in range(1000)]
        return [frame.stamp_ns for frame in frames if frame is not None]

    assert len(stamps(SCENE)) == 1000
    assert len(stamps(with_errors(SCENE, camera={"dropped": 0.3}))) == pytest.approx(700, abs=45)


def test_board_lies_where_the_test_puts_it() -> None:
    for point in pieces(lines_of(SCENE)[1]):
        assert BoardGeometry(SCENE).spot(*point[1:])[1] == pytest.approx(0.0, abs=1e-6)
