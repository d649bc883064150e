"""The plant against the parameters it was generated from: rotors, masses, lag, air, crash rules, determinism."""

import math

import mujoco
import numpy as np
import pytest
from controller_scenes import TICK_NS
from plants import at_rest

from allocation import control_effectiveness
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY, rotation_from_quaternion, skew
from sim.world.board import BoardGeometry
from sim.world.mujoco_frames import FLIP
from sim.world.plant import Plant
from sim.world.plant_scene import PlantScene
from sim.world.scene import Scene, StartScene, WindScene
from sim.world.trim import START_DISTANCE_M, START_DOWN_M, START_RIGHT_M, START_YAW_DEG

VEHICLE = VehicleParams()
B = control_effectiveness(VEHICLE.geometry)


def fly(plant: Plant, thrusts: np.ndarray, ticks: int) -> None:
    for _ in range(ticks):
        plant.step(thrusts)


def test_mujoco_moments_equal_control_effectiveness():
    plant = at_rest(Plant(Scene(plant=PlantScene(com_offset_m=(0.02, -0.01, 0.03)))), np.array([-1.0, 0.0, -1.5]))
    model, data = plant.model, plant.data
    mujoco.mj_forward(model, data)
    moment = np.zeros((model.nu, model.nv))
    mujoco.mju_sparse2dense(
        moment, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind.ravel()
    )
    np.testing.assert_allclose(np.tile(FLIP, 2)[:, None] * moment.T, B, atol=1e-9)


def test_hover_thrusts_are_equal_and_hover():
    plant = Plant(Scene(), seed=3)
    np.testing.assert_allclose(plant.thrusts_actual, 6.0 * GRAVITY / (6 * math.cos(math.radians(30.0))), atol=1e-9)
    start = plant.position
    fly(plant, plant.thrusts_actual, 250)
    np.testing.assert_allclose(plant.position, start, atol=1e-6)
    np.testing.assert_allclose(plant.specific_force, [0.0, 0.0, -GRAVITY], atol=1e-6)


def test_each_rotor_pushes_to_its_own_side():
    for index, column in enumerate(B.T):
        plant = at_rest(Plant(Scene(start=StartScene(distance_m=1.5))), np.array([-1.5, 1.0, -1.5]))
        thrusts = plant.thrusts_actual
        thrusts[index] += 5.0
        fly(plant, thrusts, 5)
        side = plant.velocity[:2] / np.linalg.norm(plant.velocity[:2])
        np.testing.assert_allclose(side, column[:2] / np.linalg.norm(column[:2]), atol=0.1)
        assert np.sign(plant.angular_velocity[2]) == np.sign(column[5])


@pytest.mark.parametrize(
    ("mass", "inertia", "offset"),
    [
        (6.0, (0.22, 0.30, 0.48), (0.0, 0.0, 0.0)),
        (7.5, (0.275, 0.225, 0.36), (0.03, -0.02, 0.03)),
        (5.0, (0.330, 0.350, 0.60), (-0.03, 0.03, -0.03)),
    ],
)
def test_mass_centre_and_inertia_are_the_scenes(mass, inertia, offset):
    truth = PlantScene(mass_kg=mass, inertia_kg_m2=inertia, com_offset_m=offset)
    plant = at_rest(Plant(Scene(plant=truth)), np.array([-1.0, 0.0, -1.5]))
    mujoco.mj_forward(plant.model, plant.data)
    full = np.zeros((6, 6))
    mujoco.mj_fullM(plant.model, plant.data, full)
    lever = mass * skew(np.array(offset))
    about_origin = np.diag(inertia) - mass * skew(np.array(offset)) @ skew(np.array(offset))
    expected = np.block([[mass * np.eye(3), -lever], [lever, about_origin]])
    np.testing.assert_allclose(np.tile(FLIP, 2)[:, None] * full * np.tile(FLIP, 2), expected, atol=1e-12)
    assert float(plant.model.body_mass.sum()) == pytest.approx(mass, abs=1e-12)
    thrusts = plant.thrusts_actual
    fly(plant, thrusts, 100)
    assert np.abs(plant.velocity).max() < 1e-3 and np.abs(plant.angular_velocity).max() < 1e-3, "trimmed hover"


