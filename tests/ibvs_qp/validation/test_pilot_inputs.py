"""Broken frames, pictures and features in flight: the pilot never raises, names them, and no filter keeps them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from recorded_inputs import recording

from ibvs_qp.command import Command, Outcome
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.pilot import Pilot
from tests.replay.cases import CASES

CASE = "paint_paper_law"
FLOOR, CEILING, RATE_STEP = 1.2, 52.56, 500.0 * 0.004
#: First tick of the flight that is replayed: before the touch; the broken one, and ticks until the twins agree: 0.5 s.
FIRST, BROKEN_AT, RECOVERY = 800, 150, 125
#: Largest difference of a thrust from the twin's after that [N].
AGREED = 0.3


def frames(first: int = FIRST) -> list[SensorFrame]:
    return recording(CASE).frames[first:]


def sound(command: Command, last: Command | None) -> Command:
    assert np.isfinite(command.thrusts).all()
    assert command.thrusts.min() >= FLOOR and command.thrusts.max() <= CEILING
    assert last is None or np.abs(command.thrusts - last.thrusts).max() <= RATE_STEP + 1e-9
    assert not any(reason.startswith(("step:", "pilot:")) for reason in command.rejected), command.rejected
    return command


def flown_with(changed: dict[int, SensorFrame], ticks: int, pilot: Pilot | None = None) -> tuple[Pilot, list[Command]]:
    """The recorded frames with some of them changed."""
    pilot, last, commands = pilot or CASES[CASE].pilot(), None, []
    for tick, frame in enumerate(frames()[:ticks]):
        last = sound(pilot.step(changed.get(tick, frame)), last)
        commands.append(last)
    return pilot, commands


@pytest.fixture(scope="module")
def clean() -> list[Command]:
    return flown_with({}, BROKEN_AT + 20 + RECOVERY)[1]


def broken_features() -> dict[str, dict[str, Any]]:
    at = next(tick for tick in range(BROKEN_AT, BROKEN_AT + 20) if frames()[tick].features is not None)
    good = frames()[at].features
    assert good is not None and good.velocity is not None and good.plane is not None
    first = good.lines[0]

    def lines(**changes: Any) -> dict[str, Any]:
        return {"lines": (replace(first, **changes), *good.lines[1:])}

    return {
        "NaN plane": {"plane": (math.nan, *good.plane[1:])},
        "plane with D = 0": {"plane": (*good.plane[:3], 0.0)},
        "plane without a normal": {"plane": (0.0, 0.0, 0.0, -1.0)},
        "plane behind": {"plane": (0.0, 0.0, -2.0, -1.0)},
        "plane of text": {"plane": "abcd"},
        "NaN rho": lines(rho=math.nan),
        "infinite theta": lines(theta=math.inf),
        "giant rho": lines(rho=1e300),
        "NaN covariance": lines(covariance=np.full((2, 2), math.nan)),
        "list covariance": lines(covariance=[[1e-6, 0.0], [0.0, math.nan]]),
        "unhashable track": lines(track_id=[1]),
        "negative track": lines(track_id=-1),
        "unhashable role": lines(role=["horizontal"]),
        "no line": {"lines": (None, "line", 7)},
        "no lines": {"lines": None},
        "velocity of text": {"velocity": "fast"},
        "NaN velocity": {"velocity": np.full(3, math.nan)},
        "NaN velocity covariance": {"velocity_covariance": np.full((3, 3), math.nan)},
        "no velocity covariance": {"velocity_covariance": None},
        "singular velocity covariance": {"velocity_covariance": -np.eye(3)},
        "NaN velocity stamp": {"velocity_stamp_ns": math.nan},
        "late velocity stamp": {"velocity_stamp_ns": 2**61},
        "no stamp": {"stamp_ns": None},
        "NaN stamp": {"stamp_ns": math.nan},
        "stamp ahead": {"stamp_ns": 2**61},
        "stamp of long ago": {"stamp_ns": 1},
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", broken_features())
def test_no_broken_features_reach_a_filter(name: str, clean: list[Command]) -> None:
    at = next(tick for tick in range(BROKEN_AT, BROKEN_AT + 20) if frames()[tick].features is not None)
    good = frames()[at].features
    assert good is not None
    bad = replace(frames()[at], features=replace(good, **broken_features()[name]))
    pilot, commands = flown_with({at: bad}, at + RECOVERY)
    assert any("features" in reason for reason in commands[at].rejected), commands[at].rejected
    assert commands[at].outcome is Outcome.SOLVED
    assert np.isfinite(pilot.motion.state).all() and pilot.contact.state.known
    assert np.abs(commands[-1].thrusts - clean[at + RECOVERY - 1].thrusts).max() <= AGREED
    assert not commands[-1].rejected


def test_features_in_unusual_types_fly_the_same() -> None:
    def unusual(frame: SensorFrame) -> SensorFrame:
        seen = frame.features
        if seen is None:
            return replace(frame, attitude=frame.attitude.tolist(), stamp_ns=np.uint64(frame.stamp_ns))
        lines = [replace(line, covariance=line.covariance.tolist(), rho=np.float64(line.rho)) for line in seen.lines]
        velocity = {name: getattr(seen, name).tolist() for name in ("velocity", "velocity_covariance")}
        more = {"lines": lines, "plane": np.array(seen.plane), "stamp_ns": np.int64(seen.stamp_ns), **velocity}
        return replace(frame, features=replace(seen, **more), wrench_stamp_ns=np.int64(frame.wrench_stamp_ns))

    ticks = 120
    _, expected = flown_with({}, ticks)
    _, found = flown_with({tick: unusual(frames()[tick]) for tick in range(ticks)}, ticks)
    for one, other in zip(expected, found, strict=True):
        np.testing.assert_array_equal(one.thrusts, other.thrusts)
        assert other.rejected == () and type(other.stamp_ns) is int


@pytest.mark.parametrize(
    "limits",
    [
        *[7, "ab", (), (None, None), np.zeros(2), (np.zeros(6), np.zeros(5)), (np.full(6, math.nan), np.full(6, 50.0))],
        *[(np.full(6, -1e9), np.full(6, 50.0)), (np.zeros((6, 1)), np.zeros((6, 1))), {0: 1, 1: 2}, ([None] * 6,) * 2],
    ],
)
def test_broken_thrust_limits_are_named_and_the_last_stay_in_force(limits: Any) -> None:
    pilot = CASES[CASE].pilot()
    weak = np.full(6, 50.0)
    weak[0] = 4.0
    pilot.thrust_limits = [2.0] * 6, weak
    weak[:] = 50.0
    flown_with({}, 20, pilot)
    pilot.thrust_limits = limits
    frame = frames()[20]
    command = sound(pilot.step(frame), None)
    assert len(command.rejected) >= 1 and all(reason.startswith("thrust_limits: ") for reason in command.rejected)
    assert command.thrusts[0] <= 4.0 + 1e-9 and pilot.thrust_limits is not None
    pilot.thrust_limits = None
    assert pilot.thrust_limits is None and not pilot.step(frames()[21]).rejected


def test_what_raises_when_it_is_read_is_named_and_held() -> None:
    class Raising(SensorFrame):
        def __getattribute__(self, name: str) -> Any:
            raise RuntimeError(name)

    pilot, commands = flown_with({}, 50)
    bad = pilot.step(object.__new__(Raising))
    assert bad.outcome is Outcome.HOLD and bad.rejected[0].startswith("sensor frame: stamp_ns not a whole number")
    assert np.abs(bad.thrusts - commands[-1].thrusts).max() <= RATE_STEP + 1e-9
    assert sound(pilot.step(frames()[50]), bad).outcome is Outcome.SOLVED


def test_an_estimator_that_raises_is_named_and_held(monkeypatch: pytest.MonkeyPatch) -> None:
    def raising(*_: Any, **__: Any) -> Any:
        raise RuntimeError

    pilot, commands = flown_with({}, 50)
    with monkeypatch.context() as broken:
        broken.setattr(pilot.estimator, "predict", raising)
        bad = pilot.step(frames()[50])
    assert bad.outcome is Outcome.HOLD and bad.rejected[0].startswith("pilot: RuntimeError in raising")
    assert np.abs(bad.thrusts - commands[-1].thrusts).max() <= RATE_STEP + 1e-9
    assert sound(pilot.step(frames()[51]), bad).outcome is Outcome.SOLVED


def test_a_monitor_that_fails_after_the_law_does_not_step_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    _, expected = flown_with({}, 60)
    pilot, commands = flown_with({}, 50)
    monkeypatch.setattr(pilot.supervision, "watch", lambda *_: 1 / 0)
    last = commands[-1]
    for tick in range(50, 60):
        last = pilot.step(frames()[tick])
        assert last.rejected[-1].startswith("pilot: ZeroDivisionError") and last.stamp_ns == frames()[tick].stamp_ns
        np.testing.assert_array_equal(last.thrusts, expected[tick].thrusts)


def test_a_host_that_lets_numpy_raise() -> None:
    odd = {tick: replace(frames()[tick], angular_velocity=np.full(3, np.longdouble("1e4000"))) for tick in (50, 51)}
    _, expected = flown_with(odd, 150)
    with np.errstate(all="raise"):
        _, found = flown_with(odd, 150)
    for one, other in zip(expected, found, strict=True):
        np.testing.assert_array_equal(one.thrusts, other.thrusts)


def test_every_kind_of_dropped_picture_is_named() -> None:
    flight, pilot = recording("paint_qp").frames, CASES["paint_qp"].pilot()
    first = next(tick for tick, frame in enumerate(flight) if frame.image is not None)
    for frame in flight[:first]:
        pilot.step(frame)
    good = flight[first].image
    assert good is not None
    now = flight[first].stamp_ns
    for name, picture, reason in [
        ("not a picture", "picture", "sensor image: str, not RgbdFrame"),
        ("too old", replace(good, stamp_ns=now - 400_000_000), "sensor image.stamp_ns: "),
        ("ahead", replace(good, stamp_ns=now + 60_000_000), "sensor image.stamp_ns: not a time"),
        ("dtype", replace(good, depth=(1000 * good.depth).astype(np.uint16)), "image: depth picture of type uint16"),
        (
            "unit",
            replace(good, stamp_ns=good.stamp_ns + 1, depth=1000 * good.depth),
            "image: depth picture with a median",
        ),
        ("size", replace(good, stamp_ns=good.stamp_ns + 2, depth=good.depth[:9]), "image: depth picture of shape (9, "),
        ("nothing in it", replace(good, stamp_ns=good.stamp_ns + 3, depth=0 * good.depth), "image: "),
    ]:
        frame = replace(flight[first], stamp_ns=now, image=picture)
        now += 4_000_000
        command = sound(pilot.step(frame), None)
        assert [found for found in command.rejected if found.startswith(reason)], (name, command.rejected)
    assert (
        sound(pilot.step(replace(flight[first], stamp_ns=now, image=replace(good, stamp_ns=now))), None).rejected == ()
    )


def test_lines_before_any_plane_are_named() -> None:
    seen = next(frame.features for frame in frames(0) if frame.features is not None)
    pilot, frame = CASES[CASE].pilot(), frames(0)[0]
    blind = replace(seen, plane=None, stamp_ns=frame.stamp_ns, velocity_stamp_ns=0)
    assert pilot.step(replace(frame, features=blind)).rejected == ("features.lines: not used before the first plane",)


def test_stamps_of_the_inertial_sensors_reach_the_controller() -> None:
    pilot, _ = flown_with({}, 5)
    frame = frames()[5]
    pilot.step(replace(frame, attitude_stamp_ns=frame.stamp_ns - 3, imu_stamp_ns=frame.stamp_ns - 1_000_000))
    assert pilot.measurement is not None
    assert pilot.measurement.attitude_stamp_ns == frame.stamp_ns - 3
    assert pilot.measurement.imu_stamp_ns == frame.stamp_ns - 1_000_000
