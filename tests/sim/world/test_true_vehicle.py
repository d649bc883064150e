"""The vehicle that flies: its motion by hand from the stated numbers, its sensors' poses, and refusals."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from pathlib import Path

import mujoco
import numpy as np
import pytest
from plants import at_rest

from allocation import TAROT_T960, Rotor, RotorGeometry
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import dump_toml, from_dict
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from ibvs_qp.measurement import HORIZONTAL, VERTICAL, LineFeature
from ibvs_qp.pilot import PilotConfig
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.world.mujoco_frames import FLIP
from sim.world.plant import Plant
from sim.world.plant_scene import PlantScene, Vector
from sim.world.scene import Scene, StartScene
from sim.world.true_vehicle import true_vehicle

ROOT = Path(__file__).parents[3]
BELIEVED = VehicleParams()
AWAY = np.array([-2.0, 1.0, -1.5])
TILT = math.radians(26.0)
#: Six rotors off the believed circle, each with its own axis and torque ratio.
ROTORS = tuple(
    Rotor(
        name=rotor.name,
        spin=rotor.spin,
        position_m=(0.47 * math.cos(a) + 0.01, 0.49 * math.sin(a), 0.02 * rotor.spin),
        axis=(
            -rotor.spin * math.sin(TILT) * math.sin(a),
            rotor.spin * math.sin(TILT) * math.cos(a),
            -math.cos(TILT),
        ),
        torque_ratio_m=0.015 + 0.002 * index,
    )
    for index, rotor in enumerate(TAROT_T960.rotors)
    for a in (math.radians((rotor.azimuth_deg or 0.0) + 3.0),)
)
PLANT = PlantScene(
    geometry=RotorGeometry(rotors=ROTORS, torque_ratio_m=0.0),
    mass_kg=6.7,
    com_offset_m=(0.02, -0.03, 0.01),
    inertia_kg_m2=(0.25, 0.33, 0.52),
    inertia_products_kg_m2=(0.02, -0.03, 0.01),
)


def newton_euler(plant: PlantScene, thrusts: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Acceleration of the body origin and angular acceleration in B, level, from the section's numbers."""
    assert plant.geometry is not None and plant.mass_kg is not None and plant.inertia_kg_m2 is not None
    centre, force, moment = np.array(plant.com_offset_m), np.array([0.0, 0.0, plant.mass_kg * GRAVITY]), np.zeros(3)
    for rotor, thrust in zip(plant.geometry.rotors, thrusts, strict=True):
        assert rotor.axis is not None and rotor.position_m is not None and rotor.torque_ratio_m is not None
        push = thrust * np.array(rotor.axis)
        force += push
        moment += np.cross(np.array(rotor.position_m) - centre, push) - rotor.spin * rotor.torque_ratio_m * push
    (xx, yy, zz), (xy, xz, yz) = plant.inertia_kg_m2, plant.inertia_products_kg_m2
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    turning = np.linalg.solve(inertia, moment - np.cross(rate, inertia @ rate))
    swing = np.cross(turning, centre) + np.cross(rate, np.cross(rate, centre))
    return force / plant.mass_kg - swing, turning


def test_initial_accelerations_follow_from_the_stated_numbers() -> None:
    plant = at_rest(Plant(Scene(plant=PLANT)), AWAY)
    rate, thrusts = np.array([0.4, -0.3, 0.6]), np.array([14.0, 9.0, 12.0, 17.0, 11.0, 8.0])
    plant.data.qvel[3:] = FLIP * rate
    plant.data.act[:] = thrusts
    mujoco.mj_forward(plant.model, plant.data)
    linear, angular = newton_euler(PLANT, thrusts, rate)
    np.testing.assert_allclose(FLIP * plant.data.qacc[:3], linear, atol=1e-9)
    np.testing.assert_allclose(FLIP * plant.data.qacc[3:], angular, atol=1e-9)


