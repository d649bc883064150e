"""The world field: relief, bristles, air near wall and ground, wind with fronts, a swinging arm."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import mujoco
import numpy as np
import pytest
from plants import at_rest

from sim.world.board import BoardGeometry
from sim.world.bristles import Bristles
from sim.world.contact import contact_stiffness
from sim.world.errors import AirErrors, ArmErrors, BrushErrors, WorldErrors, world_errors
from sim.world.mujoco_frames import FLIP
from sim.world.plant import Plant
from sim.world.readout import PLACES
from sim.world.relief import Relief
from sim.world.scene import Scene, StartScene, WindScene
from sim.world.wall_air import WallAir
from sim.world.wind import FRONT_S, Wind

FIELD = world_errors("field")
BOARD = BoardGeometry(Scene())
TICK_S = 0.004


def test_slopes_of_the_relief_are_those_of_its_heights() -> None:
    relief, rng, step, bumps = Relief(FIELD.relief, BOARD, 3), np.random.default_rng(0), 1e-6, 0
    board = BOARD.scene.board
    for along, up in rng.uniform((0.0, 0.0), (board.width_m, board.height_m), (4000, 2)):
        height, *slopes = relief.height(along, up)
        bumps += height not in (0.0, FIELD.relief.step_m)
        right = (relief.height(along + step, up)[0] - relief.height(along - step, up)[0]) / (2.0 * step)
        above = (relief.height(along, up + step)[0] - relief.height(along, up - step)[0]) / (2.0 * step)
        np.testing.assert_allclose(slopes, (right, above), atol=2e-3)
        assert 0.0 <= height <= 2.0 * FIELD.relief.height_m[1] + FIELD.relief.step_m
    assert bumps > 50
    assert Relief(FIELD.relief, BOARD, 3).height(0.5, 0.4) == relief.height(0.5, 0.4)


def test_a_pressed_brush_is_progressive_and_takes_energy() -> None:
    brush, depths, rate = Bristles(FIELD.brush, 1500.0, 0.3), np.linspace(0.0, 0.003, 100), 0.01
    pressed = [brush.stiffness(depth, rate) * depth for depth in depths]
    released = [brush.stiffness(depth, -rate) * depth for depth in depths]
    assert np.trapezoid(pressed, depths) > 1.2 * np.trapezoid(released, depths)
    assert brush.stiffness(0.003, 0.0) == pytest.approx(1500.0 * (1.0 + 3.0 * FIELD.brush.progression_per_mm))
    assert brush.stiffness(-0.01, 0.0) == 1500.0


def test_a_brush_sticks_harder_than_it_slides_and_paint_dries() -> None:
    brush = Bristles(FIELD.brush, 1500.0, 0.3)
    assert brush.friction(0.0) == pytest.approx(0.4, abs=1e-3) and brush.friction(0.1) == pytest.approx(0.3)
    assert brush.drag(0.0) == FIELD.brush.drag_n_s_m
    assert brush.drag(FIELD.brush.drying_s) == pytest.approx(FIELD.brush.drag_n_s_m / math.e)


def factors(distance_m: float, height_m: float, air: AirErrors, seed: int = 1) -> np.ndarray:
    """Thrust factors of a level vehicle with the body origin so far from wall and ground."""
    vehicle = Plant(Scene()).vehicle
    near = WallAir(air, BOARD, vehicle, TICK_S, seed)
    return near.factors(np.array((-distance_m, 0.3, BOARD.ground - height_m)), np.eye(3))


def test_front_rotors_change_most_at_the_wall_and_none_far_away() -> None:
    vehicle, air = Plant(Scene()).vehicle, AirErrors(wall_thrust=0.08)
    ahead = vehicle.geometry.positions[:, 0]
    changes = factors(float(ahead.max()) + 1.3 * vehicle.propeller_radius_m, 50.0, air) - 1.0
    front, rear = np.abs(changes[ahead == ahead.max()]), np.abs(changes[ahead == ahead.min()])
    assert 0.0 < front.max() <= 0.08 and rear.max() < 0.2 * front.min()
    np.testing.assert_allclose(factors(10.0, 50.0, air), 1.0, atol=1e-9)


def test_the_ground_adds_thrust_alone() -> None:
    """Up to 7 % at one radius, as Cheeseman and Bennett state."""
    radius, air = Plant(Scene()).vehicle.propeller_radius_m, AirErrors(ground_thrust=FIELD.air.ground_thrust)
    gains = np.array([factors(10.0, radius, air, seed) - 1.0 for seed in range(100)])
    assert (gains > 0.0).all() and np.ptp(gains, axis=1).max() < 0.01
    assert 0.06 < gains.max() < 0.08


def test_a_front_raises_the_wind_in_its_time_and_passes() -> None:
    air = AirErrors(front_m_s=3.0, front_rise_s=0.5, front_every_s=1.0)
    wind = Wind(WindScene(), air, np.eye(3), 0.9, TICK_S, 3)
    means = []
    for _ in range(5000):
        wind.force((0.0, 0.0, 0.0))
        means.append(math.hypot(*wind.mean[:2]))
    steps = np.abs(np.diff(means)) / TICK_S
    assert max(means) == pytest.approx(3.0) and min(means) == 0.0
    assert steps.max() == pytest.approx(3.0 / 0.5, rel=0.05)
    assert np.count_nonzero(np.array(means) == max(means)) * TICK_S > 0.5 * FRONT_S


def test_a_step_of_the_wind_outlasts_fronts_and_the_drawn_wind_comes_back() -> None:
    air = AirErrors(wind_m_s=5.0, front_m_s=3.0, front_every_s=1.0)
    wind = Wind(WindScene(mean_m_s=(1.0, 0.0, 0.0)), air, np.eye(3), 0.9, TICK_S, 2)
    drawn, step = wind.mean.tolist(), (0.0, 8.0, 0.0)

    def distances(mean: Sequence[float]) -> tuple[float, float]:
        """Least and largest distance of the wind from a mean in 20 s."""
        away = []
        for _ in range(5000):
            wind.force((0.0, 0.0, 0.0))
            away.append(math.dist(wind.mean, mean))
        return min(away), max(away)

    wind.step_to(step, 0.0)
    assert distances(step) == pytest.approx((0.0, 3.0))
    wind.back(0.0)
    assert distances(drawn) == pytest.approx((0.0, 3.0))


def test_fronts_change_no_other_wind_of_a_seed() -> None:
    calm, fronts = AirErrors(wind_m_s=5.0, gust_n=(0.5, 1.5)), AirErrors(wind_m_s=5.0, gust_n=(0.5, 1.5), front_m_s=3.0)
    first = [Wind(WindScene(), air, np.eye(3), 0.9, TICK_S, 4).force((0.0, 0.0, 0.0)) for air in (calm, fronts)]
    assert first[0] == first[1]


def test_wind_is_drawn_up_to_its_size_and_grows_with_height() -> None:
    air = AirErrors(wind_m_s=5.0, shear=0.2)
    speeds = [math.hypot(*Wind(WindScene(), air, np.eye(3), 0.9, TICK_S, seed).mean) for seed in range(200)]
    assert max(speeds) <= 5.0 and np.median(speeds) == pytest.approx(2.5, abs=0.5)
    wind = Wind(WindScene(mean_m_s=(2.0, 0.0, 0.0)), AirErrors(shear=0.2), np.eye(3), 0.9, TICK_S, 0)
    low, high = (wind.force((0.0, 0.0, 0.0), height)[0] for height in (1.5, 6.0))
    assert low == pytest.approx(1.8) and high / low == pytest.approx(4.0**0.2)


def test_the_arm_swings_at_its_frequency_and_damping() -> None:
    arm = ArmErrors(mode_hz=10.0, damping=0.02)
    scene = Scene(errors=dataclasses.replace(WorldErrors(), arm=arm), start=StartScene(distance_m=2.0))
    plant = Plant(scene)
    plant.data.qpos[7] += 0.01  # of the pitch joint
    swings = []
    for _ in range(250):
        plant.step(plant.thrusts_actual)
        swings.append(float(plant.data.qpos[7]))
    middle = np.array(swings) - np.mean(swings[-100:])
    crossings = np.flatnonzero((middle[:-1] < 0.0) & (middle[1:] >= 0.0))[:6]
    found = 2.0 * math.pi / (np.diff(crossings).mean() * TICK_S)
    masses = np.zeros((plant.model.nv, plant.model.nv))
    mujoco.mj_fullM(plant.model, plant.data, masses)
    stiffness, damping = (
        float(np.ravel(values[place])[0])
        for values, place in ((plant.model.jnt_stiffness, 1), (plant.model.dof_damping, 6))
    )
    clamped = 1.0 / masses[6, 6]  # per inertia about the joint; a free vehicle gives way
    free = float(np.linalg.inv(masses)[6, 6])
    assert math.sqrt(stiffness * clamped) == pytest.approx(2.0 * math.pi * 10.0, rel=0.01)
    assert damping * clamped == pytest.approx(2.0 * 0.02 * 2.0 * math.pi * 10.0, rel=0.01)
    assert found == pytest.approx(math.sqrt(stiffness * free), rel=0.05)


def test_a_flexible_arm_hangs_straight_at_rest() -> None:
    errors = dataclasses.replace(WorldErrors(), arm=ArmErrors(mode_hz=10.0))
    stiff, soft = (Plant(Scene(errors=each, start=StartScene(distance_m=2.0))) for each in (WorldErrors(), errors))
    for _ in range(100):
        stiff.step(stiff.thrusts_actual)
        soft.step(soft.thrusts_actual)
    assert np.abs(soft.tip - stiff.tip).max() < 1e-3


def test_bristles_are_off_without_sizes() -> None:
    brush = Bristles(BrushErrors(), 1500.0, 0.3)
    assert brush.stiffness(0.002, 1.0) == 1500.0 and brush.friction(0.0) == 0.3 and brush.drag(0.0) == 0.0


def test_bristles_before_the_wall_beside_the_board_touch_nothing() -> None:
    scene = Scene(errors=dataclasses.replace(WorldErrors(), brush=FIELD.brush))
    for depth, touches in ((0.020, False), (0.052, True)):  # the wall's face lies 50 mm behind the board's
        plant = Plant(scene)
        place = np.array((depth, -0.02, -1.5)) - plant.vehicle.tip_position_m
        for _ in range(3):
            at_rest(plant, place)
            plant.data.qvel[1] = 0.1  # along the wall
            plant.step(plant.thrusts_actual)
        stiffness, tool = contact_stiffness(plant.model), plant.data.xfrc_applied[plant._ids.tool]
        assert (np.abs(tool).max() > 0.5) == touches
        assert touches == (stiffness > 1500.0 * 1.1) and stiffness < 1500.0 * 1.7


def contact_force(plant: Plant) -> np.ndarray:
    """Whole contact force on the board in the world, NED [N], (3,), from MuJoCo's list of contacts."""
    force = np.zeros(3)
    for index, contact in enumerate(plant.data.contact):
        local = np.zeros(6)
        mujoco.mj_contactForce(plant.model, plant.data, index, local)
        force -= FLIP * (contact.frame.reshape(3, 3).T @ local[:3])
    return force


