"""Broken raw sensors: each is named and replaced by its last accepted value before a filter reads it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ibvs_qp.measurement import FeatureFrame, RgbdFrame, SensorFrame
from ibvs_qp.validation.clock import LEAD_NS
from ibvs_qp.validation.sensor_frame import SensorGate

TICK_NS = 4_000_000
LATEST_S = 0.3
GOOD: dict[str, np.ndarray] = {
    "attitude": np.array([0.6, 0.0, 0.0, 0.8]),
    "angular_velocity": np.array([0.1, 0.2, 0.3]),
    "specific_force": np.array([0.0, 1.0, -9.0]),
    "wrench": np.arange(6.0),
}
EMPTY = FeatureFrame(lines=(), plane=None, stamp_ns=3)
MOVING = replace(EMPTY, velocity=np.zeros(3), velocity_covariance=np.eye(3))
PICTURE = RgbdFrame(rgb=np.zeros((1, 1, 3)), depth=np.zeros((1, 1)), intrinsics=(1.0, 1.0, 0.0, 0.0), stamp_ns=3)


def frame(tick: int, **changes: Any) -> SensorFrame:
    stamps = {"stamp_ns": tick * TICK_NS, "wrench_stamp_ns": tick * TICK_NS - 1000}
    return SensorFrame(**(stamps | GOOD | changes))  # type: ignore[arg-type]


def gate() -> SensorGate:
    return SensorGate(LATEST_S)


@pytest.mark.parametrize("name", GOOD)
@pytest.mark.parametrize("seen_before", [True, False])
def test_a_broken_vector_is_replaced_by_the_last_accepted_one(name: str, seen_before: bool) -> None:
    size = len(GOOD[name])
    for bad in (None, "x", [0.0] * (size + 1), np.zeros(size + 1), np.full(size, np.nan), np.full(size, 1e4), 1.0):
        checks = gate()
        default = np.array(checks.last[name])
        if seen_before:
            checks.check(frame(1))
        checked, rejected = checks.check(frame(2, **{name: bad}))
        assert rejected[0].startswith(f"sensor {name}: ") and len(rejected) == 1 and checked is not None
        expected = GOOD[name] if seen_before else default
        np.testing.assert_array_equal(getattr(checked, name), expected)
        assert checks.last[name] == expected.tolist()


def test_a_good_frame_passes_as_a_copy() -> None:
    stamps = {"attitude_stamp_ns": 5, "imu_stamp_ns": TICK_NS + LEAD_NS}
    checked, rejected = gate().check(frame(1, features=EMPTY, **stamps))
    assert checked is not None and rejected == ()
    for name, value in GOOD.items():
        found = getattr(checked, name)
        assert np.array_equal(found, value) and not np.shares_memory(found, value)
    assert checked.features == EMPTY and (checked.attitude_stamp_ns, checked.imu_stamp_ns) == tuple(stamps.values())


def test_an_old_wrench_keeps_its_stamp() -> None:
    checks = gate()
    checks.check(frame(1))
    for tick, changes in enumerate(
        ({"wrench": np.full(6, np.nan)}, {"wrench_stamp_ns": 10**15}, {"wrench_stamp_ns": None})
    ):
        checked, rejected = checks.check(frame(2 + tick, **changes))
        assert checked is not None and [reason.split(":")[0] for reason in rejected] == [
            f"sensor {next(iter(changes))}"
        ]
        assert checked.wrench_stamp_ns == TICK_NS - 1000


@pytest.mark.parametrize("name", ["attitude_stamp_ns", "imu_stamp_ns"])
@pytest.mark.parametrize("stamp", [-1, 1.5, "now", 2 * TICK_NS + LEAD_NS + 1, np.zeros(1)])
def test_in_place_of_a_broken_stamp_of_an_inertial_sensor_the_last_one_counts(name: str, stamp: Any) -> None:
    checks = gate()
    for last in (0, TICK_NS - 5):  # none yet, and the last accepted one: None would mean sampled at the tick
        checked, rejected = checks.check(frame(2, **{name: stamp}))
        assert checked is not None and getattr(checked, name) == last
        assert len(rejected) == 1 and rejected[0].startswith(f"sensor {name}: not a time")
        checks = gate()
        checks.check(frame(1, **{name: TICK_NS - 5}))


def test_everything_follows_a_clock_set_back() -> None:
    checks = gate()
    checked, rejected = checks.check(frame(1000, features=replace(EMPTY, stamp_ns=-1)))
    assert checked is not None and checked.features is None
    assert rejected[0].startswith("sensor features.stamp_ns: not a time") and len(rejected) == 1
    for tick in range(10, 40):
        now = tick * TICK_NS
        stamps = {"attitude_stamp_ns": now - 3, "imu_stamp_ns": now - 4}
        seen = replace(MOVING, stamp_ns=now - 5, velocity_stamp_ns=now - 7)
        checked, _ = checks.check(frame(tick, features=seen, **stamps))
    assert checked is not None and checked.features is not None
    assert checked.stamp_ns == (1000 + 30) * TICK_NS
    assert checked.stamp_ns - checked.features.stamp_ns == 5
    assert checked.stamp_ns - checked.features.velocity_stamp_ns == 7
    assert checked.stamp_ns - checked.wrench_stamp_ns == 1000
    assert checked.attitude_stamp_ns == checked.stamp_ns - 3 and checked.imu_stamp_ns == checked.stamp_ns - 4


def test_stamps_of_numpy_do_not_overflow_when_a_clock_is_set_back() -> None:
    checks = gate()
    for tick in range(2**40, 2**40 + 3):
        checks.check(frame(tick))
    for tick in range(10, 40):
        now = np.int32(tick * TICK_NS)
        stamps = {name: now - np.int32(9) for name in ("wrench_stamp_ns", "attitude_stamp_ns", "imu_stamp_ns")}
        checked, rejected = checks.check(frame(0, stamp_ns=now, features=replace(EMPTY, stamp_ns=now), **stamps))
    assert checked is not None and rejected == ()
    for stamp in (checked.wrench_stamp_ns, checked.attitude_stamp_ns, checked.imu_stamp_ns):
        assert type(stamp) is int and checked.stamp_ns - stamp == 9


@pytest.mark.parametrize("name", ["image", "features"])
def test_untimely_pictures_are_named_and_a_small_lead_counts_as_now(name: str) -> None:
    part, now = PICTURE if name == "image" else EMPTY, 100 * TICK_NS
    for stamp, reason in [
        (now + LEAD_NS, ""),
        (now - round(LATEST_S * 1e9), ""),
        (now + LEAD_NS + 1, "not a time in nanoseconds at most 20 ms after the tick"),
        (now - 302_000_000, "0.302 s old, camera.latest_s = 0.3"),
        (np.int64(now - 5), ""),
        (2**62, "not a time in nanoseconds at most 20 ms after the tick"),
        (None, "not a time in nanoseconds at most 20 ms after the tick"),
    ]:
        checked, rejected = gate().check(frame(100, **{name: replace(part, stamp_ns=stamp)}))
        assert checked is not None
        found = getattr(checked, name)
        assert rejected == ((f"sensor {name}.stamp_ns: {reason}",) if reason else ())
        assert (found is None) == bool(reason)
        if found is not None:
            assert found.stamp_ns == min(stamp, now) and type(found.stamp_ns) is int


@pytest.mark.parametrize("name", ["image", "features"])
def test_a_picture_that_comes_again_or_out_of_order_is_named(name: str) -> None:
    part, checks = PICTURE if name == "image" else EMPTY, gate()
    for tick, stamp in [(10, 11 * TICK_NS), (11, 11 * TICK_NS), (12, 9 * TICK_NS), (13, 12 * TICK_NS)]:
        checked, rejected = checks.check(frame(tick, **{name: replace(part, stamp_ns=stamp)}))
        again = tick in (11, 12)
        assert rejected == ((f"sensor {name}.stamp_ns: not after the last one's",) if again else ())
        assert checked is not None and (getattr(checked, name) is None) == again


@pytest.mark.parametrize("stamp", [-1, 1.5, None, 100 * TICK_NS + LEAD_NS + 1, 1])
def test_a_velocity_without_a_time_is_dropped_by_name(stamp: Any) -> None:
    seen = replace(MOVING, stamp_ns=99 * TICK_NS, velocity_stamp_ns=stamp)
    checked, rejected = gate().check(frame(100, features=seen))
    assert checked is not None and checked.features is not None and checked.features.velocity is None
    assert len(rejected) == 1 and rejected[0].startswith("sensor features.velocity_stamp_ns: ")


@pytest.mark.parametrize(("name", "wanted"), [("image", "RgbdFrame"), ("features", "FeatureFrame")])
def test_what_is_no_picture_is_named(name: str, wanted: str) -> None:
    for thing in ("picture", 7, PICTURE if name == "features" else EMPTY, np.zeros((4, 4, 3)), [PICTURE]):
        checked, rejected = gate().check(frame(1, **{name: thing}))
        assert checked is not None and getattr(checked, name) is None
        assert len(rejected) == 1 and rejected[0].endswith(f", not {wanted}")


def test_features_beside_a_picture_are_named() -> None:
    checked, rejected = gate().check(frame(10, image=replace(PICTURE, stamp_ns=9), features=replace(EMPTY, stamp_ns=8)))
    assert checked is not None and checked.features is None and checked.image is not None
    assert rejected == ("sensor features: not used together with an image",)


@pytest.mark.parametrize("thing", [None, 7, "frame", SensorFrame])
def test_what_is_no_frame_is_named(thing: Any) -> None:
    assert gate().check(thing) == (None, ("sensor frame: not a SensorFrame",))