def test_the_trim_of_the_true_vehicle_holds() -> None:
    plant = Plant(Scene(plant=PLANT, start=StartScene(distance_m=1.5)))
    np.testing.assert_allclose(np.concatenate(newton_euler(PLANT, plant.thrusts_actual, np.zeros(3))), 0.0, atol=1e-7)
    hover = plant.thrusts_actual
    for _ in range(100):
        plant.step(hover)
    assert np.abs(plant.velocity).max() < 1e-5 and np.abs(plant.angular_velocity).max() < 1e-5


def test_thrust_gain_and_drag_act_on_the_plant() -> None:
    gains = (0.9, 1.0, 1.0, 1.1, 1.0, 1.0)
    plant = Plant(Scene(plant=PlantScene(thrust_gain=gains, linear_drag_n_s_m=1.8)))
    command = np.full(6, 12.0)
    for _ in range(150):
        plant.step(command)
    np.testing.assert_allclose(plant.thrusts_actual, 12.0 * np.array(gains), rtol=1e-3)
    velocity = np.array([1.0, 0.0, 0.0])
    np.testing.assert_allclose(plant.wind.force(velocity.tolist()), [-1.8, 0.0, 0.0])


WEIGHT = 0.35 * GRAVITY  # of the tool; the vehicle holds it: force upwards, -z, and moment about the right axis, +y
LEVER, SINE, COSINE = 0.25 * WEIGHT, 0.5, math.sqrt(0.75)


@pytest.mark.parametrize(
    ("turn", "expected"),
    [
        # y of the sensor points right and down.
        ((30.0, 0.0, 0.0), [0.0, -SINE * WEIGHT, -COSINE * WEIGHT, 0.0, COSINE * LEVER, -SINE * LEVER]),
        # x points forward and up.
        ((0.0, 30.0, 0.0), [SINE * WEIGHT, 0.0, -COSINE * WEIGHT, 0.0, LEVER, 0.0]),
        # x points forward and right.
        ((0.0, 0.0, 30.0), [0.0, 0.0, -WEIGHT, SINE * LEVER, COSINE * LEVER, 0.0]),
    ],
    ids=["rolled right", "pitched up", "yawed right"],
)
def test_a_turned_force_torque_sensor_reads_in_its_own_axes(turn: Vector, expected: list[float]) -> None:
    plant = Plant(Scene(plant=PlantScene(force_torque_turn_deg=turn)))
    np.testing.assert_allclose(plant.ft_wrench, expected, atol=1e-6)


def test_a_moved_force_torque_sensor_has_another_lever() -> None:
    plant = Plant(Scene(plant=PlantScene(force_torque_position_m=(0.30, 0.0, 0.0))))
    np.testing.assert_allclose(plant.ft_wrench, [0.0, 0.0, -WEIGHT, 0.0, 0.20 * WEIGHT, 0.0], atol=1e-6)


def first_frame(plant: PlantScene) -> dict[int, LineFeature]:
    """Lines by track in the first frame of a flight."""
    options = FlightOptions(features="geometric", video=False)
    scene = Scene(plant=plant)
    world = World(scene, options, pilot_config(scene, options))
    hover = world.plant.thrusts_actual
    while (features := world.sense().features) is None:
        world.act(hover)
    return {line.track_id: line for line in features.lines}


def place(line: LineFeature) -> float:
    """Where a line crosses its axis through the middle of the picture: y of a horizontal, x of a vertical one [-]."""
    return line.rho / (math.sin(line.theta) if line.role == HORIZONTAL else math.cos(line.theta))


def moves(plant: PlantScene, role: str) -> np.ndarray:
    """How far the lines of a role lie right of, or below, where the believed camera sees them [-]."""
    straight, seen = first_frame(PlantScene()), first_frame(plant)
    common = [track for track in straight.keys() & seen.keys() if seen[track].role == role]
    assert common
    return np.array([place(seen[track]) - place(straight[track]) for track in common])


def test_a_turned_camera_sees_things_elsewhere() -> None:
    # A turn by a moves a line at tan(b) from the axis to tan(b +- a); the lines lie up to 20 deg off.
    turn = math.radians(2.0)
    np.testing.assert_allclose(moves(PlantScene(camera_turn_deg=(0.0, 2.0, 0.0)), HORIZONTAL), turn, rtol=0.2)
    np.testing.assert_allclose(moves(PlantScene(camera_turn_deg=(0.0, 0.0, 2.0)), VERTICAL), -turn, rtol=0.2)


