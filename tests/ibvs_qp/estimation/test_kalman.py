"""The filter for late measurements: exact propagation, the right sample in time, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.estimation.kalman import HISTORY, DelayedKalman

TICK, GATE = 0.004, 6.0
TICK_NS = 4_000_000
CHAIN = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])  # distance, speed, bias


def new_filter() -> DelayedKalman:
    return DelayedKalman(CHAIN, np.array([1e-10, 1e-6, 1e-7]), np.array([0.1, 0.1, 0.1]), TICK, GATE)


def advance(f: DelayedKalman, stamp_ns: int, increment: np.ndarray, dt: float) -> None:
    f.remember(stamp_ns, f.state + dt * (f.chain @ f.state) + increment, dt)


def test_a_late_correction_equals_the_replay_of_every_input() -> None:
    """Correcting at the capture and running all inputs again gives the same state as the one vector product."""
    rng = np.random.default_rng(0)
    inputs = rng.normal(0.0, 0.01, (60, 3))
    for age in (0, 1, 7, 25):
        late, replay = new_filter(), new_filter()
        for k in range(60):
            advance(late, k * TICK_NS, inputs[k], TICK)
            if k in (5, 15, 25):  # so that distance, speed and bias are correlated
                late.correct_entry(k * TICK_NS, 0, 0.01, 1e-4, 1e6)
        for k in range(60):
            advance(replay, k * TICK_NS, inputs[k], TICK)
            if k in (5, 15, 25):
                replay.correct_entry(k * TICK_NS, 0, 0.01, 1e-4, 1e6)
            if k == 59 - age:
                assert replay.correct_entry(k * TICK_NS, 0, 0.02, 1e-4, 1e6)
        assert late.correct_entry((59 - age) * TICK_NS, 0, 0.02, 1e-4, 1e6)
        np.testing.assert_allclose(late.state, replay.state, atol=1e-12)
        np.testing.assert_allclose(late.covariance, replay.covariance, atol=1e-12)
        np.testing.assert_allclose(late.at(59 * TICK_NS), late.state)


@pytest.mark.parametrize("latency", [0, 15, 25])
def test_converges_without_lag_whatever_the_latency(latency: int) -> None:
    """Constant acceleration with a biased accelerometer: distance, speed and bias are those of now."""
    rng, f = np.random.default_rng(1), new_filter()
    bias, acceleration, distances = 0.05, 0.02, []
    distance, speed = 0.5, 0.0
    for k in range(2500):
        advance(f, k * TICK_NS, np.array([0.0, TICK * (acceleration + bias), 0.0]), TICK)
        distance, speed = distance - TICK * speed, speed + TICK * acceleration
        distances.append(distance)
        if k % 8 == 0 and k >= latency:
            seen = distances[k - latency] + rng.normal(0.0, 1e-3)
            assert f.correct_entry((k - latency) * TICK_NS, 0, seen, 1e-6)
    assert (np.abs(f.state - [distance, speed, bias]) < [1e-3, 4e-3, 4e-3]).all()


def test_stamps_out_of_the_history_are_refused_and_change_nothing() -> None:
    f = new_filter()
    assert not f.correct_entry(0, 0, 1.0, 1.0)  # nothing predicted yet
    for k in range(HISTORY + 20):
        advance(f, k * TICK_NS, np.zeros(3), TICK)
    before = f.state.copy()
    newest = (HISTORY + 19) * TICK_NS
    for stamp in (newest - HISTORY * TICK_NS, newest + 10 * TICK_NS):
        assert not f.correct_entry(stamp, 0, 1.0, 1.0)
    np.testing.assert_array_equal(f.state, before)
    assert f.at(newest - HISTORY * TICK_NS) is None


def test_outliers_are_refused_by_their_own_spread() -> None:
    f = new_filter()
    for k in range(50):
        advance(f, k * TICK_NS, np.zeros(3), TICK)
        f.correct_entry(k * TICK_NS, 0, 0.0, 1e-6)
    state = f.state.copy()
    assert not f.correct_entry(49 * TICK_NS, 0, 0.1, 1e-6)
    np.testing.assert_array_equal(f.state, state)
    assert f.correct_entry(49 * TICK_NS, 0, 0.1, 1.0)  # an honest variance is heard


def test_a_late_new_entry_follows_the_remembered_motion_of_the_others() -> None:
    """A line seen 80 ms ago at speed enters where it is now, not where it was."""
    chain = np.zeros((3, 3))
    chain[1, 0] = 1.0  # odometer of a constant speed; entry 2 is the line, which the chain does not move yet
    f = DelayedKalman(chain, np.full(3, 1e-8), np.array([0.1, 0.1, 0.1]), TICK, GATE)
    f.state[0] = 0.1
    for k in range(100):
        advance(f, k * TICK_NS, np.zeros(3), TICK)
    f.set_path(2, 0.30, 79 * TICK_NS, np.array([0.0, -1.0, 0.0]), 1e-3)
    assert f.state[2] == pytest.approx(0.30 - 0.1 * 20 * TICK, abs=1e-12)
    past = f.at(79 * TICK_NS)
    assert past is not None and past[2] == pytest.approx(0.30, abs=1e-12)
    f.chain[2, 0] = -1.0
    assert f.correct_entry(85 * TICK_NS, 2, 0.30 - 0.1 * 6 * TICK, 1e-8, gate=1.0)


def test_covariance_stays_symmetric_and_positive() -> None:
    rng, f = np.random.default_rng(3), new_filter()
    for k in range(3000):
        advance(f, k * TICK_NS, rng.normal(0.0, 0.001, 3), TICK)
        if k % 8 == 0:
            f.correct_entry((k - 15) * TICK_NS, 0, rng.normal(0, 1e-3), 1e-6, 1e9)
    np.testing.assert_allclose(f.covariance, f.covariance.T, rtol=1e-12)
    assert np.linalg.eigvalsh(f.covariance).min() > 0


@pytest.mark.parametrize("entries", [[1], [0, 1]])
def test_a_correction_is_the_textbook_one(entries: list[int]) -> None:
    """State and covariance against the matrix equations, with correlated noise."""
    rng, f, rows = np.random.default_rng(4), new_filter(), np.eye(3)[entries]
    noise = np.array([[4e-5, 1e-5], [1e-5, 2e-5]])[: len(entries), : len(entries)]

    def correct(stamp: int, values: np.ndarray, gate: float | None = None) -> bool:
        if len(entries) == 1:
            return f.correct_entry(stamp, entries[0], float(values[0]), float(noise[0, 0]), gate)
        return f.correct_pair(stamp, entries[0], values, noise, gate)

    for k in range(HISTORY + 10):
        advance(f, k * TICK_NS, rng.normal(0.0, 0.01, 3), TICK)
        if k % 8 == 0:
            last = k * TICK_NS
            f.correct_entry(last, 2, 0.0, 1e9)  # brings the covariance to this stamp and changes next to nothing
            past, before, values = f.state.copy(), f.covariance.copy(), rng.normal(0.0, 0.02, len(entries))
            gain = before @ rows.T @ np.linalg.inv(rows @ before @ rows.T + noise)
            assert correct(last, values, 1e3)
            np.testing.assert_allclose(f.state, past + gain @ (values - past[entries]), atol=1e-12)
            np.testing.assert_allclose(f.covariance, before - gain @ rows @ before, atol=1e-12)
    assert not correct(last, np.full(len(entries), 9.0))
