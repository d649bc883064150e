"""Steps of the attitude: absorbed at once, given back slowly; roll and pitch by rate and attitude."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from symbolic_block import Block

from ibvs_qp.estimation.attitude import (
    BIAS_TIME,
    MOST_BIAS,
    RETURN_RATE,
    UNFILTERED_HZ,
    continuous_attitude,
    filtered_roll_pitch,
    gyro_bias,
)

TICK = 0.004
REST = (0.0, 0.0, 0.0)


class AttitudeSteps:
    """The continuous attitude, or None while it is the measured one."""

    def __init__(self) -> None:
        self._block = Block(
            lambda signals: continuous_attitude(
                signals, signals.input("measured", 4), signals.input("rate", 3), signals.input("dt")
            )
        )

    def update(self, attitude: list[float], rate: tuple[float, float, float], dt: float) -> list[float] | None:
        given = self._block(measured=attitude, rate=rate, dt=dt).tolist()
        return None if given == attitude else given


def quaternion(*euler_deg: float) -> list[float]:
    x, y, z, w = Rotation.from_euler("xyz", euler_deg, degrees=True).as_quat().tolist()
    return [w, x, y, z]


def angle_deg(first: list[float], second: list[float]) -> float:
    return math.degrees(2.0 * math.acos(min(1.0, abs(float(np.dot(first, second))))))


def test_motion_and_noise_pass_unchanged() -> None:
    steps, rng, roll = AttitudeSteps(), np.random.default_rng(0), 0.0
    for _ in range(1000):
        roll += math.degrees(2.0 * TICK)  # 2 rad/s
        noisy = quaternion(roll, *rng.normal(0.0, 0.1, 2))
        assert steps.update(noisy, (2.0, 0.0, 0.0), TICK) is None


def test_noise_of_any_size_is_no_random_walk() -> None:
    """0.3 deg a sample and axis, whatever the gate: what is given out stays where the vehicle is."""
    steps, rng, errors = AttitudeSteps(), np.random.default_rng(1), []
    for _ in range(7500):
        noisy = quaternion(*rng.normal(0.0, 0.3, 3))
        errors.append(angle_deg(steps.update(noisy, REST, TICK) or noisy, [1.0, 0.0, 0.0, 0.0]))
    assert max(errors) < 4.0  # the first second, while its size is learnt
    assert np.mean(errors[1000:]) < 0.6


def test_a_late_sample_lets_no_step_through() -> None:
    """Half a second without an attitude while the gyro's last value misses a turn of 3 deg; a step of 2 deg later."""
    steps = AttitudeSteps()
    assert steps.update(quaternion(0.0, 0.0, 0.0), REST, TICK) is None
    before = steps.update(quaternion(3.0, 0.0, 0.0), REST, 0.5)
    assert before is not None
    given = steps.update(quaternion(3.0, 2.0, 0.0), REST, TICK)
    assert given is not None and angle_deg(given, before) < 0.01


@pytest.mark.parametrize("step", [(2.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, -30.0), (1.5, -2.0, 10.0)])
def test_a_step_is_absorbed_and_given_back_at_its_rate(step: tuple[float, float, float]) -> None:
    steps, before, after = AttitudeSteps(), quaternion(1.0, 2.0, 3.0), quaternion(*np.add((1.0, 2.0, 3.0), step))
    assert steps.update(before, REST, TICK) is None
    given = steps.update(after, REST, TICK)
    assert given is not None and angle_deg(given, before) < 0.01
    size, ticks = angle_deg(before, after), 1
    while given is not None:
        last, given = given, steps.update(after, REST, TICK)
        moved = angle_deg(last, given or after)
        assert moved <= math.degrees(RETURN_RATE) * TICK * 1.01 + 1e-5
        ticks += 1
    assert ticks * TICK == pytest.approx(size / math.degrees(RETURN_RATE), rel=0.02)


def test_a_step_while_turning_leaves_the_turn() -> None:
    steps, rate, roll = AttitudeSteps(), (1.0, 0.0, 0.0), 0.0
    given: list[float] | None = None
    for tick in range(250):
        roll += math.degrees(TICK)
        jumped = roll + (3.0 if tick >= 100 else 0.0)
        given = steps.update(quaternion(jumped, 0.0, 0.0), rate, TICK)
    assert given is not None and angle_deg(given, quaternion(roll, 0.0, 0.0)) == pytest.approx(0.3, abs=0.02)