def test_impossible_vehicles_are_refused():
    with pytest.raises(ConfigError, match=r"inertia_kg_m2 .* tool"):
        Plant(Scene(plant=PlantScene(inertia_kg_m2=(0.05, 0.05, 0.05))))
    with pytest.raises(ConfigError, match=r"plant.tool_mass_kg .* mass_kg"):
        Plant(Scene(plant=PlantScene(mass_kg=4.0)), VehicleParams(tool_mass_kg=5.0))
    with pytest.raises(ConfigError, match=r"plant.thrust_max_n .* 6 .one per rotor"):
        Plant(Scene(plant=PlantScene(thrust_max_n=(52.0, 52.0))))
    with pytest.raises(ConfigError, match=r"plant\.thrust_min_n"):
        Plant(Scene(plant=PlantScene(thrust_min_n=30.0, thrust_max_n=20.0)))


def test_motor_lag_rises_and_falls_with_its_own_time_constant():
    truth = PlantScene(motor_lag_up_s=0.03, motor_lag_down_s=0.08)
    plant = Plant(Scene(plant=truth, start=StartScene(distance_m=1.5)))
    start = plant.thrusts_actual
    step = np.array([4.0, -4.0, 2.0, -2.0, 1.0, 0.0])
    for tick in range(1, 11):
        plant.step(start + step)
        lag = np.where(step >= 0.0, 0.03, 0.08)
        np.testing.assert_allclose(plant.thrusts_actual, start + step * -np.expm1(-tick * 0.004 / lag), atol=1e-9)


def test_true_limits_clip_the_command():
    upper = (30.0, 52.56, 52.56, 20.0, 52.56, 52.56)
    plant = Plant(Scene(plant=PlantScene(thrust_min_n=2.0, thrust_max_n=upper, motor_lag_up_s=0.001)))
    plant.step(np.full(6, 100.0))
    np.testing.assert_allclose(plant.thrusts_actual, upper, rtol=0.05)
    plant.step(np.full(6, -5.0))
    assert plant.data.ctrl.min() == 2.0


def test_state_is_consistent_in_ned_and_frd():
    plant = Plant(Scene(start=StartScene(distance_m=1.5, yaw_deg=10.0)), seed=2)
    rng = np.random.default_rng(0)
    previous_tip = plant.tip
    for _ in range(60):
        plant.step(plant.thrusts_actual + rng.normal(size=6))
        moved = (plant.tip - previous_tip) / (TICK_NS * 1e-9)
        previous_tip = plant.tip
    rotation = rotation_from_quaternion(plant.quaternion)
    roll, pitch, yaw = plant.euler
    assert abs(roll) + abs(pitch) > 1e-3
    assert math.sin(yaw) * math.cos(pitch) == pytest.approx(rotation[1, 0])
    np.testing.assert_allclose(plant.tip, plant.position + rotation @ [0.7, 0.0, 0.0], atol=1e-12)
    expected = rotation @ (plant.velocity + np.cross(plant.angular_velocity, [0.7, 0.0, 0.0]))
    np.testing.assert_allclose(expected, moved, atol=0.02)


def test_accelerometer_gives_the_velocity_change():
    plant = Plant(Scene(start=StartScene(distance_m=1.5)), seed=2)
    thrusts = plant.thrusts_actual + B.T[:, 0] * 2.0 - B.T[:, 2] * 1.0 + B.T[:, 5]
    for _ in range(50):
        before = plant.rotation @ plant.velocity
        plant.step(thrusts)
        change = (plant.rotation @ plant.velocity - before) / 0.004
        measured = plant.rotation @ plant.specific_force + [0.0, 0.0, GRAVITY]
        np.testing.assert_allclose(measured, change, atol=0.02)


def test_tool_weight_and_inertia_at_the_sensor():
    plant = Plant(Scene())
    np.testing.assert_allclose(plant.ft_wrench, [0, 0, -0.35 * GRAVITY, 0, 0.25 * 0.35 * GRAVITY, 0], atol=1e-6)
    plant = Plant(Scene(start=StartScene(distance_m=1.5)))
    fly(plant, plant.thrusts_actual + 2.0 * B[0], 5)
    # Speeding up ahead, the vehicle drags the tool along.
    assert plant.ft_wrench[0] == pytest.approx(0.35 * plant.specific_force[0], rel=0.1)


