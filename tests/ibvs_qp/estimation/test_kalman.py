"""The filter for late measurements: exact propagation, the right sample in time, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.estimation.kalman import HISTORY, DelayedKalman
from ibvs_qp.model.shared_library import compiler

TICK = 0.004
TICK_NS = 4_000_000
CHAIN = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])  # distance, speed, bias


def new_filter() -> DelayedKalman:
    return DelayedKalman(CHAIN, np.array([1e-10, 1e-6, 1e-7]), np.array([0.1, 0.1, 0.1]), TICK)


def test_a_late_correction_equals_the_replay_of_every_input() -> None:
    """Correcting at the capture and running all inputs again gives the same state as the one vector product."""
    rng = np.random.default_rng(0)
    inputs = rng.normal(0.0, 0.01, (60, 3))
    for age in (0, 1, 7, 25):
        late, replay = new_filter(), new_filter()
        for k in range(60):
            late.predict(k * TICK_NS, inputs[k], TICK)
            if k in (5, 15, 25):  # so that distance, speed and bias are correlated
                late.correct(k * TICK_NS, np.eye(3)[:1], np.array([0.01]), np.array([[1e-4]]), 1e6)
        for k in range(60):
            replay.predict(k * TICK_NS, inputs[k], TICK)
            if k in (5, 15, 25):
                replay.correct(k * TICK_NS, np.eye(3)[:1], np.array([0.01]), np.array([[1e-4]]), 1e6)
            if k == 59 - age:
                assert replay.correct(k * TICK_NS, np.eye(3)[:1], np.array([0.02]), np.array([[1e-4]]), 1e6)
        assert late.correct((59 - age) * TICK_NS, np.eye(3)[:1], np.array([0.02]), np.array([[1e-4]]), 1e6)
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
        f.predict(k * TICK_NS, np.array([0.0, TICK * (acceleration + bias), 0.0]), TICK)
        distance, speed = distance - TICK * speed, speed + TICK * acceleration
        distances.append(distance)
        if k % 8 == 0 and k >= latency:
            seen = distances[k - latency] + rng.normal(0.0, 1e-3)
            assert f.correct((k - latency) * TICK_NS, np.eye(3)[:1], np.array([seen]), np.array([[1e-6]]))
    assert (np.abs(f.state - [distance, speed, bias]) < [1e-3, 4e-3, 4e-3]).all()


def test_stamps_out_of_the_history_are_refused_and_change_nothing() -> None:
    f = new_filter()
    assert not f.correct(0, np.eye(3)[:1], np.array([1.0]), np.array([[1.0]]))  # nothing predicted yet
    for k in range(HISTORY + 20):
        f.predict(k * TICK_NS, np.zeros(3), TICK)
    before = f.state.copy()
    newest = (HISTORY + 19) * TICK_NS
    for stamp in (newest - HISTORY * TICK_NS, newest + 10 * TICK_NS):
        assert not f.correct(stamp, np.eye(3)[:1], np.array([1.0]), np.array([[1.0]]))
    np.testing.assert_array_equal(f.state, before)
    assert f.at(newest - HISTORY * TICK_NS) is None


def test_outliers_are_refused_by_their_own_spread() -> None:
    f = new_filter()
    for k in range(50):
        f.predict(k * TICK_NS, np.zeros(3), TICK)
        f.correct(k * TICK_NS, np.eye(3)[:1], np.array([0.0]), np.array([[1e-6]]))
    state = f.state.copy()
    assert not f.correct(49 * TICK_NS, np.eye(3)[:1], np.array([0.1]), np.array([[1e-6]]))
    np.testing.assert_array_equal(f.state, state)
    assert f.correct(49 * TICK_NS, np.eye(3)[:1], np.array([0.1]), np.array([[1.0]]))  # an honest variance is heard


def test_a_late_new_entry_follows_the_remembered_motion_of_the_others() -> None:
    """A line seen 80 ms ago at speed enters where it is now, not where it was."""
    chain = np.zeros((3, 3))
    chain[1, 0] = 1.0  # odometer of a constant speed; entry 2 is the line, which the chain does not move yet
    f = DelayedKalman(chain, np.full(3, 1e-8), np.array([0.1, 0.1, 0.1]), TICK)
    f.state[0] = 0.1
    for k in range(100):
        f.predict(k * TICK_NS, np.zeros(3), TICK)
    f.set_path(2, 0.30, 79 * TICK_NS, np.array([0.0, -1.0, 0.0]), 1e-3)
    assert f.state[2] == pytest.approx(0.30 - 0.1 * 20 * TICK, abs=1e-12)
    past = f.at(79 * TICK_NS)
    assert past is not None and past[2] == pytest.approx(0.30, abs=1e-12)
    f.chain[2, 0] = -1.0
    assert f.correct(85 * TICK_NS, np.eye(3)[2:], np.array([0.30 - 0.1 * 6 * TICK]), np.array([[1e-8]]), gate=1.0)


def test_covariance_stays_symmetric_and_positive() -> None:
    rng, f = np.random.default_rng(3), new_filter()
    for k in range(3000):
        f.predict(k * TICK_NS, rng.normal(0.0, 0.001, 3), TICK)
        if k % 8 == 0:
            f.correct((k - 15) * TICK_NS, np.eye(3)[:1], np.array([rng.normal(0, 1e-3)]), np.array([[1e-6]]), 1e9)
    np.testing.assert_array_equal(f.covariance, f.covariance.T)
    assert np.linalg.eigvalsh(f.covariance).min() > 0


@pytest.mark.parametrize("entries", [(1,), (0, 1)])
def test_measured_entries_correct_like_the_rows_they_stand_for(entries: tuple[int, ...]) -> None:
    """The scalar and the paired form against the linear system, with correlated noise and across the ring's seam."""
    rng = np.random.default_rng(4)
    short, general = new_filter(), new_filter()
    for k in range(HISTORY + 10):
        inputs = rng.normal(0.0, 0.01, 3)
        for f in (short, general):
            f.predict(k * TICK_NS, inputs, TICK)
        if k % 8 or k < 20:
            continue
        stamp, values = (k - 15) * TICK_NS, rng.normal(0.0, 0.02, len(entries))
        covariance = np.array([[4e-5, 1e-5], [1e-5, 2e-5]])[: len(entries), : len(entries)]
        taken = general.correct(stamp, np.eye(3)[list(entries)], values, covariance)
        if len(entries) == 1:
            assert short.correct_entry(stamp, entries[0], values[0], covariance[0, 0]) == taken
        else:
            a, b = values.tolist()
            assert short.correct_pair(stamp, 0, (a, b), (4e-5, 1e-5, 2e-5)) == taken
        np.testing.assert_allclose(short.state, general.state, atol=1e-13)
        np.testing.assert_allclose(short.covariance, general.covariance, atol=1e-13)
    newest = (HISTORY + 9) * TICK_NS
    if len(entries) == 1:
        assert not short.correct_entry(newest, 0, 9.0, 1e-5)
    else:
        assert not short.correct_pair(newest, 0, (9.0, 9.0), (4e-5, 1e-5, 2e-5))


