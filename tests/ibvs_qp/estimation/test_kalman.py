"""Late corrections: exact propagation, the textbook's gain, gates, entries that are set."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from symbolic_block import Block

from ibvs_qp.estimation.kalman import LateKalman

TICK, GATE, RNG = 0.004, 6.0, np.random.default_rng
CHAIN = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])  # distance, speed, bias
INITIAL, NOISE = (0.05, 0.05, 0.1), (1e-10, 4e-5, 2e-5)
NEVER, ALWAYS = ca.SX(0.0), ca.SX(1.0)


def distance_filter() -> Block:
    """Corrected in its first entry: change at the capture and now, variances now, whether within the gate, (10,)."""

    def build(signals):
        new, age, innovation = signals.input("new"), signals.input("age"), signals.input("innovation")
        variance = signals.input("variance")
        kalman = LateKalman(signals, "f", CHAIN, INITIAL, signals.input("elapsed"))
        kalman.noise = NOISE
        kalman.go_to(new, age)
        within = kalman.within(0, innovation, variance, GATE)
        change = kalman.correct(ca.logic_and(new, within), 0, innovation, variance)
        first, second = kalman.growth(change)
        kalman.store()
        now = change + age * first + 0.5 * age**2 * second
        return ca.vertcat(change, now, *(kalman.variance(index) for index in range(3)), within)

    return Block(build)


def covariance(block: Block) -> np.ndarray:
    found = np.zeros((3, 3))
    found.T[np.triu_indices(3)] = block.step.states["f.covariance"]
    return found + np.tril(found, -1).T


def moved(seconds: float) -> np.ndarray:
    return np.eye(3) + seconds * CHAIN + 0.5 * seconds**2 * CHAIN @ CHAIN


@pytest.mark.parametrize("latency", [0, 5, 15, 40])
def test_late_corrections_are_those_of_the_textbook_carried_to_now(latency: int) -> None:
    rng, block, expected, corrected = RNG(0), distance_filter(), np.diag(np.square(INITIAL)), None
    for tick in range(400):
        due = tick % 8 == 0 and tick > latency + 8
        innovation = rng.normal(0.0, 2e-3)
        found = block(elapsed=TICK, new=due, age=latency * TICK, innovation=innovation, variance=1e-6)
        if due:
            if corrected is not None:
                since = (tick - latency - corrected) * TICK
                expected = moved(since) @ expected @ moved(since).T + since * np.diag(NOISE)
            corrected = tick - latency
            gain = expected[:, 0] / (expected[0, 0] + 1e-6)
            np.testing.assert_allclose(found[:3], gain * innovation, rtol=1e-9)
            np.testing.assert_allclose(found[3:6], moved(latency * TICK) @ gain * innovation, rtol=1e-9)
            expected = expected - np.outer(gain, expected[0])
            np.testing.assert_allclose(covariance(block), expected, rtol=1e-8, atol=1e-18)
        else:
            assert not found[:6].any()
    assert found[6] < 1e-6 and np.linalg.eigvalsh(expected).min() > 0.0


@pytest.mark.parametrize(
    ("innovation", "variance", "passes"), [(1.0, 1e-6, False), (1.0, 1.0, True), (0.1, 1e-6, True)]
)
def test_an_innovation_beyond_the_gate_changes_nothing(innovation: float, variance: float, passes: bool) -> None:
    block = distance_filter()
    found = block(elapsed=TICK, new=1.0, age=0.0, innovation=innovation, variance=variance)
    assert bool(found[9]) is passes and bool(found[:6].any()) is passes
    assert (covariance(block)[0, 0] == pytest.approx(INITIAL[0] ** 2)) is not passes


@pytest.mark.parametrize(("innovation", "passes"), [((0.02, -0.01), True), ((0.02, 9.0), False)])
def test_two_entries_with_correlated_noise(innovation: tuple[float, float], passes: bool) -> None:
    noise = np.array([[4e-5, 1e-5], [1e-5, 2e-5]])

    def build(signals):
        kalman = LateKalman(signals, "f", CHAIN, INITIAL, ca.SX(0.0))
        kalman.correct(ALWAYS, 2, ca.SX(0.0), 1e-3)
        kalman.go_to(ALWAYS, ca.SX(0.0))
        accepted, change = kalman.correct_first_two(ALWAYS, signals.input("seen", 2), ca.DM(noise), GATE)
        kalman.store()
        return ca.vertcat(accepted, change)

    block, rows = Block(build), np.eye(3)[:2]
    before = np.diag(np.square(INITIAL))
    before[2, 2] *= 1e-3 / (before[2, 2] + 1e-3)
    accepted, *change = block(seen=innovation)
    gain = before @ rows.T @ np.linalg.inv(rows @ before @ rows.T + noise) * passes
    assert bool(accepted) is passes
    np.testing.assert_allclose(change, gain @ innovation, atol=1e-15)
    np.testing.assert_allclose(covariance(block), before - gain @ rows @ before, atol=1e-15)


@pytest.mark.parametrize("entry", [1, ca.SX(ca.DM([0.0, 1.0, 0.0]))])
def test_an_entry_that_is_set_is_uncorrelated(entry: int | ca.SX) -> None:
    def build(signals):
        kalman = LateKalman(signals, "f", CHAIN, INITIAL, ca.SX(0.0))
        kalman.correct(ALWAYS, 0, ca.SX(0.01), 1e-6)
        kalman.set_entry(NEVER, entry, 0.7)
        kalman.set_entry(ALWAYS, entry, 0.5)
        kalman.store()
        return ca.SX(0.0)

    block = Block(build)
    block()
    found = covariance(block)
    np.testing.assert_allclose(found[1], [0.0, 0.25, 0.0])
    np.testing.assert_allclose(
        found[[0, 2], [0, 2]], [INITIAL[0] ** 2 * 1e-6 / (INITIAL[0] ** 2 + 1e-6), INITIAL[2] ** 2]
    )
