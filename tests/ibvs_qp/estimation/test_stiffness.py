"""Stiffness of brush and wall from synthetic presses."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ibvs_qp.config import ContactSettings
from ibvs_qp.estimation.stiffness import StiffnessEstimator

SETTINGS = ContactSettings()
ASSUMED = SETTINGS.estimation.assumed_stiffness_n_m


def press(stiffness: float, seed: int = 0, peak: float = 5.0) -> StiffnessEstimator:
    """A push that rises over a second; filtered as the contact estimator filters it, seen with millimetre noise."""
    rng, estimator = np.random.default_rng(seed), StiffnessEstimator(SETTINGS)
    gain = 1.0 - math.exp(-2.0 * math.pi * SETTINGS.force_filter_hz * 0.01)
    push = 0.0
    for k in range(300):
        force = peak * min(1.0, 0.01 * k)
        push += gain * (force + rng.normal(0.0, 0.2) - push)
        estimator.add(push, force / stiffness + rng.normal(0.0, 2e-4), 0.01)
    return estimator


@pytest.mark.parametrize("stiffness", [800.0, 1500.0, 3000.0, 6000.0])
def test_stiffness_of_a_press(stiffness: float) -> None:
    values = [press(stiffness, seed).value for seed in range(10)]
    print(f"{stiffness:.0f} N/m: found {np.mean(values):.0f} +- {np.std(values):.0f}")
    assert np.mean(values) == pytest.approx(stiffness, rel=0.15)


def test_stiffness_unknown_is_assumed_stiff_and_a_poke_teaches_nothing() -> None:
    assert StiffnessEstimator(SETTINGS).value == ASSUMED
    poke = press(2000.0, peak=0.5)
    assert not poke.known and poke.value == ASSUMED
    backwards = StiffnessEstimator(SETTINGS)
    for k in range(200):
        backwards.add(0.03 * k, -1e-5 * k, 0.01)  # a push that grows as the tip recedes is no spring
    assert not backwards.known


def test_stiffness_stays_in_its_range_and_survives_a_new_touch() -> None:
    rigid = press(1e7)
    assert rigid.value <= SETTINGS.estimation.stiffness_max_n_m
    known = press(1500.0)
    value = known.value
    known.start()
    assert known.known and known.value == value
    for _ in range(1000):  # long after the touch nothing counts any more
        known.add(5.0, 0.5, 0.01)
    assert known.value == value