@pytest.mark.parametrize("latency", [0, 15])
def test_corrections_gathered_at_one_stamp_reach_the_present_like_those_looked_at_one_by_one(latency: int) -> None:
    """Across the ring's seam, with a new entry and a refused one in between."""
    rng = np.random.default_rng(5)
    gathered, watched = new_filter(), new_filter()
    for k in range(HISTORY + 40):
        inputs = rng.normal(0.0, 0.01, 3)
        values = rng.normal(0.0, 0.02, 4).tolist()
        for f in (gathered, watched):
            f.predict(k * TICK_NS, inputs, TICK)
            if k % 8 or k < 20:
                continue
            stamp = (k - latency) * TICK_NS
            for entry, value in enumerate((*values[:2], 9.0)):
                believed = value != 9.0
                assert f.correct_entry(stamp, entry % 2, value, 1e-4, gate=1e3 if believed else 1.0) == believed
                if f is watched:
                    past = f.at(stamp)
                    assert past is not None and f.entry(stamp, entry % 2) == past[entry % 2]
                    f.state  # noqa: B018
            if k % 16 == 0:
                f.set_entry(2, values[2], 0.1)
            assert f.correct_pair(stamp, 0, (values[0], values[3]), (1.0, 0.0, 1.0))
        if k % 8 == 0 and k >= 20:
            assert gathered.entry(stamp, 1) == pytest.approx(watched.entry(stamp, 1), abs=1e-13)
            np.testing.assert_allclose(gathered.state, watched.state, atol=1e-13)
            np.testing.assert_allclose(gathered.covariance, watched.covariance, atol=1e-15)
    np.testing.assert_allclose(gathered._history, watched._history, atol=1e-13)


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_machine_code_of_the_corrections_gives_the_same_bits() -> None:
    states = []
    for way in (False, True):
        rng = np.random.default_rng(6)
        f = DelayedKalman(CHAIN, np.array([1e-10, 1e-6, 1e-7]), np.array([0.1, 0.1, 0.1]), TICK, to_machine_code=way)
        for k in range(100):
            f.predict(k * TICK_NS, rng.normal(0.0, 0.01, 3), TICK)
            if k % 8 == 0 and k > 15:
                f.correct_pair((k - 15) * TICK_NS, 0, (0.01, -0.02), (1e-4, 1e-5, 1e-4))
                f.correct_entry((k - 15) * TICK_NS, 2, 0.01, 1e-4)
        states.append(np.append(f.state, f.covariance))
    np.testing.assert_array_equal(*states)
