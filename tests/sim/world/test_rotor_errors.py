"""Errors of the rotors: stated sizes over rotors, seeds and time, and their place between command and thrust."""

from __future__ import annotations

import numpy as np
import pytest

from sim.world.errors import RotorErrors, WorldErrors
from sim.world.plant import Plant
from sim.world.rotor_errors import ThrustFactors
from sim.world.scene import Scene

TICK_S = 0.004


def factors(ticks: int, seed: int = 0, rotors: int = 6, **errors: float) -> np.ndarray:
    """Factors of every tick and rotor, (ticks, rotors)."""
    model = ThrustFactors(RotorErrors(**errors), rotors, TICK_S, seed)
    return np.array([model.next() for _ in range(ticks)])


def test_gain_and_spread_have_the_stated_size_and_stay():
    found = np.array([factors(3, seed, gain=-0.02, spread=0.03) for seed in range(500)])
    assert np.ptp(found, axis=1).max() == 0.0
    assert found.mean() == pytest.approx(0.98, abs=0.002)
    assert found.std() == pytest.approx(0.98 * 0.03, rel=0.04)


def test_the_battery_sags_steadily():
    found = factors(15_001, sag_per_min=0.01)
    np.testing.assert_allclose(found[[0, 7500, 15_000], 0], [1.0, 0.995, 0.99])


def test_noise_has_the_stated_size_and_correlation_time():
    found = factors(50_000, noise=0.02, noise_time_s=0.05) - 1.0
    assert found.std() == pytest.approx(0.02, rel=0.03)
    lag = int(0.05 / TICK_S)
    decay = np.mean(found[lag:] * found[:-lag]) / np.mean(found**2)
    assert decay == pytest.approx(np.exp(-lag * TICK_S / 0.05), abs=0.03)


def thrusts(errors: RotorErrors, seed: int = 0, ticks: int = 200) -> np.ndarray:
    """True thrusts after a constant command of 10 N [N], (n,)."""
    plant = Plant(Scene(errors=WorldErrors(rotors=errors)), seed=seed)
    for _ in range(ticks):
        plant.step(np.full(6, 10.0))
    return plant.thrusts_actual


def test_the_true_thrust_is_the_commanded_one_times_the_factor():
    np.testing.assert_allclose(thrusts(RotorErrors(gain=-0.05)), 9.5, rtol=1e-3)
    spread = thrusts(RotorErrors(spread=0.02), seed=5)
    np.testing.assert_allclose(spread, 10.0 * factors(1, 5, spread=0.02)[0], rtol=1e-3)


def test_same_seed_same_bits_and_no_errors_no_change():
    errors = RotorErrors(gain=-0.02, spread=0.02, sag_per_min=0.01, noise=0.01)
    np.testing.assert_array_equal(thrusts(errors, 1), thrusts(errors, 1))
    assert (thrusts(errors, 1) != thrusts(errors, 2)).all()
    np.testing.assert_array_equal(factors(100), 1.0)


def test_factors_are_never_negative():
    assert factors(2000, noise=0.3, gain=-0.5).min() >= 0.0
    assert factors(100_000, sag_per_min=0.2)[-1].min() == 0.0
