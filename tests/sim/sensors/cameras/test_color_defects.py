"""Colours of a real camera: every error has its stated size and leaves arm and brush as physics says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from camera_scenes import PLAIN, VEHICLE, facing
from defect_scenes import AT_LEFT, WALL, camera_of, edge_spread, left_edge, taken, with_errors

from sim.sensors.cameras import camera_intrinsics
from sim.sensors.cameras.exposure import line_kernel
from sim.sensors.cameras.view import View
from sim.sensors.vibration import BLADE_HZ

#: Rows of the left edge that the bottom edge and its blur leave alone.
ROWS = np.arange(10, 400)
FOCAL, HEIGHT = camera_intrinsics(PLAIN.camera)[0], 480
#: Standard deviation of the ideal lens and of the edge's antialiasing [px].
IDEAL_SIGMA = edge_spread(taken(PLAIN), 150)[1]


def depth_at(along: float) -> float:
    """Depth of the board's point at a place along it from `AT_LEFT` [m]."""
    view = View.of_vehicle(*AT_LEFT, VEHICLE.camera_position_m, (FOCAL, FOCAL, 0.0, 0.0))
    return float(view.to_camera(np.array([0.0, along, 0.0]))[2])


@pytest.mark.parametrize(
    ("twist", "speed"),
    [
        ((0.0, 0.5, 0.0, 0.0, 0.0, 0.0), -0.5 * FOCAL / depth_at(0.0)),  # to the right: the edge runs left [px/s]
        ((0.0, -0.2, 0.0, 0.0, 0.0, 0.0), 0.2 * FOCAL / depth_at(0.0)),
    ],
)
def test_rolling_shutter_skews_an_edge_by_the_motion_during_readout(twist: tuple[float, ...], speed: float) -> None:
    still = left_edge(taken(PLAIN), ROWS)
    skewed = left_edge(taken(with_errors(camera={"rolling_shutter_s": 0.02}), twist=twist), ROWS)
    row_time = (ROWS / (HEIGHT - 1) - 0.5) * 0.02
    assert np.abs(skewed - still - speed * row_time).max() < 0.06
    assert abs(np.ptp(speed * row_time)) > 2.0


def test_rolling_shutter_is_the_view_from_the_pose_at_the_time_of_the_row() -> None:
    twist, readout = np.array([0.3, 0.4, -0.3, 0.2, -0.3, 0.5]), 0.02
    frame = taken(with_errors(camera={"rolling_shutter_s": readout}), twist=tuple(twist))
    for row in (40, 200, 380):
        time = (row / (HEIGHT - 1) - 0.5) * readout
        turn = np.append(1.0, 0.5 * time * twist[3:])  # the attitude of `AT_LEFT` is level
        pose = AT_LEFT[0] + time * twist[:3], turn / np.linalg.norm(turn)
        expected = left_edge(taken(PLAIN, pose), np.array([row]))
        assert left_edge(frame, np.array([row])) == pytest.approx(expected, abs=0.1)


def test_shutter_and_motion_blur_leave_the_arm() -> None:
    camera = {"rolling_shutter_s": 0.05, "exposure_s": 0.02}
    still, moved = taken(PLAIN).rgb, taken(with_errors(camera=camera), twist=(0.0, 1.0, 0.0, 0.5, 0.0, 0.0)).rgb
    arm = camera_of(PLAIN).finish.mask > 0
    arm[1:-1, 1:-1] &= arm[2:, 1:-1] & arm[:-2, 1:-1] & arm[1:-1, 2:] & arm[1:-1, :-2]
    assert np.array_equal(still[arm], moved[arm])


def test_motion_blur_has_the_length_of_the_motion_during_exposure() -> None:
    frame = taken(with_errors(camera={"exposure_s": 0.01}), twist=(0.0, 0.8, 0.0, 0.0, 0.0, 0.0))
    length = 0.8 * 0.01 * FOCAL / depth_at(0.0)
    assert length > 8.0
    mean, sigma = edge_spread(frame, 150)
    interpolated = 1.0 / 6.0  # variance of the kernel's own pixels [px^2]
    assert sigma == pytest.approx(math.sqrt(length**2 / 12.0 + IDEAL_SIGMA**2 + interpolated), rel=0.03)
    assert mean == pytest.approx(edge_spread(taken(PLAIN), 150)[0], abs=0.05)


