"""Broken raw sensors: each is named and replaced by its last accepted value before a filter reads it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ibvs_qp.measurement import FeatureFrame, SensorFrame
from ibvs_qp.validation.sensor_frame import SensorGate

TICK_NS = 4_000_000
GOOD: dict[str, np.ndarray] = {
    "attitude": np.array([0.6, 0.0, 0.0, 0.8]),
    "angular_velocity": np.array([0.1, 0.2, 0.3]),
    "specific_force": np.array([0.0, 1.0, -9.0]),
    "wrench": np.arange(6.0),
}


def frame(tick: int, **changes: Any) -> SensorFrame:
    stamps = {"stamp_ns": tick * TICK_NS, "wrench_stamp_ns": tick * TICK_NS - 1000}
    return SensorFrame(**(stamps | GOOD | changes))  # type: ignore[arg-type]


@pytest.mark.parametrize("name", GOOD)
@pytest.mark.parametrize("seen_before", [True, False])
def test_a_broken_vector_is_replaced_by_the_last_accepted_one(name: str, seen_before: bool) -> None:
    size = len(GOOD[name])
    for bad in (None, "x", [0.0] * size, np.zeros(size + 1), np.full(size, np.nan), np.full(size, 1e4), 1.0):
        gate = SensorGate()
        default = np.array(gate.last[name])
        if seen_before:
            gate.check(frame(1))
        checked, rejected = gate.check(frame(2, **{name: bad}))
        assert rejected[0] == f"sensor {name}: not sound" and checked is not None
        expected = GOOD[name] if seen_before else default
        np.testing.assert_array_equal(getattr(checked, name), expected)
        assert gate.last[name] == expected.tolist()


def test_a_good_frame_passes_unchanged() -> None:
    good = frame(1, features=FeatureFrame(lines=(), plane=None, stamp_ns=3))
    checked, rejected = SensorGate().check(good)
    assert checked is good and rejected == ()


def test_an_old_wrench_keeps_its_stamp() -> None:
    gate = SensorGate()
    gate.check(frame(1))
    for changes in ({"wrench": np.full(6, np.nan)}, {"wrench_stamp_ns": 10**15}, {"wrench_stamp_ns": None}):
        checked, rejected = gate.check(frame(2, **changes))
        assert checked is not None and rejected[-1] == "sensor wrench_stamp_ns: not sound"
        assert checked.wrench_stamp_ns == TICK_NS - 1000
        gate.clock.last_ns = TICK_NS  # the next frame comes at the same time


def test_features_without_a_stamp_are_dropped_and_the_others_follow_a_clock_set_back() -> None:
    gate = SensorGate()
    features = FeatureFrame(lines=(), plane=None, stamp_ns=-1)
    checked, rejected = gate.check(frame(1000, features=features))
    assert checked is not None and checked.features is None and rejected == ("sensor features: not sound",)
    for tick in range(10, 40):
        now = tick * TICK_NS
        checked, _ = gate.check(frame(tick, features=replace(features, stamp_ns=now - 5, velocity_stamp_ns=now - 7)))
    assert checked is not None and checked.features is not None
    assert checked.stamp_ns == (1000 + 30) * TICK_NS
    assert checked.stamp_ns - checked.features.stamp_ns == 5
    assert checked.stamp_ns - checked.features.velocity_stamp_ns == 7
    assert checked.stamp_ns - checked.wrench_stamp_ns == 1000