@pytest.mark.parametrize("kind", [{}, {"lean_deg": 10.0}, {"kind": "cylinder", "radius_m": 1.5}])
def test_the_push_on_a_flank_is_the_whole_force_along_the_normal_of_the_wall(kind: dict[str, float | str]) -> None:
    """The normal force of the contact alone is another one there, since friction acts along the flank."""
    errors = WorldErrors(relief=dataclasses.replace(FIELD.relief, rivets_per_m2=200.0, seams_per_m=5.0, step_m=0.0))
    scene = Scene(errors=errors, surface=dataclasses.replace(Scene().surface, **kind))
    plant, relief, others = Plant(scene, seed=1), Relief(errors.relief, BoardGeometry(scene), 1), 0
    hover, start = plant.thrusts_actual.copy(), plant.position.copy()
    for along in np.arange(0.3, 0.7, 0.02):
        tip = BoardGeometry(scene).surface.points(np.array([0.002, *BoardGeometry(scene).point(along, 0.3)]))
        at_rest(plant, start).displace(np.zeros(3))  # the tip in the chart
        plant.displace(tip - BoardGeometry(scene).surface.points(plant.tip))
        plant.step(hover)
        force, normal = contact_force(plant), plant.normal
        assert plant.truth.item(PLACES["push"].start) == pytest.approx(force @ normal, abs=1e-6)
        assert plant.pushes[-1] == plant.truth.item(PLACES["push"].start)
        others += bool(np.hypot(*relief.height(along, 0.3)[1:]) > 0.1) and force @ normal > 0.0
    assert others >= 2
