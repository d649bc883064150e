"""Errors of IMU and force/torque sensor: stated sizes over samples and seeds, streams of their own, none in an ideal
world."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from controller_scenes import TICK_NS

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY, roll_pitch
from ibvs_qp.measurement import SensorFrame
from sim.sensors.imu_errors import ACCELEROMETER_TIME_S, ImuErrors
from sim.sensors.suite import SensorSuite
from sim.sensors.vibration import BLADE_HZ, BLADE_SPREAD, Vibration
from sim.sensors.wrench_errors import WrenchErrors
from sim.world.errors import AccelerometerErrors, AttitudeErrors, ForceTorqueErrors, GyroErrors, WorldErrors
from sim.world.plant import Plant
from sim.world.random_streams import Normals, stream
from sim.world.readout import PLACES, SIZE
from sim.world.scene import Scene
from sim.world.slow_noise import SlowNoise

RATE = 250.0
LEVEL = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -GRAVITY])
HOVER = np.full(6, 10.0)
#: Every section with something in every field.
ALL = WorldErrors(
    attitude=AttitudeErrors(bias_deg=0.5, wander_deg=0.2, noise_deg=0.05),
    gyro=GyroErrors(density=1e-3, bias_rad_s=1e-3, instability_rad_s=1e-3, vibration_rad_s=0.01),
    accelerometer=AccelerometerErrors(density=0.01, bias_m_s2=0.02, instability_m_s2=0.01, vibration_m_s2=0.3),
    force_torque=ForceTorqueErrors(noise_n=0.2, noise_nm=0.01, bias_n=0.15, drift_n_min=0.1, gain=0.01, tool_mass=0.02),
)


def imu_samples(count: int, seed: int = 0, **sections: Any) -> np.ndarray:
    """Errors of samples of a hovering IMU: tilt (roll, pitch) [rad], rate [rad/s], force [m/s^2], (count, 8)."""
    errors, rows = ImuErrors(WorldErrors(**sections), RATE, seed), []
    for tick in range(count):
        errors.tick(tick * TICK_NS, HOVER)
        sample = errors.applied(LEVEL)
        rows.append(np.concatenate((roll_pitch(sample[:4]), sample[4:] - LEVEL[4:])))
    return np.array(rows)


def readings(wrench: np.ndarray, count: int, seed: int = 0, felt: tuple[float, ...] = (0.0,) * 3, **errors: float):
    """Readings of a constant wrench at 100 Hz, (count, 6)."""
    model, truth = WrenchErrors(ForceTorqueErrors(**errors), VehicleParams(), seed), np.zeros(SIZE)
    truth[PLACES["felt"]] = felt
    return np.array([model.applied(wrench, truth, index * 10_000_000) for index in range(count)])


def test_biases_have_the_stated_length_and_the_seeds_direction():
    sections = {
        "attitude": AttitudeErrors(bias_deg=0.5),
        "gyro": GyroErrors(bias_rad_s=0.002),
        "accelerometer": AccelerometerErrors(bias_m_s2=0.02),
    }
    found = np.array([imu_samples(1, seed, **sections)[0] for seed in range(800)])
    np.testing.assert_allclose(np.degrees(np.linalg.norm(found[:, :2], axis=1)), 0.5, rtol=1e-3)
    np.testing.assert_allclose(np.linalg.norm(found[:, 2:5], axis=1), 0.002)
    np.testing.assert_allclose(np.linalg.norm(found[:, 5:], axis=1), 0.02)
    assert np.all(np.abs(found.mean(axis=0)) < 0.15 * found.std(axis=0)), "directions are uniform"


def test_white_noise_has_the_stated_size():
    found = imu_samples(
        20_000,
        attitude=AttitudeErrors(noise_deg=0.1),
        gyro=GyroErrors(density=1e-3),
        accelerometer=AccelerometerErrors(density=0.01),
    )
    size = [math.radians(0.1)] * 2 + [1e-3 * math.sqrt(RATE)] * 3 + [0.01 * math.sqrt(RATE)] * 3
    np.testing.assert_allclose(found.std(axis=0), size, rtol=0.03)
    assert np.abs(np.corrcoef(found, rowvar=False) - np.eye(8)).max() < 0.03


def test_wandering_errors_have_the_stated_size_and_correlation_time():
    process = SlowNoise(0.3, 2.0, 0.1, Normals(stream(0, "test")), 200)
    values = np.array([process.next() for _ in range(2000)])
    assert values[0].std() == pytest.approx(0.3, rel=0.1), "stationary from the first value on"
    assert values.std() == pytest.approx(0.3, rel=0.02)
    lag = np.mean(values[20:] * values[:-20]) / np.mean(values**2)
    assert lag == pytest.approx(math.exp(-1.0), abs=0.02)


def test_instability_and_attitude_wander_reach_the_channels():
    sections = {
        "attitude": AttitudeErrors(wander_deg=0.4, wander_time_s=20.0),
        "gyro": GyroErrors(instability_rad_s=0.001),
        "accelerometer": AccelerometerErrors(instability_m_s2=0.03),
    }
    found = np.array([imu_samples(1, seed, **sections)[0] for seed in range(1500)])
    size = [math.radians(0.4)] * 2 + [0.001] * 3 + [0.03] * 3
    np.testing.assert_allclose(found.std(axis=0), size, rtol=0.06)
    drift = imu_samples(500, **sections)[:, 5:]
    step = 0.03 * math.sqrt(2.0 / (RATE * ACCELEROMETER_TIME_S))
    np.testing.assert_allclose(np.diff(drift, axis=0).std(axis=0), step, rtol=0.1)


def test_vibration_has_the_stated_rms_over_a_hover_second_on_every_axis():
    for seed in range(20):
        found = imu_samples(
            251,
            seed,
            gyro=GyroErrors(vibration_rad_s=0.02),
            accelerometer=AccelerometerErrors(vibration_m_s2=0.5),
        )[1:]
        rms = np.sqrt(np.mean(found[:, 2:] ** 2, axis=0))
        np.testing.assert_allclose(rms, [0.02] * 3 + [0.5] * 3, rtol=0.06)


@pytest.mark.parametrize("load", [1.0, 1.44, 4.0])
def test_vibration_follows_the_root_of_the_thrust_and_aliases(load):
    vibration, values = Vibration([1.0], np.random.default_rng(0)), []
    vibration.tick(0, HOVER)
    for tick in range(1, 2501):
        vibration.tick(tick * TICK_NS, load * HOVER)
        values.append(vibration.value[0])
    spectrum = np.abs(np.fft.rfft(values))
    peaks = np.fft.rfftfreq(len(values), 1.0 / RATE)[spectrum > 0.3 * spectrum.max()]
    low, high = (BLADE_HZ * math.sqrt(load) * (1.0 + sign * BLADE_SPREAD) for sign in (-1.0, 1.0))
    if high > 0.5 * RATE:
        low, high = RATE - high, RATE - low
    assert peaks.min() > low - 0.2 and peaks.max() < high + 0.2
    assert np.std(values) == pytest.approx(load, rel=0.03), "amplitude follows the thrust"


def test_wrench_noise_bias_and_drift_have_the_stated_size():
    still = np.zeros(6)
    noise = readings(still, 20_000, noise_n=0.2, noise_nm=0.01)
    np.testing.assert_allclose(noise.std(axis=0), [0.2] * 3 + [0.01] * 3, rtol=0.03)
    for seed in range(4):
        bias = readings(still, 1, seed, bias_n=0.15)[0]
        assert np.linalg.norm(bias[:3]) == pytest.approx(0.15) and not bias[3:].any()
        drift = readings(still, 6001, seed, drift_n_min=0.3)
        assert np.linalg.norm(drift[-1, :3]) == pytest.approx(0.3) and not drift[0].any()


def test_gain_and_cross_talk_have_the_stated_size_over_seeds():
    push = np.array([10.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    gains = [readings(push, 1, seed, gain=0.03)[0] for seed in range(1500)]
    assert np.std(np.array(gains)[:, 0] / 10.0) == pytest.approx(0.03, rel=0.06)
    assert not np.array(gains)[:, 1:].any()
    cross = np.array([readings(push, 1, seed, cross_talk=0.02)[0] for seed in range(1500)])
    assert (cross[:, 0] == 10.0).all()
    np.testing.assert_allclose(cross[:, 1:].std(axis=0) / 10.0, [0.02] * 2 + [0.002] * 3, rtol=0.08)


def test_an_overloaded_sensor_saturates():
    read = readings(np.array([80.0, -80.0, 20.0, 5.0, 0.0, 0.0]), 1, overload_n=50.0)[0]
    np.testing.assert_array_equal(read, [50.0, -50.0, 20.0, 5.0, 0.0, 0.0])


def test_the_extra_mass_of_the_tool_is_felt_with_its_moment():
    vehicle, felt = VehicleParams(), (0.0, 0.0, -GRAVITY)
    extra = np.array([readings(np.zeros(6), 1, seed, felt, tool_mass=0.05)[0] for seed in range(1500)])
    assert extra[:, 2].std() == pytest.approx(0.05 * vehicle.tool_mass_kg * GRAVITY, rel=0.06)
    arm = vehicle.tool_position_m[0] - vehicle.force_torque_position_m[0]
    np.testing.assert_allclose(extra[:, 4], -arm * extra[:, 2])


def test_the_plant_carries_the_tool_as_the_error_model_does():
    plant, vehicle = Plant(Scene()), VehicleParams()
    carried = vehicle.tool_mass_kg * plant.specific_force
    arm = np.subtract(vehicle.tool_position_m, vehicle.force_torque_position_m)
    np.testing.assert_allclose(plant.ft_wrench, np.append(carried, np.cross(arm, carried)), atol=0.01)


def frames(errors: WorldErrors, seed: int, ticks: int = 60) -> list[SensorFrame]:
    """Sensor frames of a hovering vehicle; the motion does not depend on the errors of the sensors."""
    scene = Scene(errors=errors)
    plant, suite, found = Plant(scene, seed=seed), SensorSuite(scene, seed=seed), []
    for _ in range(ticks):
        found.append(suite.sample(plant))
        plant.step(plant.thrusts_actual)
    return found


def channels(errors: WorldErrors, seed: int) -> dict[str, bytes]:
    """Bits of every channel."""
    names = ("attitude", "angular_velocity", "specific_force", "wrench")
    return {name: np.array([getattr(frame, name) for frame in frames(errors, seed)]).tobytes() for name in names}


def test_same_seed_same_bits_and_different_seeds_differ():
    first, other = channels(ALL, 3), channels(ALL, 4)
    assert channels(ALL, 3) == first
    assert all(first[name] != other[name] for name in first)


@pytest.mark.parametrize(
    ("section", "changed"),
    [
        ("attitude", {"attitude"}),
        ("gyro", {"angular_velocity"}),
        ("accelerometer", {"specific_force"}),
        ("force_torque", {"wrench"}),
    ],
)
def test_an_error_of_one_sensor_leaves_the_others_as_they_are(section, changed):
    ideal = channels(WorldErrors(), 3)
    found = channels(dataclasses.replace(WorldErrors(), **{section: getattr(ALL, section)}), 3)
    assert {name for name in ideal if ideal[name] != found[name]} == changed


def test_sections_of_zeros_change_no_bit_of_an_error_model():
    """The path with errors and the path without them read the same where every size is zero."""
    errors = ImuErrors(WorldErrors(), RATE, 0)
    errors.tick(0, HOVER)
    np.testing.assert_array_equal(errors.applied(LEVEL), LEVEL)
    push = np.array([10.0, 1.0, 2.0, 0.1, 0.2, 0.3])
    np.testing.assert_array_equal(readings(push, 3), [push] * 3)
