"""Stiffness and friction of brush and wall from synthetic presses and strokes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ibvs_qp.estimation.surface import ASSUMED_FRICTION, ASSUMED_STIFFNESS, FrictionEstimator, StiffnessEstimator


def press(stiffness: float, seed: int = 0, peak: float = 5.0) -> StiffnessEstimator:
    """A push that rises over a second; filtered as the contact estimator filters it, seen with millimetre noise."""
    rng, estimator = np.random.default_rng(seed), StiffnessEstimator()
    share = 1.0 - math.exp(-2.0 * math.pi * 8.0 * 0.01)
    push = 0.0
    for k in range(300):
        force = peak * min(1.0, 0.01 * k)
        push += share * (force + rng.normal(0.0, 0.2) - push)
        estimator.add(push, force / stiffness + rng.normal(0.0, 2e-4), 0.01)
    return estimator


@pytest.mark.parametrize("stiffness", [800.0, 1500.0, 3000.0, 6000.0])
def test_stiffness_of_a_press(stiffness: float) -> None:
    values = [press(stiffness, seed).value for seed in range(10)]
    print(f"{stiffness:.0f} N/m: found {np.mean(values):.0f} +- {np.std(values):.0f}")
    assert np.mean(values) == pytest.approx(stiffness, rel=0.15)


def test_stiffness_unknown_is_assumed_stiff_and_a_poke_teaches_nothing() -> None:
    assert StiffnessEstimator().value == ASSUMED_STIFFNESS
    poke = press(2000.0, peak=0.5)
    assert not poke.known and poke.value == ASSUMED_STIFFNESS
    backwards = StiffnessEstimator()
    for k in range(200):
        backwards.add(0.03 * k, -1e-5 * k, 0.01)  # a push that grows as the tip recedes is no spring
    assert not backwards.known


def test_stiffness_stays_in_its_range_and_survives_a_new_touch() -> None:
    rigid = press(1e7)
    assert rigid.value <= StiffnessEstimator.RANGE[1]
    known = press(1500.0)
    value = known.value
    known.start()
    assert known.known and known.value == value
    for _ in range(1000):  # long after the touch nothing counts any more
        known.add(5.0, 0.5, 0.01)
    assert known.value == value


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.8])
def test_friction_while_sliding(friction: float) -> None:
    rng, estimator = np.random.default_rng(1), FrictionEstimator()
    for _ in range(1500):
        push = 5.0 + rng.normal(0.0, 0.3)
        estimator.add(push, friction * 5.0 + rng.normal(0.0, 0.3), 0.1, 0.004)
    assert estimator.known and estimator.value == pytest.approx(friction, abs=0.03)


def test_friction_learns_nothing_while_stuck_or_barely_touching() -> None:
    estimator = FrictionEstimator()
    for push, speed in ((5.0, 0.0), (5.0, -0.1), (0.5, 0.1), (0.0, 0.1)):
        for _ in range(500):
            estimator.add(push, 4.0, speed, 0.004)
    assert not estimator.known and estimator.value == ASSUMED_FRICTION


def test_friction_stays_plausible() -> None:
    estimator = FrictionEstimator()
    for _ in range(3000):
        estimator.add(2.0, 50.0, 0.1, 0.004)
    assert estimator.value <= FrictionEstimator.RANGE[1]
    for _ in range(3000):
        estimator.add(2.0, -50.0, 0.1, 0.004)
    assert estimator.value >= FrictionEstimator.RANGE[0]