def test_a_raised_camera_sees_things_lower() -> None:
    x, y, z = BELIEVED.camera_position_m
    # 5 cm at the distance of the board: the arm's reach beyond the camera, and the start distance.
    shift = 0.05 / (BELIEVED.tip_position_m[0] - x + StartScene().distance_m)
    np.testing.assert_allclose(moves(PlantScene(camera_position_m=(x, y, z - 0.05)), HORIZONTAL), shift, rtol=0.1)


def test_without_a_plant_section_the_believed_vehicle_flies() -> None:
    octorotor = PilotConfig.from_toml(ROOT / "ibvs_qp" / "pilot" / "presets" / "octorotor_qp.toml").controller.vehicle
    for believed in (BELIEVED, octorotor, dataclasses.replace(BELIEVED, mass_kg=7.0, tip_position_m=(0.8, 0.0, 0.1))):
        for seed in (0, 5):
            true = true_vehicle(Scene(), believed, seed)
            for field in dataclasses.fields(VehicleParams):
                assert getattr(true, field.name) == getattr(believed, field.name), field.name
            assert true == true_vehicle(Scene(), believed)
            np.testing.assert_array_equal(true.inertia, np.diag(believed.inertia_kg_m2))


def test_a_plant_survives_its_toml() -> None:
    scene = Scene(plant=PLANT)
    assert from_dict(Scene, tomllib.loads(dump_toml(scene))) == scene


@pytest.mark.parametrize(
    ("plant", "named"),
    [
        ({"mass_kg": 1.0}, r"plant\.mass_kg = 1\.0 kg is refused: allowed is \[2, 20\] kg"),
        ({"inertia_products_kg_m2": [0.0, 0.0, 9.0]}, r"plant\.inertia_products_kg_m2 = .* \[-5, 5\] kg m\^2"),
        ({"thrust_gain": 0.0}, r"plant\.thrust_gain = 0\.0 is refused"),
        ({"camera_turn_deg": [0.0, 181.0, 0.0]}, r"plant\.camera_turn_deg = .* allowed is \[-180, 180\]"),
        ({"mount_error_m": [0.0, 0.0, 0.0]}, r"unknown key 'plant\.mount_error_m'"),
        ({"thrust_gain": [1.0, 1.0]}, r"plant\.thrust_gain = .* 6 \(one per rotor\)"),
        ({"inertia_products_kg_m2": [0.0, 0.4, 0.0]}, r"plant\.inertia_kg_m2 = .* products \(0\.0, 0\.4, 0\.0\)"),
        (
            {"geometry": {"rotors": [{"name": "a", "spin": 1, "azimuth_deg": 0.0}], "circle_radius_m": 1.0,
                          "torque_ratio_m": 0.0}},
            r"plant\.geometry = 1 rotors is refused: the controller commands 6",
        ),
        (
            {"geometry": {"rotors": [{"name": "a", "spin": 1, "azimuth_deg": 0.0, "axis": [1.0, 1.0, 0.0]}],
                          "circle_radius_m": 1.0, "torque_ratio_m": 0.0}},
            r"plant\.geometry.* a: axis: .* must be a unit vector",
        ),
    ],
)  # fmt: skip
def test_wrong_entries_are_refused_by_name(plant: dict[str, object], named: str) -> None:
    with pytest.raises(ConfigError, match=named):
        Plant(from_dict(Scene, {"plant": plant}))


def test_the_plant_of_the_documentation_flies() -> None:
    page = (ROOT / "docs" / "how_it_works" / "simulation.md").read_text(encoding="utf-8")
    table = tomllib.loads(page.split("```toml")[1].split("```")[0])
    plant = Plant(from_dict(Scene, table))
    hover = plant.thrusts_actual / np.array(table["plant"]["thrust_gain"])
    for _ in range(100):
        plant.step(hover)
    assert np.abs(plant.velocity).max() < 1e-5 and plant.crashed is None