def test_the_sign_of_a_quaternion_means_nothing() -> None:
    steps, attitude = AttitudeSteps(), quaternion(5.0, -4.0, 170.0)
    assert steps.update(attitude, REST, TICK) is None
    for _ in range(500):  # nor does it leave the attitude to a gyro with a bias
        flipped = steps.update([-entry for entry in attitude], (0.02, 0.0, 0.0), TICK)
        assert flipped is None or angle_deg(flipped, attitude) < 0.01


# ----------------------------------------------------------------------------------------------- roll and pitch

HZ = 12.0


def roll_pitch(bandwidth_hz: float = HZ) -> Block:
    def build(signals):
        angles, rates = signals.input("angles", 2), signals.input("rates", 2)
        return filtered_roll_pitch(signals, angles, rates, bandwidth_hz, signals.input("dt"))

    return Block(build)


def test_the_first_estimate_counts_in_full() -> None:
    np.testing.assert_allclose(roll_pitch()(angles=[0.1, -0.2], rates=[1.0, 1.0]), [0.1, -0.2])


def test_noise_of_the_attitude_falls_and_a_rotation_is_not_late() -> None:
    """A low-pass of this bandwidth would be 13 ms late."""
    rng, estimate, found, true = np.random.default_rng(0), roll_pitch(), [], []
    for tick in range(2000):
        phase = 2.0 * math.pi * 2.0 * tick * TICK
        angle, rate = 0.02 * math.sin(phase), 0.02 * 4.0 * math.pi * math.cos(phase - math.pi * 2.0 * TICK)
        noise = 0.001 * rng.standard_normal(2)
        found.append(estimate(angles=angle + noise, rates=[rate, rate]))
        true.append([angle, angle])
    error = (np.array(found) - np.array(true))[100:]
    gain = 1.0 - math.exp(-2.0 * math.pi * HZ * TICK)
    assert float(np.std(error)) == pytest.approx(0.001 * math.sqrt(gain / (2.0 - gain)), rel=0.1)


def test_a_biased_rate_leaves_its_share_of_the_time_constant() -> None:
    estimate = roll_pitch()
    for _ in range(1000):
        found = estimate(angles=[0.0, 0.0], rates=[0.01, -0.01])
    gain = 1.0 - math.exp(-2.0 * math.pi * HZ * TICK)
    np.testing.assert_allclose(found, np.array([1.0, -1.0]) * 0.01 * TICK * (1.0 - gain) / gain, rtol=1e-6)


def test_at_the_largest_bandwidth_the_attitude_is_taken_as_it_is() -> None:
    estimate = roll_pitch(UNFILTERED_HZ)
    for _ in range(3):
        np.testing.assert_array_equal(estimate(angles=[0.03, 0.01], rates=[5.0, -5.0]), [0.03, 0.01])


def bias_after(seconds: float, bias: float, noise_deg: float = 0.0) -> np.ndarray:
    """Estimate [rad/s] of a gyro with a bias about all axes, on a vehicle that rolls by 10 deg at 0.5 Hz."""
    block = Block(
        lambda signals: gyro_bias(signals, signals.input("attitude", 4), signals.input("rate", 3), signals.input("dt"))
    )
    rng, swing, found = np.random.default_rng(2), math.radians(10.0), np.zeros(3)
    for tick in range(1, round(seconds / TICK) + 1):
        phase, middle = math.pi * tick * TICK, math.pi * (tick - 0.5) * TICK
        attitude = quaternion(math.degrees(swing * math.sin(phase)) + rng.normal(0.0, noise_deg), 0.0, 0.0)
        found = block(attitude=attitude, rate=(swing * math.pi * math.cos(middle) + bias, bias, bias), dt=TICK)
    return found


@pytest.mark.parametrize("bias", [0.0, math.radians(3.0), -math.radians(3.0)])
def test_the_bias_of_a_gyro_is_found_while_the_vehicle_moves(bias: float) -> None:
    np.testing.assert_allclose(bias_after(8.0 * BIAS_TIME, bias), bias, atol=5e-4 * abs(bias) + 1e-5)


def test_noise_of_the_attitude_is_no_bias() -> None:
    found = [bias_after(BIAS_TIME + 0.1 * k, 0.0, noise_deg=0.1)[0] for k in range(10)]
    assert np.abs(found).max() < 3.0 * math.radians(0.1) / BIAS_TIME


def test_a_bias_beyond_any_gyro_is_bounded() -> None:
    np.testing.assert_allclose(bias_after(4.0, 1.0), MOST_BIAS)
