"""Cameras in flight: mount of the true vehicle, place beside the arm, motion and lost pictures; the press job."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from defect_scenes import with_errors

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import rotation_from_quaternion
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.pilot import PilotConfig
from sim.evaluate.metrics import compute_metrics
from sim.experiments.scenes import near_wall
from sim.flight.closed_loop import fly
from sim.flight.jobs import PressJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.sensors.camera_mount import CameraMount
from sim.vehicles.configuration import with_vehicle
from sim.world.plant_scene import PlantScene
from sim.world.scene import Scene
from sim.world.true_vehicle import true_vehicle

OPTIONS = FlightOptions(features="geometric", video=False)


def test_press_job_holds_as_long_as_asked_whatever_the_push_does():
    trace = fly(near_wall(paint={"push_n": 35.0}), OPTIONS, job=PressJob(hold_s=2.0))
    assert trace.claimed, trace.reason
    press = trace.t[trace.phase == trace.phases.index("press")]
    touch = trace.t[np.argmax(trace.push_true > 0.05)]
    assert press[-1] - touch == pytest.approx(2.0, abs=0.6)


def test_a_turned_camera_stands_where_it_stood_and_looks_elsewhere():
    vehicle = VehicleParams()
    x, y, z = vehicle.camera_position_m
    plant = PlantScene(camera_turn_deg=(0.0, 2.0, 0.0), camera_position_m=(x, y + 0.01, z))
    true = true_vehicle(Scene(plant=plant), vehicle)
    position, quaternion = np.array([-1.0, 0.2, -1.5]), np.array([np.cos(0.1), 0.0, 0.0, np.sin(0.1)])
    moved, turned = CameraMount(true, vehicle).pose(position, quaternion)
    camera = np.array(vehicle.camera_position_m)
    nominal, seen = rotation_from_quaternion(quaternion), rotation_from_quaternion(turned)
    assert moved + seen @ camera == pytest.approx(position + nominal @ (camera + np.array([0.0, 0.01, 0.0])))
    axis = nominal.T @ seen
    assert np.degrees(np.arccos((np.trace(axis) - 1.0) / 2.0)) == pytest.approx(2.0, rel=1e-3)


def test_a_camera_turned_right_reports_forward_motion_as_partly_to_the_left():
    true = true_vehicle(Scene(plant=PlantScene(camera_turn_deg=(0.0, 0.0, 2.0))), VehicleParams())
    seen = CameraMount(true, VehicleParams()).velocity(np.array([1.0, 0.0, 0.0]))
    assert seen == pytest.approx([np.cos(np.radians(2.0)), -np.sin(np.radians(2.0)), 0.0])


def test_a_focal_ratio_changes_the_reported_focal_lengths_alone():
    frame = RgbdFrame(
        rgb=np.zeros((2, 2, 3), np.uint8),
        depth=np.ones((2, 2), np.float32),
        intrinsics=(600.0, 610.0, 1.0, 1.0),
        stamp_ns=0,
    )
    mount = CameraMount(true_vehicle(Scene(plant=PlantScene(focal_ratio=1.03)), VehicleParams()), VehicleParams())
    assert mount.picture(frame).intrinsics == pytest.approx((618.0, 628.3, 1.0, 1.0))
    assert CameraMount(true_vehicle(Scene(), VehicleParams()), VehicleParams()).picture(frame) is frame


def test_no_error_changes_nothing_to_the_bit():
    position, quaternion = np.array([1.0, 2.0, 3.0]), np.array([1.0, 0.0, 0.0, 0.0])
    same = CameraMount(true_vehicle(Scene(), VehicleParams()), VehicleParams()).pose(position, quaternion)
    assert same[0] is position and same[1] is quaternion


def test_a_focal_ratio_needs_pictures():
    scene = Scene(plant=PlantScene(focal_ratio=1.03))
    with pytest.raises(ConfigError, match="rendered"):
        World(scene, OPTIONS, pilot_config(scene, OPTIONS))


@pytest.mark.slow
def test_a_camera_pitched_by_12_degrees_and_a_force_sensor_on_its_side_hold_the_push():
    config = pilot_config(near_wall(), OPTIONS)
    vehicle = dataclasses.replace(
        config.controller.vehicle, camera_turn_deg=(0.0, 12.0, 0.0), force_torque_turn_deg=(90.0, 0.0, 0.0)
    )
    config = dataclasses.replace(config, controller=dataclasses.replace(config.controller, vehicle=vehicle))
    trace = fly(near_wall(), OPTIONS, job=PressJob(hold_s=3.0), config=config)
    assert trace.claimed, trace.reason
    held = (trace.phase == trace.phases.index("press")) & (trace.contact_weight == 1.0)
    late = trace.push_true[held][-500:]
    assert np.sqrt(np.mean((late - 5.0) ** 2)) < 0.3


#: Ticks of a fall without thrust; three pictures are captured, two of them in motion.
TICKS = 34


def seen(scene: Scene, features: str) -> list[np.ndarray]:
    """Pictures, or normals of the lines, of a fall."""
    options = FlightOptions(seed=1, features=features, image_size=(424, 240))
    world = World(scene, options, pilot_config(scene, options))
    found = []
    for _ in range(TICKS):
        frame = world.sense()
        if frame.image is not None:
            found.append(frame.image.rgb)
        elif frame.features is not None:
            found.append(np.array([(line.rho, line.theta) for line in frame.features.lines]))
        world.act(np.zeros(6))
    return found


@pytest.mark.parametrize("features", ["rendered", "geometric"])
def test_motion_reaches_the_rolling_shutter(features: str) -> None:
    ideal = seen(Scene(), features)
    skewed = seen(with_errors(Scene(), camera={"rolling_shutter_s": 0.05}), features)
    assert len(ideal) == len(skewed) >= 2
    assert not np.array_equal(ideal[-1], skewed[-1])


@pytest.mark.parametrize("features", ["rendered", "geometric"])
def test_lost_pictures_stay_away(features: str) -> None:
    assert len(seen(with_errors(Scene(), camera={"dropped": 0.9}), features)) < len(seen(Scene(), features))


#: The camera is so far to the right of the arm [m]; the error of a start mark that ignores it is as large.
BESIDE_M = 0.03


@pytest.mark.slow
@pytest.mark.parametrize("law", ["qp", "paper"])
def test_a_row_begins_at_its_place(law: str) -> None:
    config = PilotConfig(law=law)
    vehicle = dataclasses.replace(config.controller.vehicle, camera_position_m=(0.20, BESIDE_M, 0.08))
    scene = near_wall(board={"width_m": 0.5}, paint={"rows": 1, "stroke_m": 0.4})
    trace = fly(scene, FlightOptions(law=law, features="geometric", video=False), config=with_vehicle(config, vehicle))
    assert compute_metrics(trace)["completed"], trace.reason
    painting = np.flatnonzero(trace.phase == trace.phases.index("paint"))
    right_end = scene.board.width_m - scene.paint.edge_margin_m
    assert abs(trace.tip[painting[0], 1] - right_end) < 0.4 * BESIDE_M