def test_line_kernel_keeps_brightness_and_place_in_every_direction() -> None:
    for u, v in ((0.0, 0.0), (0.3, -0.1), (6.0, 2.5), (-4.0, 4.0), (500.0, 0.0)):
        kernel = line_kernel(u, v)
        assert kernel.sum() == pytest.approx(1.0, abs=1e-5)
        assert kernel == pytest.approx(kernel[::-1, ::-1], abs=1e-6)
    rows, columns = np.nonzero(line_kernel(4.0, 4.0) > 0.05)
    assert np.corrcoef(rows, columns)[0, 1] > 0.9
    assert line_kernel(0.0, 0.0).shape == (1, 1)


@pytest.mark.parametrize("size", [0.5, 1.5, 4.0])
def test_defocus_is_a_gaussian_of_the_stated_width(size: float) -> None:
    _, sigma = edge_spread(taken(with_errors(camera={"defocus_px": size})), 150)
    assert sigma == pytest.approx(math.hypot(size, IDEAL_SIGMA), rel=0.05)


@pytest.mark.parametrize(("exposure", "expected"), [(0.006, FOCAL * 0.006 / math.sqrt(12.0)),
    (0.05, FOCAL / (2.0 * math.pi * BLADE_HZ))])  # fmt: skip
def test_vibration_blurs_by_rate_and_exposure_and_at_most_by_its_stroke(exposure: float, expected: float) -> None:
    _, sigma = edge_spread(taken(with_errors(vibration_rad_s=1.0, camera={"exposure_s": exposure})), 150)
    assert sigma == pytest.approx(math.hypot(expected, IDEAL_SIGMA), rel=0.06)


def test_brightness_steps_about_every_second_within_its_size_and_saturates() -> None:
    camera = camera_of(with_errors(camera={"exposure_steps": 0.8}), seed=4)
    wall = np.array([camera.capture(*AT_LEFT, k * 100_000_000).rgb[300, 30, 0] for k in range(300)], float)
    assert wall.min() >= 0.2 * WALL - 1.0 and wall.max() == 255.0
    assert wall.min() < 0.4 * WALL
    assert 20 <= np.count_nonzero(np.diff(wall)) <= 40  # of 30 s; some steps end in saturation


def test_distortion_moves_points_by_k1() -> None:
    k1 = -0.2
    frame = taken(with_errors(camera={"distortion_k1": k1}))
    rows = np.arange(150, 360, 10)
    column = float(left_edge(taken(PLAIN), np.array([200]))[0])
    x, y = (column - 319.5) / FOCAL, (np.linspace(0.0, 479.0, 4800) - 239.5) / FOCAL
    scale = 1.0 + k1 * (x * x + y * y)
    expected = np.interp(rows, scale * y * FOCAL + 239.5, scale * x * FOCAL + 319.5)
    assert np.abs(expected - column).max() > 2.0
    # The fill beyond the frame has the colour of the wall, so the count of wall pixels gives the edge.
    assert np.abs(left_edge(frame, rows) - expected).max() < 0.08


def test_distortion_moves_arm_colours_and_depth_together() -> None:
    finish, ideal = camera_of(with_errors(camera={"distortion_k1": 0.2})).finish, camera_of(PLAIN).finish
    assert np.array_equal(finish.defects.depth.placed(finish.depth_mask), finish.mask)
    assert np.array_equal(finish.depth_mask, ideal.mask) and np.count_nonzero(finish.mask != ideal.mask) > 100
    pulled = camera_of(with_errors(camera={"distortion_k1": -0.2})).finish
    assert pulled.mask[0].any(), "the arm reaches the border where the lens shows more than the picture"


def test_same_seed_same_bits_and_without_errors_today_s_bits() -> None:
    scene = with_errors(
        camera={"rolling_shutter_s": 0.02, "exposure_s": 0.01, "exposure_steps": 0.2, "distortion_k1": -0.05},
        depth={"noise_relative": 0.01, "disparity_step_px": 0.1, "edge_fattening_px": 3.0, "misregistration_px": 2.0},
    )
    twist, pose = np.array([0.1, 0.2, 0.0, 0.1, 0.0, 0.0]), facing(PLAIN, 0.3, 0.1, 0.1)

    def run(seed: int) -> bytes:
        camera = camera_of(scene, seed, noise=True)
        frames = [camera.capture(*pose, k * 10**9, twist) for k in range(3)]
        return b"".join(frame.rgb.tobytes() + frame.depth.tobytes() for frame in frames)

    assert run(1) == run(1) != run(2)
    plain, resting = camera_of(PLAIN, 1, noise=True), camera_of(PLAIN, 1, noise=True)
    for k in range(3):
        one, other = plain.capture(*pose, k * 10**9, twist), resting.capture(*pose, k * 10**9)
        assert np.array_equal(one.rgb, other.rgb) and np.array_equal(one.depth, other.depth)
