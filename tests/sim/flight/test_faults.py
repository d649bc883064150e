"""Faults in flight: their time, their effect on the plant, and the limits reported to the pilot."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import rotation_from_quaternion
from ibvs_qp.measurement import RgbdFrame
from sim.evaluate.measures.loss import loss_figures
from sim.experiments.scenes import near_wall
from sim.flight.closed_loop import fly, make_pilot
from sim.flight.faults import Derate, FaultSchedule, WindStep
from sim.flight.jobs import PressJob
from sim.flight.options import FlightOptions, pilot_config
from sim.flight.surroundings import World
from sim.sensors.camera_mount import CameraMount
from sim.world.plant_scene import PlantScene
from sim.world.scene import Scene
from sim.world.true_vehicle import true_vehicle

OPTIONS = FlightOptions(features="geometric", video=False)


def world_and_pilot():
    scene = near_wall()
    config = pilot_config(scene, OPTIONS)
    return World(scene, OPTIONS, config), make_pilot(scene, OPTIONS, config, PressJob())


def test_a_fault_strikes_once_when_its_time_has_come():
    world, pilot = world_and_pilot()
    schedule = FaultSchedule((Derate(after="start", delay_s=0.1, rotor="mid_right", share=0.5),))
    struck = []
    for tick in range(50):
        if schedule.tick(world, pilot):
            struck.append(tick)
        world.act(pilot.step(world.sense()).thrusts)
    assert struck == [25]
    low, high = world.plant.thrust_limits
    assert high == pytest.approx([26.28, *[52.56] * 5]) and low == pytest.approx(1.2)
    assert pilot.measurement is not None and pilot.measurement.thrust_max is not None
    assert pilot.measurement.thrust_max == pytest.approx(high)


def test_an_untold_fault_changes_the_plant_alone():
    world, pilot = world_and_pilot()
    Derate(rotor="mid_left", share=0.3, reported=False).strike(world, pilot)
    assert pilot.thrust_limits is None
    assert world.plant.thrust_limits[1][1] == pytest.approx(0.3 * 52.56)


def test_a_stopped_rotor_gives_nothing_and_the_wall_is_given_up():
    world, pilot = world_and_pilot()
    Derate(rotor="rear_left", share=0.0).strike(world, pilot)
    assert pilot.step(world.sense()).mode == "free" and pilot.painter.phase == "retreat"
    for _ in range(200):
        world.plant.step(np.full(6, 11.0))
    assert world.plant.thrusts_actual[5] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("rotor", ["front_left", pytest.param("mid_right", marks=pytest.mark.slow)])
def test_a_vehicle_that_loses_a_rotor_while_pressing_leaves_the_wall_and_comes_down(rotor):
    """The issue's figures; front_left leaves a force of 8 N towards the wall unless the vehicle tilts."""
    fault = Derate(delay_s=1.0, rotor=rotor, share=0.0)
    trace = fly(near_wall(), OPTIONS, job=PressJob(hold_s=8.0, descend_s=5.0), faults=(fault,))
    figures = loss_figures(trace)
    # Touch, ramp, loss of the rotor and the phases since: no thrust ever steps farther than the rate limit.
    assert np.abs(np.diff(trace.thrusts[1:], axis=0)).max() <= 500.0 * 0.004 + 1e-6
    assert trace.completed, trace.reason
    assert figures["survived_s"] >= 4.99 and figures["detached"] == 1.0
    assert figures["tilt_peak_deg"] <= 25.0 and 0.0 < figures["descent_peak_m_s"] <= 1.5


def test_wind_pushes_from_the_step_on():
    world, pilot = world_and_pilot()
    text = WindStep(mean_m_s=(0.0, 8.0, 0.0)).strike(world, pilot)
    for _ in range(25):
        world.act(pilot.step(world.sense()).thrusts)
    # 0.9 N per m/s of airspeed on 6 kg: 1.2 m/s^2 for 0.1 s, less what the pilot does against it.
    assert 0.06 < world.plant.velocity[1] < 0.13
    assert "wind steps" in text


def test_press_job_holds_as_long_as_asked_whatever_the_push_does():
    trace = fly(near_wall(paint={"push_n": 35.0}), OPTIONS, job=PressJob(hold_s=2.0))
    assert trace.completed, trace.reason
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
