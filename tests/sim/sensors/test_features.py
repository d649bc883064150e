"""Geometric features: the analytic lines without noise, the stated noise with it, and only what can be seen."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA, rotation_from_quaternion
from ibvs_qp.measurement import FeatureFrame, LineFeature
from ibvs_qp.pilot.painting.pattern import CORNERS, PATTERNS
from sim.sensors.features import BOARD_TRACKS, GeometricFeatures, add_sigma_vs
from sim.world.board import BoardGeometry
from sim.world.canvas import Canvas
from sim.world.painted_edges import PaintedEdges
from sim.world.scene import BoardScene, CameraScene, FeaturesScene, PaintScene, Scene

VEHICLE = VehicleParams()
SCENE = Scene()
GEOMETRY = BoardGeometry(SCENE)
LEFT, RIGHT = GEOMETRY.row_ends
ROW1, ROW2 = GEOMETRY.row_height(1), GEOMETRY.row_height(2)
STILL = np.zeros(3)
Pose = tuple[np.ndarray, np.ndarray]


def facing(scene: Scene, along: float, up: float, distance: float, roll: float = 0.0, yaw: float = 0.0) -> Pose:
    """Pose whose level tip would face the board point (along, up) at a distance [m]; roll, then yaw [deg]."""
    y, z = BoardGeometry(scene).point(along, up)
    r, w = 0.5 * math.radians(roll), 0.5 * math.radians(yaw)
    attitude = np.array(
        [math.cos(r) * math.cos(w), math.sin(r) * math.cos(w), math.sin(r) * math.sin(w), math.cos(r) * math.sin(w)]
    )
    return np.array([-distance - VEHICLE.tip_position_m[0], y, z]), attitude


def normalised(point: np.ndarray, pose: Pose) -> np.ndarray:
    """Independent projection of a world point, normalised."""
    body = rotation_from_quaternion(pose[1]).T @ (point - pose[0]) - np.array(VEHICLE.camera_position_m)
    x, y, z = R_BODY_CAMERA.T @ body
    return np.array([x / z, y / z])


def on_board(scene: Scene, along: float, up: float) -> np.ndarray:
    return np.append(0.0, BoardGeometry(scene).point(along, up))


def offset(line: LineFeature, point: np.ndarray) -> float:
    return float(point @ (math.cos(line.theta), math.sin(line.theta)) - line.rho)


def by_track(frame: FeatureFrame) -> dict[int, LineFeature]:
    return {line.track_id: line for line in frame.lines}


def painted_c(end_along: float = 0.7) -> PaintedEdges:
    """Row 1, the climb, and row 2 up to a place, in steps of the control rate."""
    edges = PaintedEdges(SCENE)
    corners = [(RIGHT, ROW1), (LEFT, ROW1), (LEFT, ROW2), (end_along, ROW2)]
    edges.stroke(None, corners[0])
    for start, stop in itertools.pairwise(corners):
        path = np.linspace(start, stop, 1 + math.ceil(math.dist(start, stop) / 0.0004))
        for previous, current in itertools.pairwise(path):
            edges.stroke(previous, current)
    return edges


@pytest.mark.parametrize("slope", [0.0, 2.0, -3.0])
@pytest.mark.parametrize(("along", "up", "distance", "roll", "yaw"), [
    (0.7, 0.05, 0.0, 0.0, 0.0), (1.35, 0.05, 0.45, 2.0, -4.0), (0.08, 0.12, 0.0, -1.0, 3.0), (0.7, 0.3, 0.5, 1.0, 9.0),
])  # fmt: skip
def test_lines_without_noise_are_the_projected_edges(
    slope: float, along: float, up: float, distance: float, roll: float, yaw: float
) -> None:
    scene = dataclasses.replace(SCENE, board=BoardScene(slope_deg=slope))
    pose = facing(scene, along, up, distance, roll, yaw)
    frame = GeometricFeatures(scene, VEHICLE, PaintedEdges(scene), 0, noise=False).capture(*pose, STILL, 7)
    assert frame.stamp_ns == 7 and frame.lines
    width, height = scene.board.width_m, scene.board.height_m
    ends = {
        BOARD_TRACKS["bottom"]: ((0, 0), (width, 0)),
        BOARD_TRACKS["top"]: ((0, height), (width, height)),
        BOARD_TRACKS["left"]: ((0, 0), (0, height)),
        BOARD_TRACKS["right"]: ((width, 0), (width, height)),
    }
    middle = normalised(on_board(scene, along, 0.5 * height), pose)
    for line in frame.lines:
        for end in ends[line.track_id]:
            assert offset(line, normalised(on_board(scene, *end), pose)) == pytest.approx(0.0, abs=1e-9)
        assert line.kind == "board" and line.stamp_ns == 7 and line.segment is not None
        assert np.sign(offset(line, middle)) == line.surface_side
        horizontal = line.track_id in (1, 3)
        assert line.role == ("horizontal" if horizontal else "vertical")
        assert abs(line.theta - (0.5 * math.pi if horizontal else 0.0)) < math.radians(12.0)
        for point in line.segment:
            assert offset(line, point) == pytest.approx(0.0, abs=1e-9)
            assert abs(point[0]) <= 320.0 / 625.2 + 1e-4 and abs(point[1]) <= 240.0 / 625.2 + 1e-4


def test_nominal_contact_figures() -> None:
    features = GeometricFeatures(SCENE, VEHICLE, painted_c(), 0, noise=False)
    frame = features.capture(*facing(SCENE, 0.7, ROW2, 0.0), STILL, 0)
    fy, cy = features.intrinsics[1], features.intrinsics[3]
    rows = {track: line.rho * fy + cy for track, line in by_track(frame).items()}
    assert rows[11] == pytest.approx(179.5, abs=0.1), "the guide of row 2"
    assert rows[12] == pytest.approx(89.5, abs=0.1), "row 2's own upper edge"
    assert frame.plane == pytest.approx((0.0, 0.0, 2.0, -1.0))
    row1 = GeometricFeatures(SCENE, VEHICLE, PaintedEdges(SCENE), 0, noise=False)
    bottom = by_track(row1.capture(*facing(SCENE, 0.7, ROW1, 0.0), STILL, 0))[1]
    assert bottom.rho * fy + cy == pytest.approx(202.0, abs=0.1)


def test_upper_edge_of_the_row_below_exists_only_ahead_of_the_brush() -> None:
    features = GeometricFeatures(SCENE, VEHICLE, painted_c(0.7), 0, noise=False)
    pose = facing(SCENE, 0.7, ROW2, 0.0)
    lines = by_track(features.capture(*pose, STILL, 0))
    tip = normalised(on_board(SCENE, 0.7, ROW2), pose)
    guide, own = lines[11], lines[12]
    assert guide.segment is not None and own.segment is not None
    assert guide.kind == own.kind == "paint" and guide.role == own.role == "horizontal"
    metres = 0.5  # depth of the board: normalised to metres along it
    ahead = (guide.segment[:, 0] - tip[0]) * metres
    assert 0.03 < ahead.min() < 0.06 and ahead.max() > 0.24
    behind = (own.segment[:, 0] - tip[0]) * metres
    assert behind.max() < 0.0
    above = normalised(on_board(SCENE, 0.7, ROW2 + 0.15), pose)
    for line in (guide, own):
        assert np.sign(offset(line, above)) == line.surface_side, "its surface is the unpainted side"


def test_painted_edge_follows_the_strokes_not_the_plan() -> None:
    edges = PaintedEdges(SCENE)
    edges.stroke((RIGHT, ROW1 + 0.004), (LEFT, ROW1 - 0.006))  # a sloped row
    pose = facing(SCENE, 0.5, ROW1 + 0.02, 0.1, 1.0, 2.0)
    features = GeometricFeatures(SCENE, VEHICLE, edges, 0, noise=False)
    line = by_track(features.capture(*pose, STILL, 0))[11]
    for along in (LEFT, RIGHT):
        height = ROW1 - 0.006 + 0.010 * (along - LEFT) / (RIGHT - LEFT) + 0.04
        assert offset(line, normalised(on_board(SCENE, along, height), pose)) == pytest.approx(0.0, abs=2e-5)


def test_a_climb_is_no_part_of_a_row() -> None:
    edges = painted_c(0.7)
    rows, uv = edges.exposed()
    points = edges.on_board(uv)
    first = points[rows == 1]
    assert first[:, 0].min() > 0.7 + 0.03
    assert np.abs(first[:, 1] - ROW1 - 0.04).max() < 1e-9
    assert np.abs(points[rows == 2][:, 1] - ROW2 - 0.04).max() < 1e-9


def test_canvas_records_the_edges_too() -> None:
    scene = Scene(board=BoardScene(clutter=0))
    canvas = Canvas(scene, 0)
    canvas.stroke(None, (RIGHT, ROW1))
    canvas.stroke((RIGHT, ROW1), (0.6, ROW1))
    frame = GeometricFeatures(scene, VEHICLE, canvas, 0, noise=False).capture(*facing(scene, 0.6, ROW1, 0), STILL, 0)
    paint = by_track(frame)[11]
    top = 0.6 - (canvas.coverage[:, 1000] > 0.5).argmax() / 1000.0
    pose = facing(scene, 0.6, ROW1, 0)
    assert offset(paint, normalised(on_board(scene, 1.0, top), pose)) == pytest.approx(0.0, abs=1e-3)


def test_lines_outside_the_picture_are_not_reported() -> None:
    features = GeometricFeatures(SCENE, VEHICLE, PaintedEdges(SCENE), 0, noise=False)
    assert set(by_track(features.capture(*facing(SCENE, 0.7, 0.05, 0.0), STILL, 0))) == {1}
    assert set(by_track(features.capture(*facing(SCENE, 1.35, 0.05, 0.45), STILL, 0))) == {1, 2}
    assert set(by_track(features.capture(*facing(SCENE, 0.05, 0.05, 0.0), STILL, 0))) == {1, 4}
    assert not features.capture(*facing(SCENE, 0.7, 0.35, 0.0), STILL, 0).lines


def test_noise_matches_the_covariance_and_tracks_are_stable() -> None:
    pose = facing(SCENE, 0.05, 0.05, 0.0)
    features = GeometricFeatures(SCENE, VEHICLE, PaintedEdges(SCENE), 3)
    clean = by_track(GeometricFeatures(SCENE, VEHICLE, PaintedEdges(SCENE), 3, noise=False).capture(*pose, STILL, 0))
    frames = [features.capture(*pose, np.array([0.1, 0.0, 0.0]), k) for k in range(600)]
    assert all(set(by_track(frame)) == {1, 4} for frame in frames)
    for track, truth in clean.items():
        lines = [by_track(frame)[track] for frame in frames]
        spread = np.array([(line.rho - truth.rho, line.theta - truth.theta) for line in lines])
        assert spread.std(axis=0) == pytest.approx([2e-4, 1e-3], rel=0.1)
        assert np.sqrt(np.diag(lines[0].covariance)) == pytest.approx([2e-4, 1e-3])
        segment = lines[0].segment
        assert segment is not None and abs(offset(lines[0], segment[0])) < 1e-12
    velocities = np.array([frame.velocity for frame in frames])
    assert velocities.mean(axis=0) == pytest.approx([0.1, 0.0, 0.0], abs=5e-4)
    assert velocities.std(axis=0) == pytest.approx([0.003] * 3, rel=0.15)
    assert frames[0].velocity_covariance is not None
    assert np.diag(frames[0].velocity_covariance) == pytest.approx([9e-6] * 3)
    assert frames[5].velocity_stamp_ns == 5
    normals = np.array([frame.plane[:3] for frame in frames if frame.plane])
    distance = 1.0 / np.linalg.norm(normals, axis=1)
    assert distance.mean() == pytest.approx(0.5, abs=2e-4) and distance.std() == pytest.approx(1e-3, rel=0.15)
    tilt = np.degrees(normals[:, :2] / normals[:, 2:]).std(axis=0)
    assert tilt == pytest.approx([0.1, 0.1], rel=0.15)


def test_sigma_vs_is_added_and_told_to_nobody() -> None:
    pose = facing(SCENE, 0.7, 0.05, 0.0)
    scene = dataclasses.replace(SCENE, features=FeaturesScene(sigma_vs=0.02))
    features = GeometricFeatures(scene, VEHICLE, PaintedEdges(scene), 0)
    lines = [by_track(features.capture(*pose, STILL, k))[1] for k in range(600)]
    assert np.std([line.rho for line in lines]) == pytest.approx(0.02, rel=0.1)
    assert np.std([line.theta for line in lines]) == pytest.approx(0.02, rel=0.1)
    assert lines[0].covariance[0, 0] == pytest.approx(4e-8)
    plain = GeometricFeatures(SCENE, VEHICLE, PaintedEdges(SCENE), 0, noise=False).capture(*pose, STILL, 0)
    assert add_sigma_vs(plain, 0.0, np.random.default_rng(0)) is plain
    moved = add_sigma_vs(plain, 0.05, np.random.default_rng(0))
    assert moved.lines[0].rho != plain.lines[0].rho and moved.plane == plain.plane
    assert np.array_equal(moved.lines[0].covariance, plain.lines[0].covariance)


def test_frames_come_at_the_cameras_rate_and_late() -> None:
    scene = dataclasses.replace(SCENE, camera=CameraScene(latency_s=0.05))
    features = GeometricFeatures(scene, VEHICLE, PaintedEdges(scene), 0, noise=False)
    tick, seen = 4_000_000, []
    for k in range(251):
        position, attitude = facing(scene, 0.7, 0.05, 0.001 * k)
        frame = features.tick(k * tick, position, attitude, STILL)
        if frame is not None:
            seen.append(frame)
            assert 50_000_000 <= k * tick - frame.stamp_ns < 54_000_000
            assert frame.plane is not None
            assert 1.0 / frame.plane[2] == pytest.approx(0.5 + 0.001 * frame.stamp_ns / tick)
    assert 28 <= len(seen) <= 30


def test_same_seed_same_bits() -> None:
    pose = facing(SCENE, 0.05, 0.05, 0.0)

    def run(seed: int) -> list[float]:
        features = GeometricFeatures(SCENE, VEHICLE, painted_c(0.3), seed)
        return [line.rho for k in range(5) for line in features.capture(*pose, STILL, k).lines]

    assert run(1) == run(1) != run(2)


@pytest.mark.parametrize("kind", PATTERNS)
@pytest.mark.parametrize("start", CORNERS)
def test_the_outer_edge_of_a_stroke_is_reported_in_every_pattern(kind: str, start: str) -> None:
    scene = Scene(board=BoardScene(width_m=1.4, height_m=1.4), paint=PaintScene(pattern=kind, start=start))
    geometry, edges = BoardGeometry(scene), PaintedEdges(scene)
    begin, end = geometry.stroke_ends
    place = geometry.stroke_place(1)
    path = geometry.from_pattern(np.column_stack((np.linspace(begin, end, 200), np.full(200, place))))
    for previous, current in itertools.pairwise(path):
        edges.stroke(previous, current)
    spot = geometry.from_pattern(np.array((0.7, geometry.stroke_place(2))))
    pose = facing(scene, *spot, 0.0)
    lines = by_track(GeometricFeatures(scene, VEHICLE, edges, 0, noise=False).capture(*pose, STILL, 0))
    line = lines[11]
    along, up = geometry.from_pattern(np.array((0.8, place + 0.04)))
    assert offset(line, normalised(on_board(scene, along, up), pose)) == pytest.approx(0.0, abs=1e-6)
    assert line.role == geometry.pattern.guide_role and line.kind == "paint"
    along, up = geometry.from_pattern(np.array((0.8, place + 0.08)))
    assert np.sign(offset(line, normalised(on_board(scene, along, up), pose))) == line.surface_side
