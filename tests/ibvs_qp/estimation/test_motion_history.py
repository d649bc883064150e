"""Integrals of the motion since a past time."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from symbolic_block import Block

from ibvs_qp.estimation.motion_history import BIN_S, BINS, MotionHistory

TICK_S = 0.004


def history() -> Block:
    """Duration, angle and change of velocity since ``age``, and whether that is remembered, (8,)."""

    def build(signals):
        inputs = signals.input("elapsed"), signals.input("rate", 3), signals.input("acceleration", 3)
        kept, age = MotionHistory(signals, *inputs, TICK_S), signals.input("age")
        total = ca.SX.zeros(7)
        for part in kept.since(age):
            total += ca.vertcat(part.duration, part.angle, part.change)
        return ca.vertcat(total, kept.covers(age))

    return Block(build)


@given(
    age=st.floats(0.0, 0.3),
    ticks=st.lists(st.sampled_from([0.002, 0.004, 0.004, 0.008, 0.02]), min_size=200, max_size=220),
    hertz=st.floats(0.0, 3.0),
)
@example(age=0.3, ticks=[0.002] * 200, hertz=0.0)
@example(age=0.3, ticks=[0.002, 0.02] * 100, hertz=0.0)
@settings(max_examples=10, deadline=None)
def test_a_smooth_motion_is_integrated_to_the_age_asked_for(age, ticks, hertz):
    block, times, now = history(), [], 0.0
    rate, acceleration = np.array([0.3, -0.2, 0.5]), np.array([1.0, 0.5, -2.0])
    for step in ticks:
        now += step
        wave = np.cos(2.0 * np.pi * hertz * (now - 0.5 * step))
        found = block(elapsed=step, rate=rate * wave, acceleration=acceleration * wave, age=age)
        times.append(now)
    fine = np.linspace(now - age, now, 2001)
    integral = np.trapezoid(np.cos(2.0 * np.pi * hertz * fine), fine)
    # Within a bin the motion counts as steady: a wave of 3 Hz differs by its change over half a bin.
    slack = 1e-9 + 2.0 * np.pi * hertz * 0.02**2
    assert found[0] == pytest.approx(age, abs=1e-12)
    assert found[1:4] == pytest.approx(rate * integral, abs=slack * 0.5)
    assert found[4:7] == pytest.approx(acceleration * integral, abs=slack * 2.0)
    assert found[7]


def test_what_lies_before_the_oldest_bin_is_not_covered():
    block = history()
    for _ in range(4 * BINS + 20):
        covered = block(elapsed=TICK_S, rate=0.0, acceleration=0.0, age=BINS * BIN_S - 0.02)[7]
    assert covered
    assert not block(elapsed=TICK_S, rate=0.0, acceleration=0.0, age=BINS * BIN_S + 0.02)[7]


@pytest.mark.parametrize(("age", "covered"), [(-0.005, True), (-0.007, False), (0.009, True), (0.011, False)])
def test_a_stamp_may_lie_a_little_outside(age, covered):
    block = history()
    for _ in range(2):
        found = block(elapsed=TICK_S, rate=0.0, acceleration=0.0, age=age)
    assert bool(found[7]) == covered
