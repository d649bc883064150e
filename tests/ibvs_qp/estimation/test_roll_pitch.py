"""Roll and pitch by rate and attitude: quiet, not late, and true in the end."""

from __future__ import annotations

import math

import numpy as np
import pytest
from symbolic_block import Block

from ibvs_qp.estimation.roll_pitch import UNFILTERED_HZ, filtered_roll_pitch

TICK, HZ = 0.004, 12.0


def block(bandwidth_hz: float = HZ) -> Block:
    def build(signals):
        angles, rates = signals.input("angles", 2), signals.input("rates", 2)
        return filtered_roll_pitch(signals, angles, rates, bandwidth_hz, signals.input("dt"))

    return Block(build)


def test_the_first_estimate_counts_in_full() -> None:
    np.testing.assert_allclose(block()(angles=[0.1, -0.2], rates=[1.0, 1.0]), [0.1, -0.2])


def test_noise_of_the_attitude_falls_and_a_rotation_is_not_late() -> None:
    """A low-pass of this bandwidth would be 13 ms late."""
    rng, estimate, found, true = np.random.default_rng(0), block(), [], []
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
    estimate = block()
    for _ in range(1000):
        found = estimate(angles=[0.0, 0.0], rates=[0.01, -0.01])
    gain = 1.0 - math.exp(-2.0 * math.pi * HZ * TICK)
    np.testing.assert_allclose(found, np.array([1.0, -1.0]) * 0.01 * TICK * (1.0 - gain) / gain, rtol=1e-6)


def test_at_the_largest_bandwidth_the_attitude_is_taken_as_it_is() -> None:
    estimate = block(UNFILTERED_HZ)
    for _ in range(3):
        np.testing.assert_array_equal(estimate(angles=[0.03, 0.01], rates=[5.0, -5.0]), [0.03, 0.01])
