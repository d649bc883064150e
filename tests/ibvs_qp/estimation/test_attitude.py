"""Steps of the attitude: absorbed at once, given back slowly; roll and pitch by rate and attitude."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from symbolic_block import Block

from ibvs_qp.config import LONGEST_TICK
from ibvs_qp.estimation.attitude import (
    BIAS_TIME,
    MOST_BIAS,
    RETURN_RATE,
    UNCERTAIN_BIAS,
    UNFILTERED_HZ,
    continuous_attitude,
    filtered_roll_pitch,
    gyro_bias,
)
from ibvs_qp.symbolic.signals import Signals

TICK = 0.004
REST = (0.0, 0.0, 0.0)


class AttitudeSteps:
    """The continuous attitude, or None while it is the measured one."""

    def __init__(self) -> None:
        def build(signals: Signals) -> ca.SX:
            measured, rate, dt = signals.input("measured", 4), signals.input("rate", 3), signals.input("dt")
            given = continuous_attitude(signals, measured, signals.state("given", 4), rate, dt)
            return signals.remember("given", given)

        self._block = Block(build)

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


class Gyro:
    """A gyro with a bias about all axes beside an attitude estimate, on a vehicle that rolls by 10 deg at 0.5 Hz."""

    def __init__(self, bias: float = 0.0, noise_deg: float = 0.0, held: int = 1) -> None:
        def build(signals: Signals) -> ca.SX:
            attitude, rate = signals.input("attitude", 4), signals.input("rate", 3)
            measured, dt, elapsed = (signals.input(name) for name in ("measured", "dt", "elapsed"))
            found = gyro_bias(signals, measured, attitude, rate, dt, elapsed)
            signals.remember("steps.power", signals.state("steps.power", start=3.0 * math.radians(noise_deg) ** 2))
            return found

        self._block, self._rng = Block(build), np.random.default_rng(2)
        self._bias, self._noise, self._held = bias, noise_deg, held
        self.seconds, self.yaw_deg, self._tick, self._last = 0.0, 0.0, 0, [1.0, 0.0, 0.0, 0.0]

    def run(self, seconds: float, measured: bool = True, elapsed: float = TICK) -> np.ndarray:
        """The estimate [rad/s] after ticks of a length."""
        swing, found = math.radians(10.0), np.zeros(3)
        for _ in range(round(seconds / elapsed)):
            middle = math.pi * (self.seconds + 0.5 * elapsed)
            self.seconds += elapsed
            roll = math.degrees(swing * math.sin(math.pi * self.seconds)) + self._rng.normal(0.0, self._noise)
            if self._tick % self._held == 0:
                self._last = quaternion(roll, 0.0, self.yaw_deg)
            self._tick += 1
            rate = (swing * math.pi * math.cos(middle) + self._bias, self._bias, self._bias)
            dt = min(elapsed, LONGEST_TICK)
            found = self._block(attitude=self._last, rate=rate, measured=measured, dt=dt, elapsed=elapsed)
        return found


def certain(bias: float) -> float:
    """The part that is subtracted."""
    return math.copysign(max(abs(bias) - UNCERTAIN_BIAS, 0.0), bias)


@pytest.mark.parametrize("bias", [0.0, math.radians(0.3), math.radians(3.0), -math.radians(3.0)])
def test_the_bias_of_a_gyro_is_found_while_the_vehicle_moves(bias: float) -> None:
    np.testing.assert_allclose(Gyro(bias).run(8.0 * BIAS_TIME), certain(bias), atol=5e-4 * abs(bias) + 1e-5)


@pytest.mark.parametrize(("held", "ripple_deg_s"), [(5, 0.02), (25, 0.3)])
def test_an_attitude_of_50_or_10_hz_is_enough(held: int, ripple_deg_s: float) -> None:
    bias = math.radians(3.0)
    np.testing.assert_allclose(Gyro(bias, held=held).run(8.0), certain(bias), atol=math.radians(ripple_deg_s))


def test_noise_of_the_attitude_is_no_bias() -> None:
    found = [Gyro(noise_deg=0.1).run(BIAS_TIME + 0.1 * k) for k in range(10)]
    np.testing.assert_array_equal(found, 0.0)


def test_a_bias_beyond_any_gyro_is_bounded() -> None:
    found = Gyro(1.0).run(6.0 * BIAS_TIME)
    np.testing.assert_allclose(found, certain(MOST_BIAS), rtol=0.01)
    assert (found <= certain(MOST_BIAS)).all()


@pytest.mark.parametrize("step_deg", [0.9, 2.0, 30.0])
def test_a_step_of_the_attitude_is_no_bias(step_deg: float) -> None:
    """It counts as two standard deviations of the noise, and that is not certain."""
    gyro = Gyro(noise_deg=0.05)
    gyro.run(1.0)
    gyro.yaw_deg = step_deg
    assert gyro.run(TICK)[2] == gyro.run(3.0)[2] == 0.0


def test_after_missing_ticks_and_outages_the_comparison_begins_anew() -> None:
    bias = math.radians(3.0)
    gyro = Gyro(bias)
    gyro.run(8.0)
    for measured, elapsed in ((True, 0.3), (False, TICK)):
        np.testing.assert_allclose(gyro.run(0.6, measured=measured, elapsed=elapsed), certain(bias), rtol=1e-2)
        np.testing.assert_allclose(gyro.run(0.1), certain(bias), rtol=1e-2)
