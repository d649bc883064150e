"""The estimated angular velocity: less noise than the gyro, not late, and its loop's sensitivity."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from symbolic_block import Block

import ibvs_qp
from allocation import control_effectiveness
from ibvs_qp.config import AngularRateSettings, ConfigError, ControllerConfig, Gains
from ibvs_qp.config.gains import LONGEST_FILTER
from ibvs_qp.estimation.attitude import estimated_rate
from ibvs_qp.estimation.inputs import Body, motor_thrust
from ibvs_qp.model.motion_margin import LARGEST_SENSITIVITY, MotionLoop, motion_sensitivity

TICK = 0.004
#: Motors that rise and fall alike, so that the vehicle is linear.
LAG = 0.0575
VEHICLE = dataclasses.replace(ControllerConfig().vehicle, motor_lag_up_s=LAG, motor_lag_down_s=LAG)
MATRIX = control_effectiveness(VEHICLE.geometry)
HOVER = np.linalg.solve(MATRIX, [0.0, 0.0, -VEHICLE.mass_kg * 9.81, 0.0, 0.0, 0.0])
PITCH_INERTIA = VEHICLE.inertia_kg_m2[1]


def estimator(bandwidth_hz: float = 12.5) -> Block:
    """Angular velocity and acceleration in one column."""
    config = ControllerConfig(vehicle=VEHICLE, angular_rate=AngularRateSettings(gyro_bandwidth_hz=bandwidth_hz))

    def build(signals):
        import casadi as ca

        body = Body.of(signals)
        return ca.vertcat(*estimated_rate(signals, config, MATRIX, body, motor_thrust(signals, VEHICLE, body.dt)))

    return Block(build)


def pitching(bandwidth_hz: float, gyro_noise: float = 0.0, unmodelled: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """True and estimated pitch rate while rotors pitch the vehicle at 2 Hz [rad/s]."""
    block, rng, rate, actual = estimator(bandwidth_hz), np.random.default_rng(0), 0.0, 0.0
    true, found = [], []
    for tick in range(1000):
        wanted = 0.5 * math.sin(2.0 * math.pi * 2.0 * tick * TICK)  # N m
        thrusts = HOVER + np.linalg.solve(MATRIX, [0.0, 0.0, 0.0, 0.0, wanted, 0.0])
        gyro = [0.0, rate + gyro_noise * rng.standard_normal(), 0.0]
        value = block(thrust_last=thrusts, commanded=float(tick > 0), angular_velocity=gyro)
        true.append(rate)
        found.append(value[1])
        actual += (1.0 - math.exp(-TICK / LAG)) * (wanted - actual)
        rate += TICK * (actual + unmodelled) / PITCH_INERTIA
        if unmodelled:
            rate *= 0.99  # drag, so that a constant moment ends in a constant rate
    return np.array(true)[250:], np.array(found)[250:]


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_noise_of_the_gyro_falls_and_a_commanded_rotation_is_not_late() -> None:
    """A low-pass of this bandwidth leaves the same noise and is 13 ms late: a tenth of the rate at 2 Hz."""
    true, found = pitching(12.5)
    assert rms(found - true) < 0.01 * rms(true)
    noisy = pitching(12.5, gyro_noise=0.02)[1]
    gain = 1.0 - math.exp(-2.0 * math.pi * 12.5 * TICK)
    assert rms(noisy - found) == pytest.approx(0.02 * math.sqrt(gain / (2.0 - gain)), rel=0.1)


def test_an_unmodelled_moment_leaves_a_bounded_error() -> None:
    """Its acceleration over the bandwidth [rad/s]."""
    true, found = pitching(12.5, unmodelled=0.1)
    assert np.abs(found - true).max() < 1.1 * (0.1 / PITCH_INERTIA + 0.01 * true.max() / TICK) / (2 * math.pi * 12.5)


def test_the_gyro_counts_in_full_at_the_start_and_at_the_largest_bandwidth() -> None:
    np.testing.assert_array_equal(estimator()(angular_velocity=[0.1, -0.2, 0.3], commanded=0.0)[:3], [0.1, -0.2, 0.3])
    true, found = pitching(1000.0, gyro_noise=0.02)
    assert rms(found - true) == pytest.approx(0.02, rel=0.1)


def test_a_bandwidth_out_of_range_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"gyro_bandwidth_hz.*0 Hz.*0.5"):
        AngularRateSettings(gyro_bandwidth_hz=0.0)


@pytest.mark.parametrize("omega", [9.0, 20.0])
@pytest.mark.parametrize(("filter_s", "lag_ratio"), [(0.0, 1.0), (0.012, 1.0), (0.012, 1.3), (0.006, 0.75)])
def test_the_sensitivity_is_that_of_the_flown_loop(omega: float, filter_s: float, lag_ratio: float) -> None:
    """Response of pitch to a sinusoidal moment through the block, lead, filter and motors, against the formula."""
    kp, kd, lead = 80.0, 22.0, 0.03
    loop = MotionLoop(
        kp=kp, kd=kd, lag=LAG, delay=0.5 * TICK, lead=lead, bandwidth_hz=12.5, filter_s=filter_s, lag_ratio=lag_ratio
    )
    block, angle, rate, actual, record, commanded = estimator(), 0.0, 0.0, 0.0, [], 0.0
    share = math.exp(-TICK / filter_s) if filter_s else 0.0
    thrusts = HOVER
    for tick in range(2500):
        value = block(thrust_last=thrusts, commanded=float(tick > 0), angular_velocity=[0.0, rate, 0.0])
        wanted = share * commanded - (1.0 - share) * (kp * angle + kd * (value[1] + lead * value[4]))
        commanded = wanted
        thrusts = HOVER + np.linalg.solve(MATRIX, [0.0, 0.0, 0.0, 0.0, PITCH_INERTIA * wanted, 0.0])
        disturbed = wanted + 0.1 * math.sin(omega * tick * TICK)  # at the command, where the loop is broken
        for _ in range(8):
            step = TICK / 8
            actual += (1.0 - math.exp(-step / (lag_ratio * LAG))) * (disturbed - actual)
            angle, rate = angle + step * rate, rate + step * actual
        record.append(disturbed)
    last = np.array(record[1000:])
    phase = np.exp(-1j * omega * TICK * np.arange(1000, 2500))
    measured = 2.0 * abs(np.mean(last * phase)) / 0.1
    assert measured == pytest.approx(float(abs(loop.sensitivity(np.array([omega]))[0])), rel=0.05)


def test_the_peak_of_an_unstable_loop_is_infinite() -> None:
    """By Routh a double integrator behind the lag is unstable for kd < lag kp; delay comes on top."""
    gains = {"kp": 200.0, "lag": LAG, "delay": 1.5 * TICK}
    stable, unstable = MotionLoop(kd=30.0, **gains), MotionLoop(kd=0.9 * 200.0 * LAG, **gains)
    assert stable.spectral_radius < 1.0 < stable.sensitivity_peak < 4.0
    assert unstable.spectral_radius > 1.0 and math.isinf(unstable.sensitivity_peak)
    assert np.abs(unstable.sensitivity(np.geomspace(0.3, 300.0, 600))).max() < 100.0


def test_the_qp_bears_motors_of_another_lag() -> None:
    config = ibvs_qp.preset("qp").controller
    assert max(motion_sensitivity(config).values()) <= 2.0
    for ratio in (0.75, 1.3):
        assert max(motion_sensitivity(config, ratio).values()) <= 2.3


def test_the_loops_of_an_approach_need_a_short_filter() -> None:
    """Stand-off and last centimetre are the shipped damping of either with 2 /s of speed per distance."""
    config = ibvs_qp.preset("qp").controller
    peaks = motion_sensitivity(config)
    assert peaks["standoff"] == pytest.approx(1.29, abs=0.01) and peaks["landing"] == pytest.approx(1.35, abs=0.01)
    loop = {"kp": 30.0, "kd": 15.0, "lag": LAG, "delay": 1.5 * TICK, "lead": config.gains.push_lead_s}
    assert MotionLoop(**loop, filter_s=config.gains.push_filter_s).sensitivity_peak == pytest.approx(peaks["landing"])
    assert 2.0 < MotionLoop(**loop, filter_s=LONGEST_FILTER).sensitivity_peak < 2.5
    assert math.isinf(MotionLoop(**loop, filter_s=0.5).sensitivity_peak)
    with pytest.raises(ConfigError, match="push_filter_s"):
        Gains(push_filter_s=1.01 * LONGEST_FILTER)


@pytest.mark.parametrize("law", ["qp", "paper"])
def test_the_shipped_gains_keep_their_distance_from_instability(law: str) -> None:
    config = ibvs_qp.preset(law).controller
    assert max(motion_sensitivity(config).values()) <= LARGEST_SENSITIVITY
    late = dataclasses.replace(config, angular_rate=AngularRateSettings(gyro_bandwidth_hz=2.0, lead_s=0.0))
    assert motion_sensitivity(late)["attitude"] > motion_sensitivity(config)["attitude"]