def test_start_pose_varies_within_its_bounds():
    nominal = BoardGeometry(Scene()).start_tip
    tips = np.array([Plant(Scene(), seed=seed).tip for seed in range(12)])
    yaws = np.degrees([Plant(Scene(), seed=seed).euler[2] for seed in range(12)])
    bounds = np.array([START_DISTANCE_M, START_RIGHT_M, START_DOWN_M])
    assert np.all(np.abs(tips - nominal) <= bounds + 1e-12) and np.all(np.abs(yaws) <= START_YAW_DEG)
    assert np.all(np.ptp(tips, axis=0) > 0.8 * bounds) and np.ptp(yaws) > 0.8 * START_YAW_DEG
    turned = Plant(Scene(start=StartScene(yaw_deg=10.0)), seed=4).euler[2]
    assert math.degrees(turned) == pytest.approx(10.0 + yaws[4])


def test_same_seed_same_bits():
    def run(seed: int) -> bytes:
        plant = Plant(Scene(wind=WindScene(gust_n_rms=1.0), start=StartScene(distance_m=0.16)), seed=seed)
        rng, trace = np.random.default_rng(7), []
        for _ in range(300):
            plant.step(plant.thrusts_actual + B[0] + rng.normal(size=6) * 0.2)
            state = (plant.position, plant.quaternion, plant.velocity, plant.ft_wrench, plant.pushes)
            trace.append(np.concatenate(state))
        assert np.array(trace)[:, -4:].max() > 0.0, "touched the board"
        return np.array(trace).tobytes()

    assert run(5) == run(5) != run(6)


def test_contact_reads_zero_in_free_air_and_friction_opposes_the_slide():
    plant = Plant(Scene(start=StartScene(distance_m=1.0)))
    fly(plant, plant.thrusts_actual, 10)
    assert plant.contact_normal_force == 0.0 and not plant.contact_friction.any()
    at_rest(plant, np.array([-0.695, 1.0, -1.5]))
    plant.data.qvel[:3] = FLIP * [0.0, 0.1, 0.05]
    plant._read()
    plant.step(plant.thrusts_actual)
    assert plant.contact_normal_force > 5.0 and plant.pushes[-1] == plant.contact_normal_force
    friction = plant.contact_friction
    assert friction[0] < 0.0 and friction[1] < 0.0
    assert np.linalg.norm(friction) == pytest.approx(0.3 * plant.contact_normal_force, rel=0.01)
    assert plant.ft_wrench[0] > 4.0


def test_forces_of_a_tick_are_those_of_its_physics_steps_in_order():
    """MuJoCo's sensor history is read oldest first, compared with the same steps taken one by one."""
    plant, single = Plant(Scene(), seed=2), Plant(Scene(), seed=2)
    for each in (plant, single):
        each.data.qpos[0] += 0.002 - each.tip[0]  # 2 mm inside the wall: the push changes from step to step
    for _ in range(50):
        plant.step(1.01 * plant.thrusts_actual)
        single._commanded[:] = 1.01 * single.thrusts_actual
        single._air[:] = single.wind.force(single._centre_velocity.tolist())
        single._drive()
        single._lag[:] = single._lags
        felt, pushes = [], []
        for _ in range(len(single.pushes)):
            mujoco.mj_step(single.model, single.data)
            felt.append(single.data.sensordata[single._ids.accelerometer].copy())
            found, push, *_ = single.data.sensordata[single._ids.contact]
            pushes.append(push if found else 0.0)
        single._read()
        np.testing.assert_array_equal(plant.truth, single.truth)
        np.testing.assert_allclose(plant.pushes, pushes, atol=1e-12)
        np.testing.assert_allclose(FLIP * np.mean(felt, axis=0), plant.specific_force, atol=1e-12)


def test_what_is_there_for_pictures_changes_no_bit_of_the_motion():
    drawn, bare = (Plant(Scene(), seed=3, drawn=shown) for shown in (True, False))
    assert drawn.model.ngeom > bare.model.ngeom
    push, pressed = drawn.thrusts_actual + np.array([0.3, 0.3, 0.6, -0.6, 0.6, -0.6]), 0
    for place in ([-0.9, 1.0, -1.5], [-0.698, 1.0, -1.5]):
        for plant in (drawn, bare):
            at_rest(plant, np.array(place))
        for _ in range(20):
            for plant in (drawn, bare):
                plant.step(push)
            assert drawn.truth.tobytes() == bare.truth.tobytes()
            pressed += drawn.contact_normal_force > 0.0
    assert pressed > 10, "in contact as well"
