"""Shapes of the wall: chart and tangent axes belong together, rays meet them, and the tip touches them as they are."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY, rotation_from_quaternion
from sim.sensors.suite import SensorSuite
from sim.world.board import BoardGeometry
from sim.world.plant import Plant
from sim.world.scene import BoardScene, ImuScene, Scene, StartScene, SurfaceScene
from sim.world.surfaces import SIDES, Surface
from sim.world.trim import hover_thrusts

SMALLEST_M = 1.5
CURVED = [
    SurfaceScene(kind="cylinder", radius_m=SMALLEST_M, axis=axis, side=side)
    for axis in ("vertical", "horizontal")
    for side in SIDES
]
NAMES = [f"{each.axis}, {each.side}" for each in CURVED]
every_curve = pytest.mark.parametrize("settings", CURVED, ids=NAMES)
UNITS = np.eye(3)


def surface_of(settings: SurfaceScene) -> Surface:
    return BoardGeometry(Scene(surface=settings)).surface


def places(count: int = 40) -> np.ndarray:
    """Places on and around the board, some before and some behind its face, (n, 3)."""
    board = BoardScene()
    low = (-0.8, -0.1, -board.bottom_m - board.height_m - 0.1)
    high = (0.05, board.width_m + 0.1, -board.bottom_m + 0.1)
    return np.random.default_rng(0).uniform(low, high, (count, 3))


@every_curve
def test_chart_and_points_are_inverse_and_touch_the_plane_in_the_middle(settings: SurfaceScene) -> None:
    surface, board = surface_of(settings), BoardScene()
    assert surface.chart(surface.points(places())) == pytest.approx(places(), abs=1e-12)
    middle = np.append(0.0, BoardGeometry(Scene()).point(0.5 * board.width_m, 0.5 * board.height_m))
    assert surface.points(middle) == pytest.approx(middle) and surface.axes(middle) == pytest.approx(np.eye(3))


@every_curve
def test_axes_and_curvature_are_the_derivatives_of_the_points(settings: SurfaceScene) -> None:
    surface, step = surface_of(settings), 1e-4
    for place in places() * (0.0, 1.0, 1.0):
        ahead, behind = (np.array([surface.points(place + way * step * unit) for unit in UNITS]) for way in (1.0, -1.0))
        assert (ahead - behind).T / (2.0 * step) == pytest.approx(surface.axes(place), abs=1e-7)
        bends = (ahead + behind - 2.0 * surface.points(place))[1:] / step**2
        assert bends @ surface.axes(place)[:, 0] == pytest.approx(surface.curvature(place), abs=1e-5)
        assert sorted(np.abs(surface.curvature(place))) == pytest.approx([0.0, 1.0 / SMALLEST_M])


@every_curve
def test_rays_meet_the_surface_and_a_depth_behind_it(settings: SurfaceScene) -> None:
    surface = surface_of(settings)
    place = np.array((0.0, 1.1, -1.3))
    eye = surface.points(place - (0.57, 0.0, 0.0))
    rays = np.random.default_rng(1).uniform((1.0, -0.45, -0.4), (1.0, 0.45, 0.4), (50, 3)) @ surface.axes(place).T
    for depth in (0.0, 0.05):
        ends = eye + surface.hit(eye, rays, place, depth)[:, None] * rays
        assert surface.chart(ends)[:, 0] == pytest.approx(depth, abs=1e-9)


@every_curve
def test_a_pose_before_the_tangent_plane_has_the_same_chart_at_its_touching_point(settings: SurfaceScene) -> None:
    surface, place = surface_of(settings), np.array((0.0, 1.1, -1.3))
    attitude = surface.attitude(place)
    position, level = surface.flattened(surface.points(place - (0.3, 0.0, 0.0)), attitude, place)
    assert position == pytest.approx(place - (0.3, 0.0, 0.0)) and level == pytest.approx((1.0, 0.0, 0.0, 0.0))


def pressed(settings: SurfaceScene, tip: np.ndarray) -> Plant:
    """A plant one tick after its tip was put at a place of the chart, facing the wall there."""
    scene = Scene(surface=settings)
    plant = Plant(scene, seed=0)
    surface = BoardGeometry(scene).surface
    facing = surface.attitude(tip)
    position = surface.points(tip) - rotation_from_quaternion(facing) @ np.array(VehicleParams().tip_position_m)
    plant.data.qpos[:3], plant.data.qpos[3:7] = position * (1.0, -1.0, -1.0), facing * (1.0, 1.0, -1.0, -1.0)
    plant.data.qvel[:] = 0.0
    plant.step(hover_thrusts(plant.vehicle))
    return plant


@every_curve
@pytest.mark.parametrize("along", [0.1, 0.6, 1.3])
def test_the_tip_is_pressed_back_along_the_normal_by_its_depth(settings: SurfaceScene, along: float) -> None:
    """Closed form: spring and damper, of the depth behind the cylinder, along its normal."""
    geometry = BoardGeometry(Scene(surface=settings))
    tip = np.append(0.004, geometry.point(along, 0.2))
    plant = pressed(settings, tip)
    wall = plant.scene.wall
    before = plant.pushes[0]  # at the first physics step the vehicle has not yet moved
    assert before == pytest.approx(wall.stiffness_n_m * 0.004, rel=0.01)
    assert np.abs(plant.contact_friction).max() < 0.2 * before  # nothing but the start of a slide by gravity
    assert plant.tip[1:] == pytest.approx(tip[1:], abs=1e-4)


def test_a_leaning_wall_turns_gravity_and_nothing_else() -> None:
    for lean in (-10.0, 10.0):
        surface, sine = SurfaceScene(lean_deg=lean), math.sin(math.radians(lean))
        still = ImuScene(attitude_bias_deg=0.0, attitude_noise_deg=0.0, gyro_density=0.0, accel_density=0.0)
        start = StartScene(yaw_deg=0.0)
        plant = Plant(Scene(surface=surface, imu=still, start=start), seed=0)
        board = BoardGeometry(plant.scene)
        assert plant.euler[:2] == pytest.approx((0.0, 0.0), abs=1e-12)  # level against gravity
        assert board.down @ (1.0, 0.0, 0.0) == pytest.approx(sine)  # with the top away, downwards is into the wall
        for _ in range(50):
            frame = SensorSuite(plant.scene, plant.vehicle).sample(plant)
            plant.step(hover_thrusts(plant.vehicle))
        assert frame.specific_force is not None and frame.attitude is not None
        assert frame.specific_force == pytest.approx((0.0, 0.0, -GRAVITY), abs=0.05)
        down = rotation_from_quaternion(frame.attitude)[2]
        assert down == pytest.approx((0.0, 0.0, 1.0), abs=2e-3)
        corner = np.append(0.0, board.point(0.0, 0.0))
        assert board.down @ corner - board.ground == pytest.approx(-plant.scene.board.bottom_m)


def test_a_board_steeper_than_15_degrees_is_refused() -> None:
    settings = SurfaceScene(kind="cylinder", axis="horizontal", radius_m=SMALLEST_M)
    Scene(surface=settings, board=BoardScene(height_m=0.78))
    with pytest.raises(ConfigError, match=r"board.height_m = 0\.8 .* 15 deg"):
        Scene(surface=settings, board=BoardScene(height_m=0.8))
    with pytest.raises(ConfigError, match=r"board.height_m = 0\.6"):
        Scene(surface=dataclasses.replace(settings, lean_deg=8.0))


def test_a_board_around_more_than_a_half_of_a_cylinder_is_refused() -> None:
    settings = SurfaceScene(kind="cylinder", radius_m=SMALLEST_M)
    Scene(surface=settings, board=BoardScene(width_m=4.7))
    with pytest.raises(ConfigError, match=r"board.width_m = 4\.8 m is refused: allowed is at most 4\.71 m"):
        Scene(surface=settings, board=BoardScene(width_m=4.8))
