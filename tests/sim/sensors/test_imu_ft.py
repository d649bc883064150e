"""IMU and force/torque sensor: rates, stamps, delays, noise, biases, independent streams."""

import dataclasses
import math

import numpy as np
import pytest
from controller_scenes import TICK_NS

from ibvs_qp.frames import GRAVITY, roll_pitch, rotation_from_quaternion
from ibvs_qp.measurement import SensorFrame
from sim.sensors.sample_clock import SampleClock
from sim.sensors.suite import SensorSuite
from sim.world.plant import Plant
from sim.world.scene import ForceTorqueScene, ImuScene, Scene

CLEAN_IMU = ImuScene(gyro_density=0.0, accel_density=0.0, attitude_bias_deg=0.0, attitude_noise_deg=0.0)
CLEAN_FT = ForceTorqueScene(sigma_n=0.0, sigma_nm=0.0, bias_n=0.0)


def scene(imu: ImuScene = CLEAN_IMU, force_torque: ForceTorqueScene = CLEAN_FT) -> Scene:
    return Scene(imu=imu, force_torque=force_torque)


def record(world: Scene, ticks: int, seed: int = 0, wiggle: float = 0.0) -> tuple[list[SensorFrame], list[np.ndarray]]:
    """Sensor frames at every tick, and the true wrench at the sensor then."""
    plant, suite = Plant(world, seed=seed), SensorSuite(world, seed=seed)
    rng, frames, truth = np.random.default_rng(0), [], []
    for _ in range(ticks):
        frames.append(suite.sample(plant))
        truth.append(plant.ft_wrench)
        plant.step(plant.thrusts_actual + wiggle * rng.normal(size=6))
    return frames, truth


