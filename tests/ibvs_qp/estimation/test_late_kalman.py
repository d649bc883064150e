"""Late corrections against the filter that keeps every state."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from symbolic_block import Block

from ibvs_qp.estimation.kalman import DelayedKalman
from ibvs_qp.estimation.late_kalman import CHAIN, LateKalman

TICK_S, TICK_NS = 0.004, 4_000_000
INITIAL, NOISE, GATE = (0.05, 0.05, 0.1), (1e-10, 4e-5, 2e-5), 6.0


def late_filter() -> Block:
    """A filter whose distance is corrected: change of the state now, variances, and whether within the gate, (7,)."""

    def build(signals):
        new, age, innovation = signals.input("new"), signals.input("age"), signals.input("innovation")
        kalman = LateKalman(signals, INITIAL, signals.input("elapsed"))
        kalman.noise = NOISE
        kalman.go_to(new, age)
        within = kalman.within(0, innovation, 1e-6, GATE)
        _, now = kalman.correct(ca.logic_and(new, within), 0, innovation, 1e-6, age)
        kalman.store()
        return ca.vertcat(now, *(kalman.variance(index) for index in range(3)), within)

    return Block(build)


@pytest.mark.parametrize("latency", [0, 5, 15, 40])
def test_corrections_equal_those_of_the_filter_with_all_states(latency):
    rng, block = np.random.default_rng(0), late_filter()
    whole = DelayedKalman(CHAIN, np.array(NOISE), np.array(INITIAL), TICK_S, GATE)
    state = np.zeros(3)
    for tick in range(400):
        stamp = (tick + 1) * TICK_NS
        state = state + TICK_S * CHAIN @ state + 0.5 * TICK_S**2 * CHAIN @ CHAIN @ state
        whole.remember(stamp, state, TICK_S)
        due = tick % 8 == 0 and tick > latency + 8
        past, innovation = whole.at(stamp - latency * TICK_NS), rng.normal(0.0, 2e-3)
        before = whole.state.copy()
        if due:
            whole.correct_entry(stamp - latency * TICK_NS, 0, past[0] + innovation, 1e-6)
        found = block(elapsed=TICK_S, new=float(due), age=latency * TICK_S, innovation=innovation)
        # The sums over ticks in the other filter's growth are half a tick short of the integral.
        assert found[:3] == pytest.approx(whole.state - before, rel=0.02, abs=1e-6)
        for index in range(3):
            assert found[3 + index] == pytest.approx(whole.variance(index, stamp), rel=1e-9)
        state = whole.state.copy()
    assert found[3] < 1e-6


def test_an_innovation_beyond_the_gate_changes_nothing():
    block = late_filter()
    found = block(elapsed=TICK_S, new=1.0, age=0.0, innovation=1.0)
    assert not found[6] and not found[:3].any()


def test_an_entry_that_is_set_is_uncorrelated():
    def build(signals):
        kalman = LateKalman(signals, INITIAL, signals.input("elapsed"))
        kalman.correct(ca.SX(1.0), 0, ca.SX(0.01), 1e-6, ca.SX(0.1))
        kalman.set_entry(ca.SX(1.0), 1, 0.5)
        kalman.store()
        return ca.reshape(signals.next_state("wall.covariance"), 9, 1)

    covariance = Block(build)(elapsed=TICK_S).reshape(3, 3)
    assert covariance[1] == pytest.approx([0.0, 0.25, 0.0]) and covariance[:, 1] == pytest.approx([0.0, 0.25, 0.0])
