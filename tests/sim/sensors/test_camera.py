"""Plane camera against the analytic projection, its noise and its vehicle parts."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest
from camera_scenes import PLAIN, VEHICLE, Pose, facing, flat_canvas, sloped, step_positions

from sim.sensors.cameras import PlaneCamera, camera_intrinsics
from sim.sensors.cameras.view import View
from sim.world.canvas import Canvas
from sim.world.scene import CameraScene, Scene

BOTTOM_POSES = [
    (0.0, facing(PLAIN, 0.7, 0.05, 0.0)),
    (0.0, facing(PLAIN, 0.7, 0.05, 0.0, 3.0, -1.0, 0.0)),
    (0.0, facing(PLAIN, 0.7, 0.05, 0.2, -2.0, 1.5, 8.0)),
    (0.0, facing(PLAIN, 0.8, 0.05, 0.45, 1.0, 2.0, -5.0)),
    (0.0, facing(PLAIN, 0.6, 0.09, 0.0, 0.3, -0.2, -4.0)),
    (2.0, facing(sloped(PLAIN, 2.0), 0.7, 0.05, 0.0, 0.0, 0.0, 1.0)),
    (-4.0, facing(sloped(PLAIN, -4.0), 0.7, 0.05, 0.1, 1.0, -0.5, 3.0)),
]


@pytest.mark.parametrize(("slope", "pose"), BOTTOM_POSES)
def test_bottom_edge_lies_where_geometry_puts_it(slope: float, pose: Pose) -> None:
    scene = sloped(PLAIN, slope)
    camera = PlaneCamera(scene, VEHICLE, flat_canvas(scene), 0, noise=False)
    frame = camera.capture(*pose, 0)
    view = View.of_vehicle(*pose, VEHICLE.camera_position_m, camera.intrinsics)
    yz = camera.canvas.geometry.point(np.array([0.0, 1.4]), np.zeros(2))
    (u0, v0), (u1, v1) = view.pixels(np.column_stack((np.zeros(2), yz)))
    columns = np.r_[5:180, 460:635]  # clear of arm and brush
    expected = v0 + (columns - u0) * (v1 - v0) / (u1 - u0)
    measured = step_positions(frame.rgb[..., 0].astype(float)[:, columns], 40.0, 150.0)
    error = measured - expected
    assert abs(error.mean()) < 0.02 and np.abs(error).max() < 0.05


@pytest.mark.parametrize(
    ("slope", "angles"),
    [(0.0, (0.0, 0.0, 0.0)), (0.0, (2.0, 1.0, 6.0)), (0.0, (-4.0, 0.0, -7.0)), (-3.0, (1.0, 0.0, 2.0))],
)
def test_left_edge_lies_where_geometry_puts_it(slope: float, angles: tuple[float, float, float]) -> None:
    scene = sloped(PLAIN, slope)
    camera = PlaneCamera(scene, VEHICLE, flat_canvas(scene), 0, noise=False)
    pose = facing(scene, 0.13, 0.25, 0.05, *angles)
    frame = camera.capture(*pose, 0)
    view = View.of_vehicle(*pose, VEHICLE.camera_position_m, camera.intrinsics)
    yz = camera.canvas.geometry.point(np.zeros(2), np.array([0.0, 0.6]))
    (u0, v0), (u1, v1) = view.pixels(np.column_stack((np.zeros(2), yz)))
    rows = np.arange(200, 420)
    expected = u0 + (rows - v0) * (u1 - u0) / (v1 - v0)
    crop = frame.rgb[rows, :300, 0].astype(float)
    measured = (crop - 40.0).sum(axis=1) / 110.0 - 0.5
    assert np.abs(measured - expected).max() < 0.05


def test_nominal_contact_shows_the_guide_at_202_and_the_tip_at_140() -> None:
    scene = Scene()
    camera = PlaneCamera(scene, VEHICLE, flat_canvas(scene), 0, noise=False)
    fx, fy, cx, cy = camera.intrinsics
    assert (fx, fy, cx, cy) == pytest.approx((625.2, 625.2, 319.5, 239.5), abs=0.05)
    pose = facing(scene, 0.7, 0.05, 0.0)
    view = View.of_vehicle(*pose, VEHICLE.camera_position_m, camera.intrinsics)
    tip = pose[0] + np.array(VEHICLE.tip_position_m)
    assert view.pixels(tip) == pytest.approx([319.5, 139.5], abs=0.6)
    grey = camera.capture(*pose, 0).rgb[:, 40].astype(float)
    assert np.abs(np.diff(grey.sum(axis=1))).argmax() == pytest.approx(202, abs=1)
    small = CameraScene(width=424, height=240)
    assert camera_intrinsics(small)[0] == pytest.approx(312.6, abs=0.05)


def test_depth_without_noise_is_the_two_planes() -> None:
    for slope, angles in ((0.0, (0.0, 0.0, 0.0)), (2.0, (2.0, -1.0, 6.0))):
        scene = sloped(PLAIN, slope)
        camera = PlaneCamera(scene, VEHICLE, flat_canvas(scene), 0, noise=False)
        pose = facing(scene, 0.7, 0.05, 0.1, *angles)
        depth = camera.capture(*pose, 0).depth
        view = View.of_vehicle(*pose, VEHICLE.camera_position_m, camera.intrinsics)
        fx, fy, cx, cy = camera.intrinsics
        for u, v, x in ((30, 20, 0.0), (600, 60, 0.0), (30, 420, 0.05), (600, 460, 0.05)):
            ray = view.rotation.T @ np.array([(u - cx) / fx, (v - cy) / fy, 1.0])
            assert depth[v, u] == pytest.approx((x - view.center[0]) / ray[0], abs=1e-5)


def test_depth_noise_has_its_stated_size() -> None:
    scene = Scene()
    canvas = Canvas(scene, 0)
    noisy, clean = PlaneCamera(scene, VEHICLE, canvas, 5), PlaneCamera(scene, VEHICLE, canvas, 5, noise=False)
    pose = facing(scene, 0.7, 0.40, 0.0)  # board all over
    truth = clean.capture(*pose, 0).depth
    errors = np.array([noisy.capture(*pose, k).depth / truth - 1.0 for k in range(60)])[:, 250:470, 20:620]
    assert errors.std() == pytest.approx(np.hypot(0.005, 0.005), rel=0.15)
    white = (errors[:, :, 1:] - errors[:, :, :-1]).std() / np.sqrt(2.0)
    assert white == pytest.approx(0.005, rel=0.05), "neighbours differ by the white part"
    near = (errors[:, :, :-8] * errors[:, :, 8:]).mean()
    far = (errors[:, :, :-60] * errors[:, :, 60:]).mean()
    assert near > 0.5 * 0.005**2, "8 px apart the correlated part still holds together"
    assert abs(far) < 0.3 * 0.005**2
    common = np.median(errors.reshape(60, -1), axis=1) * 0.5  # metres
    assert common.std() == pytest.approx(0.001, rel=0.4)


def test_color_noise_has_its_stated_size() -> None:
    scene = PLAIN
    canvas = flat_canvas(scene)
    camera = PlaneCamera(scene, VEHICLE, canvas, 5)
    pose = facing(scene, 0.7, 0.40, 0.0)
    first, second = (camera.capture(*pose, k).rgb[250:].astype(float) for k in range(2))
    assert first.std() == pytest.approx(2.0, rel=0.05)
    assert (first - second).std() == pytest.approx(2.0 * np.sqrt(2.0), rel=0.05), "every frame has fresh noise"
    assert abs(first.mean() - 40.0) < 0.05


def test_holes_run_along_the_depth_step_and_nowhere_else() -> None:
    scene = Scene()
    camera = PlaneCamera(scene, VEHICLE, Canvas(scene, 0), 0)
    depth = camera.capture(*facing(scene, 0.7, 0.05, 0.0), 0).depth
    holes = depth == 0.0
    clear = np.r_[5:200, 440:635]
    assert holes[199:208, clear].any(axis=0).mean() > 0.95
    assert not holes[225:, :].any() and not holes[:195, clear].any()
    per_column = holes[:, clear].sum(axis=0)
    assert per_column.min() >= 1 and per_column.max() <= 8 and np.unique(per_column).size > 1
    assert 0.4 < np.median(depth[130:150, 300:340]) < 0.52, "the brush has its own depth"


def test_steps_hidden_by_the_brush_leave_no_holes_in_it() -> None:
    scene = Scene()
    camera = PlaneCamera(scene, VEHICLE, Canvas(scene, 0), 0)
    depth = camera.capture(*facing(scene, 1.40, 0.05, 0.0), 0).depth  # the right edge runs behind the brush
    assert (depth[100:170, 300:340] > 0.25).all()


def test_arm_hangs_from_above_and_the_brush_hides_its_footprint() -> None:
    scene = Scene()
    canvas = Canvas(scene, 0)
    camera = PlaneCamera(scene, VEHICLE, canvas, 0, noise=False)
    canvas.stroke((1.0, 0.05), (0.7, 0.05))
    rgb = camera.capture(*facing(scene, 0.7, 0.05, 0.0), 0).rgb.astype(int)
    paint = np.abs(rgb - np.array(scene.paint.color)).max(axis=2) < 25
    rows, columns = np.mgrid[:480, :640]
    footprint = np.hypot(columns - 319.5, rows - 139.5) < 0.04 * 1250.0 - 2.0
    assert not paint[footprint].any(), "no paint within the footprint"
    assert paint[100:180, 400:630].mean() > 0.95, "paint to the right of it"
    assert (rgb[5, 300:340].max(axis=1) < 90).all(), "the arm enters at the top"
    assert rgb[5, 200].min() > 200


def test_propellers_stay_outside_the_nominal_picture_and_enter_a_wider_one() -> None:
    scene = Scene()
    canvas = Canvas(scene, 0)
    assert PlaneCamera(scene, VEHICLE, canvas, 0).finish.propeller_box is None
    wide = dataclasses.replace(scene, camera=CameraScene(vertical_fov_deg=75.0))
    camera = PlaneCamera(wide, VEHICLE, canvas, 0)
    box = camera.finish.propeller_box
    assert box is not None and box[0] == 0 and box[1] < 240, "from above, in the upper half"
    depth = camera.capture(*facing(wide, 0.7, 0.05, 0.0), 0).depth
    assert (depth[0, :3] == 0.0).all() or (depth[0, -3:] == 0.0).all()


def test_a_stroke_appears_in_the_next_frame() -> None:
    scene = Scene()
    canvas = Canvas(scene, 0)
    camera = PlaneCamera(scene, VEHICLE, canvas, 0)
    pose = facing(scene, 0.7, 0.05, 0.0)
    before = camera.capture(*pose, 0).rgb
    canvas.stroke((0.85, 0.05), (0.80, 0.05))
    after = camera.capture(*pose, 1).rgb
    spot = (slice(130, 150), slice(440, 500))  # 0.10 to 0.14 m right of the tip
    assert np.abs(after[spot].astype(float).mean(axis=(0, 1)) - scene.paint.color).max() < 6.0
    assert np.abs(before[spot].astype(float).mean(axis=(0, 1)) - scene.board.color).max() < 6.0


def test_painted_edge_lies_where_the_brush_went() -> None:
    scene = PLAIN
    canvas = flat_canvas(scene)
    canvas._blank[..., :3], canvas._fresh[..., :3] = scene.board.color, (200, 200, 200)
    canvas.stroke((1.2, 0.05), (0.2, 0.05))
    camera = PlaneCamera(scene, VEHICLE, canvas, 0, noise=False)
    for angles, distance in (((0.0, 0.0, 0.0), 0.0), ((1.5, -1.0, 4.0), 0.0), ((-1.0, 0.5, -3.0), 0.3)):
        pose = facing(scene, 0.7, 0.05, distance, *angles)
        grey = camera.capture(*pose, 0).rgb[..., 0].astype(float)
        view = View.of_vehicle(*pose, VEHICLE.camera_position_m, camera.intrinsics)
        ends = canvas.geometry.point(np.array([0.0, 1.4]), np.full(2, 0.09))
        (u0, v0), (u1, v1) = view.pixels(np.column_stack((np.zeros(2), ends)))
        columns = np.r_[20:190, 450:620]
        expected = v0 + (columns - u0) * (v1 - v0) / (u1 - u0)
        window = grey[: int(expected.max()) + 12, columns]
        measured = step_positions(window, 40.0, 200.0)
        assert abs((measured - expected).mean()) < 0.05


def test_the_wall_moves_with_its_own_depth() -> None:
    scene = dataclasses.replace(PLAIN, board=dataclasses.replace(PLAIN.board, gap_m=0.10))
    canvas = flat_canvas(scene)
    y, z = canvas.geometry.point(0.7, -0.10)
    column, row = ((np.array([y, z]) - canvas.wall_origin) * canvas.wall_pixels_per_m - 0.5).round().astype(int)
    cv2.circle(canvas.wall, (int(column), int(row)), 4, (255, 0, 0, 255), -1)
    y, z = canvas.wall_origin + (np.array([column, row]) + 0.5) / canvas.wall_pixels_per_m
    camera = PlaneCamera(scene, VEHICLE, canvas, 0, noise=False)
    pose = facing(scene, 0.75, 0.05, 0.1, 1.0, 0.0, 5.0)
    rgb = camera.capture(*pose, 0).rgb.astype(float)
    mark = np.clip(rgb[..., 0] - rgb[..., 1], 0, None) * (np.arange(480)[:, None] > 210)
    rows, columns = np.mgrid[:480, :640]
    found = np.array([(mark * columns).sum(), (mark * rows).sum()]) / mark.sum()
    view = View.of_vehicle(*pose, VEHICLE.camera_position_m, camera.intrinsics)
    assert found == pytest.approx(view.pixels(np.array([0.10, y, z])), abs=0.3)


@pytest.mark.parametrize("along", [-3.0, 5.0])
def test_a_board_out_of_view_leaves_the_wall(along: float) -> None:
    scene = PLAIN
    camera = PlaneCamera(scene, VEHICLE, flat_canvas(scene), 0, noise=False)
    frame = camera.capture(*facing(scene, along, 0.05, 0.2), 0)
    assert (frame.rgb[200:] == 150).all()
    assert frame.depth[300, 100] == pytest.approx(0.75, abs=1e-4)


def test_wild_attitudes_yield_finite_frames() -> None:
    scene = Scene()
    camera = PlaneCamera(scene, VEHICLE, Canvas(scene, 0), 0)
    for angles in ((40.0, 30.0, 60.0), (170.0, 10.0, 85.0), (0.0, -70.0, 0.0), (0.0, 0.0, 180.0)):
        frame = camera.capture(*facing(scene, 0.7, 0.05, 0.3, *angles), 0)
        assert np.isfinite(frame.depth).all() and frame.depth.min() >= 0.0


def test_frames_own_their_arrays_and_repeat_to_the_bit() -> None:
    scene = Scene()
    poses = [facing(scene, 0.7 + 0.01 * k, 0.05, 0.0, 0.1 * k, 0.0, 0.0) for k in range(3)]
    runs = []
    for _ in range(2):
        camera = PlaneCamera(scene, VEHICLE, Canvas(scene, 2), 2)
        runs.append([camera.capture(*pose, k) for k, pose in enumerate(poses)])
    for one, other in zip(*runs, strict=True):
        assert np.array_equal(one.rgb, other.rgb) and np.array_equal(one.depth, other.depth)
    first = runs[0][0]
    assert first.rgb.base is None and first.depth.base is None
    assert not np.array_equal(first.rgb, runs[0][1].rgb)
    other_seed = PlaneCamera(scene, VEHICLE, Canvas(scene, 2), 3).capture(*poses[0], 0)
    assert not np.array_equal(first.depth, other_seed.depth)