@pytest.mark.parametrize(("latency", "late_ticks"), [(0.0, 0), (0.004, 1), (0.010, 3), (0.100, 25)])
def test_wrench_arrives_late_with_the_stamp_of_its_sampling(latency, late_ticks):
    world = scene(force_torque=dataclasses.replace(CLEAN_FT, latency_s=latency))
    frames, truth = record(world, 200, wiggle=1.0)
    for index, frame in enumerate(frames):
        assert frame.stamp_ns == index * TICK_NS
        np.testing.assert_array_equal(frame.wrench, truth[frame.wrench_stamp_ns // TICK_NS])
        # The first sample is there at once; then the newest one whose delay is over. 100 Hz is ticks 0, 3, 5, 8, 10 ...
        due = [k for k in range(index + 1 - late_ticks) if k % 5 in (0, 3)]
        assert frame.wrench_stamp_ns == (due[-1] if due else 0) * TICK_NS


@pytest.mark.parametrize(("rate", "per_second"), [(20.0, 20), (100.0, 100), (250.0, 250), (60.0, 60), (1000.0, 250)])
def test_sample_rate_never_drifts(rate, per_second):
    clock = SampleClock(rate)
    due = [clock.due(tick * TICK_NS) for tick in range(250 * 60)]
    assert sum(due) == per_second * 60
    assert all(sum(due[k : k + 250]) == per_second for k in range(0, len(due), 250))


def test_imu_holds_between_its_samples():
    world = scene(imu=ImuScene(rate_hz=50.0))
    frames, _ = record(world, 100)
    for index, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.attitude, frames[index - index % 5].attitude)
        np.testing.assert_array_equal(frame.specific_force, frames[index - index % 5].specific_force)
    assert len({frame.angular_velocity.tobytes() for frame in frames}) == 20


def test_clean_sensors_read_the_truth_up_to_an_arbitrary_yaw():
    world = scene()
    plant, suite = Plant(world, seed=4), SensorSuite(world, seed=4)
    rng, turns = np.random.default_rng(0), []
    for _ in range(50):
        plant.step(plant.thrusts_actual + rng.normal(size=6))
        frame = suite.sample(plant)
        np.testing.assert_array_equal(frame.angular_velocity, plant.angular_velocity)
        np.testing.assert_array_equal(frame.specific_force, plant.specific_force)
        np.testing.assert_allclose(roll_pitch(frame.attitude), plant.euler[:2], atol=1e-12)
        turns.append(rotation_from_quaternion(frame.attitude) @ plant.rotation.T)
    np.testing.assert_allclose(turns, np.broadcast_to(turns[0], (50, 3, 3)), atol=1e-12)
    np.testing.assert_allclose(turns[0][2], [0.0, 0.0, 1.0], atol=1e-12)
    assert abs(math.atan2(turns[0][1, 0], turns[0][0, 0])) > 1e-3
    assert frame.image is None and frame.features is None


def test_noise_has_the_stated_size():
    world = scene(imu=ImuScene(), force_torque=ForceTorqueScene(rate_hz=250.0, latency_s=0.0))
    frames, truth = record(world, 4000, seed=8)
    gyro = np.array([frame.angular_velocity for frame in frames])
    accel = np.array([frame.specific_force for frame in frames])
    wrench = np.array([frame.wrench for frame in frames]) - np.array(truth)
    tilt = np.degrees([roll_pitch(frame.attitude) for frame in frames])
    np.testing.assert_allclose(gyro.std(axis=0), 3.4e-4 * math.sqrt(250.0), rtol=0.05)
    np.testing.assert_allclose(accel.std(axis=0), 4e-3 * math.sqrt(250.0), rtol=0.05)
    np.testing.assert_allclose(accel.mean(axis=0), [0.0, 0.0, -GRAVITY], atol=0.005)
    np.testing.assert_allclose(wrench.std(axis=0), [0.1] * 3 + [0.005] * 3, rtol=0.05)
    assert np.linalg.norm(wrench[:, :3].mean(axis=0)) == pytest.approx(0.05, abs=0.006)
    np.testing.assert_allclose(tilt.std(axis=0), 0.05, rtol=0.05)
    correlation = np.corrcoef(np.hstack((gyro, accel, wrench, tilt)), rowvar=False)
    assert np.abs(correlation - np.eye(len(correlation))).max() < 0.08, "no two channels share their noise"
    assert np.linalg.norm(tilt.mean(axis=0)) == pytest.approx(0.1, abs=0.005)


def test_biases_and_yaw_belong_to_the_seed():
    first, second = (SensorSuite(scene(ImuScene(), ForceTorqueScene()), seed=seed) for seed in (1, 2))
    assert np.linalg.norm(first.force_torque.bias[:3]) == pytest.approx(0.05)
    assert not first.force_torque.bias[3:].any()
    assert not np.allclose(first.force_torque.bias, second.force_torque.bias)
    again = SensorSuite(scene(ImuScene(), ForceTorqueScene()), seed=1)
    np.testing.assert_array_equal(first.force_torque.bias, again.force_torque.bias)


def test_same_seed_same_bits_and_one_sensor_never_shifts_another():
    def channels(world: Scene, seed: int) -> tuple[bytes, bytes, bytes]:
        frames, _ = record(world, 50, seed)
        attitude = np.array([frame.attitude for frame in frames])
        gyro = np.array([frame.angular_velocity for frame in frames])
        wrench = np.array([frame.wrench for frame in frames])
        return attitude.tobytes(), gyro.tobytes(), wrench.tobytes()

    world = scene(ImuScene(), ForceTorqueScene())
    attitude, gyro, wrench = channels(world, 3)
    assert channels(world, 3) == (attitude, gyro, wrench)
    assert all(a != b for a, b in zip(channels(world, 4), (attitude, gyro, wrench), strict=True))
    noisy_force = scene(ImuScene(), ForceTorqueScene(rate_hz=250.0, sigma_n=3.0))
    assert channels(noisy_force, 3)[:2] == (attitude, gyro)
    slow_imu = scene(ImuScene(rate_hz=50.0), ForceTorqueScene())
    assert channels(slow_imu, 3)[2] == wrench


def test_frames_keep_their_values_while_the_flight_goes_on():
    world = scene(ImuScene(), ForceTorqueScene())
    plant, suite = Plant(world), SensorSuite(world)
    frame = suite.sample(plant)
    parts = (frame.attitude, frame.angular_velocity, frame.specific_force, frame.wrench, plant.position, plant.velocity)
    copies = [part.copy() for part in parts]
    for _ in range(20):
        plant.step(plant.thrusts_actual + 1.0)
        suite.sample(plant)
    for part, copy in zip(parts, copies, strict=True):
        np.testing.assert_array_equal(part, copy)
