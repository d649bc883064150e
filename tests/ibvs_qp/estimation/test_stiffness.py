"""Stiffness of brush and wall from synthetic presses."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
from symbolic_block import Block

from ibvs_qp.config import ContactSettings
from ibvs_qp.estimation.stiffness import stiffness

SETTINGS = ContactSettings()
ASSUMED = SETTINGS.estimation.assumed_stiffness_n_m


class Estimator:
    """The estimate over force samples at 100 Hz."""

    def __init__(self) -> None:
        names = ("push", "penetration", "interval", "touched")
        self._block = Block(
            lambda signals: ca.vertcat(*stiffness(signals, SETTINGS, *(signals.input(name) for name in names)))
        )
        self._update(interval=0.0)

    def _update(self, **inputs: float) -> None:
        value, known = self._block(**inputs)
        self.value, self.known = float(value), bool(known)

    def add(self, push: float, penetration: float) -> None:
        self._update(push=push, penetration=penetration, interval=0.01, touched=0.0)

    def touch(self) -> None:
        self._update(interval=0.0, touched=1.0)


def press(k_wall: float, seed: int = 0, peak: float = 5.0) -> Estimator:
    """A push that rises over a second; filtered as the contact estimator filters it, seen with millimetre noise."""
    rng, estimator = np.random.default_rng(seed), Estimator()
    gain = 1.0 - math.exp(-2.0 * math.pi * SETTINGS.force_filter_hz * 0.01)
    push = 0.0
    for k in range(300):
        force = peak * min(1.0, 0.01 * k)
        push += gain * (force + rng.normal(0.0, 0.2) - push)
        estimator.add(push, force / k_wall + rng.normal(0.0, 2e-4))
    return estimator


@pytest.mark.parametrize("k_wall", [800.0, 1500.0, 3000.0, 6000.0])
def test_stiffness_of_a_press(k_wall: float) -> None:
    values = [press(k_wall, seed).value for seed in range(10)]
    print(f"{k_wall:.0f} N/m: found {np.mean(values):.0f} +- {np.std(values):.0f}")
    assert np.mean(values) == pytest.approx(k_wall, rel=0.15)


def test_stiffness_unknown_is_assumed_stiff_and_a_poke_teaches_nothing() -> None:
    assert Estimator().value == ASSUMED
    poke = press(2000.0, peak=0.5)
    assert not poke.known and poke.value == ASSUMED
    backwards = Estimator()
    for k in range(200):
        backwards.add(0.03 * k, -1e-5 * k)  # a push that grows as the tip recedes is no spring
    assert not backwards.known


def test_stiffness_stays_in_its_range_and_survives_a_new_touch() -> None:
    rigid = press(1e7)
    assert rigid.value <= SETTINGS.estimation.stiffness_max_n_m
    known = press(1500.0)
    value = known.value
    known.touch()
    assert known.known and known.value == value
    for _ in range(1000):  # long after the touch nothing counts any more
        known.add(5.0, 0.5)
    assert known.value == value
