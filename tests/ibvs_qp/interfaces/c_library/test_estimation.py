"""The C library with estimation gives the estimates and thrusts of the pilot, from the same sensors and features."""

from __future__ import annotations

import dataclasses
import math
import re
import subprocess
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from c_flight import CFlight, PilotTick, flown, recorded_flight
from c_library import COMPILERS, FLAGS, flight_instance, make, needs_compiler, written
from recorded_inputs import recording

from ibvs_qp.command import Outcome
from ibvs_qp.measurement import FeatureFrame, SensorFrame
from ibvs_qp.pilot.estimation import ASSUMED_DISTANCE
from ibvs_qp.pilot.painting.command import PaintingCommand, image_reference
from tests.replay.cases import CASES

pytestmark = needs_compiler

PAGE = Path(__file__).parents[4] / "docs" / "c_library.md"
#: Of an example: a newcomer copies it.
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror")

CASE = "press_beyond_reach"
#: Largest difference of an estimate, in units of its own. Prediction and correction have the same bits; the sums that
#: carry a correction to the present have not: numpy multiplies matrices in another order.
ESTIMATE = 1e-9
#: The same where thrusts differ by 1 mN, which the motors' model passes to the velocity: 2e-9 m/s found.
OCTOROTOR_ESTIMATE = 1e-8
#: Largest difference of a thrust [N]: that of the law alone.
THRUST_N = 5e-6
#: The same in single precision; the stiffness, a quotient of two long sums, errs by 5 % [N/m].
SINGLE, SINGLE_THRUST_N, SINGLE_STIFFNESS = 5e-5, 0.05, 500.0
#: Outcomes of a solved program: by OSQP, within its tolerance, on its active set.
SOLVED = {0, 1, 5}
MODES = ("free", "approach", "contact", "hold")
REJECT_STAMP, REJECT_RATE, REJECT_LINES, REJECT_FEATURES, HOLD = 1, 1 << 2, 1 << 11, 1 << 18, 4
#: Ticks of a flight with negative identities: both lines are tracked by then.
NEGATIVE_TICKS = 400
#: Wall behind the touched surface, for a felt surface before the observed one [m].
BEHIND_M = 0.03


def differences(own: CFlight, ticks: Sequence[PilotTick]) -> dict[str, float]:
    """Largest difference of every number; flags, lines and modes are equal."""
    rows: dict[str, list[tuple[Any, Any]]] = defaultdict(list)
    for place, (tick, followed, python, command) in enumerate(ticks):
        own.estimate(tick.frame, tick.measurement)
        other, found = own.act(tick.reference, followed), own.estimated()
        assert found[:5] == python[:5], place
        assert list(found.lines) == list(python.lines), place
        assert other.mode == MODES.index(command.mode), place
        assert other.outcome in SOLVED or (other.outcome == HOLD and command.outcome is Outcome.HOLD), place
        rows["thrusts"].append((np.array(other.thrusts), command.thrusts))
        for name, value in found.numbers.items():
            rows[name].append((value, python.numbers[name]))
        for track, line in found.lines.items():
            rows["lines"].append((list(line.values()), list(python.lines[track].values())))
    largest = {}
    for name, pairs in rows.items():
        values, expected = (np.array(side) for side in zip(*pairs, strict=True))
        assert (np.isnan(values) == np.isnan(expected)).all(), name
        largest[name] = float(np.nanmax(np.abs(values - expected)))
    return largest


@pytest.mark.slow
def test_a_recorded_flight_gives_the_estimates_and_thrusts_of_python() -> None:
    ticks = recorded_flight(CASE)
    largest = differences(flight_instance(CASES[CASE].config()), ticks)
    assert largest.pop("thrusts") <= THRUST_N
    for name in ("normal", "distance", "distance_rate", "push", "stiffness", "attitude", "angular_velocity", "wrench"):
        assert largest[name] == 0.0, name
    assert max(largest.values()) <= ESTIMATE, largest
    assert any(tick.followed for tick in ticks) and any(tick.estimated.in_contact for tick in ticks)


def moved(frame: SensorFrame, by_ns: int) -> SensorFrame:
    """The frame with all its stamps later."""
    features = frame.features
    if features is not None:
        stamps = {name: getattr(features, name) for name in ("stamp_ns", "velocity_stamp_ns")}
        features = dataclasses.replace(features, **{name: stamp and stamp + by_ns for name, stamp in stamps.items()})
    stamps = {name: getattr(frame, name) + by_ns for name in ("stamp_ns", "wrench_stamp_ns")}
    return dataclasses.replace(frame, features=features, **stamps)


def disturbed(tick: int, features: FeatureFrame) -> FeatureFrame:
    """Features with other errors in every part of a flight."""
    changes: dict[str, Any] = {}
    lines = features.lines
    if tick < 60:
        changes["plane"] = None
    elif 400 <= tick < 600:
        changes["lines"] = tuple(dataclasses.replace(line, track_id=0) for line in lines)
    elif 600 <= tick < 700:
        changes["lines"] = (*lines, *(dataclasses.replace(line, rho=line.rho + 0.1) for line in lines))
    elif 700 <= tick < 800:
        changes["lines"] = tuple(dataclasses.replace(line, rho=line.rho + 0.5) for line in lines)
    elif 800 <= tick < 1000 and features.velocity is not None:
        changes["velocity"] = features.velocity + np.array([0.0, 0.5, 0.0])
        changes["curvature"] = np.array([0.6, 0.1, -0.3])
    elif 1000 <= tick < 1050:
        changes["stamp_ns"] = max(features.stamp_ns - 400_000_000, 0)
    elif 1100 <= tick < 1200:
        changes |= {
            "plane": (0.0, 0.0, 2.0, 1.0),
            "curvature": np.array([0.6, math.nan, 0.0]),
            "lines": tuple(dataclasses.replace(line, rho=math.nan) for line in lines),
        }
    elif 1200 <= tick < 1250:
        changes |= {"velocity_covariance": -np.eye(3), "plane": None}
    elif 1250 <= tick < 1280:
        changes["velocity"] = np.full(3, 100.0)
    return dataclasses.replace(features, **changes)


def test_gaps_jumps_and_false_features_have_the_estimates_of_python() -> None:
    """Ticks are missing, the clock jumps, lines jump, velocities are refused for long, rotors give less."""
    frames = []
    for tick, frame in enumerate(recording(CASE).frames):
        if 300 <= tick < 350 or 1300 <= tick < 1310:
            continue
        if frame.features is not None:
            frame = dataclasses.replace(frame, features=disturbed(tick, frame.features))
        if tick % 97 == 0:
            frame = dataclasses.replace(frame, wrench=np.full(6, math.nan))
        if tick % 89 == 0:
            frame = dataclasses.replace(frame, wrench_stamp_ns=frame.stamp_ns + 10**9)
        frames.append(moved(frame, 5_000_000_000) if tick >= 1500 else frame)
    ticks = flown(CASES[CASE].pilot(), frames, derated=1600, most_n=12.0)
    largest = differences(flight_instance(CASES[CASE].config()), ticks)
    assert largest.pop("thrusts") <= THRUST_N and max(largest.values()) <= ESTIMATE, largest


def test_a_surface_before_the_observed_one_has_the_estimates_of_python() -> None:
    frames = []
    for frame in recording(CASE).frames:
        features = frame.features
        if features is not None and features.plane is not None:
            a, b, c, d = features.plane
            ratio = 1.0 + BEHIND_M * math.hypot(a, b, c) / abs(d)
            features = dataclasses.replace(features, plane=(a / ratio, b / ratio, c / ratio, d))
        frames.append(dataclasses.replace(frame, features=features))
    pilot = CASES[CASE].pilot()
    ticks = flown(pilot, frames)
    assert pilot.contact.surface_offset > 0.5 * BEHIND_M
    largest = differences(flight_instance(CASES[CASE].config()), ticks)
    assert largest.pop("thrusts") <= THRUST_N and max(largest.values()) <= ESTIMATE, largest


def test_negative_identities_are_refused_as_in_python() -> None:
    """Identities below zero are of lines without one: a given -2 would take the place of the first of them."""
    frames = []
    for frame in recording(CASE).frames[:NEGATIVE_TICKS]:
        features = frame.features
        if features is not None:
            given = [dataclasses.replace(line, track_id=-1 - place) for place, line in enumerate(features.lines)]
            given += [dataclasses.replace(line, track_id=0) for line in features.lines]
            features = dataclasses.replace(features, lines=tuple(given))
        frames.append(dataclasses.replace(frame, features=features))
    ticks, own = flown(CASES[CASE].pilot(), frames), flight_instance(CASES[CASE].config())
    for tick, followed, python, command in ticks:
        lines = () if tick.frame.features is None else tick.frame.features.lines
        rejected = own.estimate(tick.frame, tick.measurement).rejected
        named = any("negative track_id" in reason for reason in command.rejected)
        assert (rejected & REJECT_LINES != 0) == named == bool(lines)
        own.act(tick.reference, followed)
        found = own.estimates.lines[: own.estimates.line_count]
        assert [line.track_id for line in found] == list(python.lines)
    assert {-2, -3} == {line.track_id for line in found}


def test_failing_inertial_sensors_hold_and_are_named() -> None:
    config, ticks = CASES[CASE].config(), recorded_flight(CASE)[:1200]
    own, step = flight_instance(config), config.controller.vehicle.thrust_rate_n_s * config.controller.tick_s
    for place, (tick, followed, *_) in enumerate(ticks):
        fails = 1000 <= place < 1010
        rate = np.full(3, math.nan) if fails else tick.frame.angular_velocity
        before = np.array(own.command.thrusts)
        own.estimate(dataclasses.replace(tick.frame, angular_velocity=rate))
        command = own.act(tick.reference, followed)
        assert (command.outcome == HOLD) == fails and own.estimates.valid != fails, place
        refused = REJECT_RATE | (0 if tick.frame.features is None else REJECT_FEATURES)
        assert command.rejected == (refused if fails else 0) and command.stamp_ns == tick.frame.stamp_ns
        assert place == 0 or np.abs(np.array(command.thrusts) - before).max() <= step + 1e-9
    assert abs(own.estimates.distance - ticks[-1].estimated.numbers["distance"]) < 0.01
    own.estimate(dataclasses.replace(tick.frame, features=None))
    assert own.act(tick.reference, followed).rejected == REJECT_STAMP


def test_a_picture_with_a_refused_frame_is_named_and_may_come_again() -> None:
    ticks, own = [tick.tick for tick in recorded_flight(CASE)], flight_instance(CASES[CASE].config())
    place = next(k for k, tick in enumerate(ticks) if k >= 300 and tick.frame.features is not None)
    for tick in ticks[:place]:
        own.estimate(tick.frame)
    picture, later = ticks[place].frame, ticks[place + 1]
    assert picture.features is not None and later.frame.features is None
    repeated = dataclasses.replace(picture, stamp_ns=ticks[place - 1].frame.stamp_ns)
    assert own.estimate(repeated).rejected == REJECT_STAMP | REJECT_FEATURES
    without_rate = dataclasses.replace(picture, angular_velocity=np.full(3, math.nan))
    assert own.estimate(without_rate).rejected == REJECT_RATE | REJECT_FEATURES
    assert own.act(later.reference, ()).rejected & REJECT_FEATURES
    assert own.estimate(dataclasses.replace(later.frame, features=picture.features)).rejected == 0
    assert {line.seen_ns for line in own.estimates.lines[: own.estimates.line_count]} == {picture.features.stamp_ns}


def test_lines_to_follow_have_targets_and_unknown_ones_are_named() -> None:
    config, ticks = CASES[CASE].config(), recorded_flight(CASE)
    own, vehicle = flight_instance(config), config.controller.vehicle
    tip = np.subtract(vehicle.tip_position_m, vehicle.camera_position_m)
    place = next(place for place, tick in enumerate(ticks) if tick.followed)
    for tick, followed, *_ in ticks[: place + 1]:
        own.estimate(tick.frame)
        assert own.act(tick.reference, (*followed, 12345)).rejected == REJECT_LINES
    for line in own.estimates.lines[: own.estimates.line_count]:
        guide = type("Line", (), {"role": ("horizontal", "vertical")[line.role]})()
        depth = tip[0] + (own.estimates.distance if own.estimates.wall_known else ASSUMED_DISTANCE)
        (target,) = image_reference(PaintingCommand(True, guides=[(guide, 0.03)]), depth, tip[2], tip[1]).lines
        found = own.target(line, 0.03)
        np.testing.assert_allclose((found.rho, found.theta), (target.rho, target.theta), rtol=1e-12)
        assert found.role == line.role
    features = dataclasses.replace(next(t.tick.frame.features for t in ticks if t.tick.frame.features), stamp_ns=1)
    later = dataclasses.replace(ticks[place + 1].tick.frame, features=features)
    assert own.estimate(later).rejected == REJECT_FEATURES


def test_the_example_prints_what_the_page_shows(tmp_path: Path) -> None:
    config, page = CASES[CASE].config(), PAGE.read_text(encoding="utf-8")
    folder = written(config.controller, False, "", config.estimation)
    make(folder, "build/libibvs_qp.a", FLAGS)
    (command,) = re.findall(r"^cc (.*example_estimation\.c.*)$", page, re.MULTILINE)
    (tmp_path / "flight").symlink_to(folder)
    subprocess.run([COMPILERS[0], *STRICT, *command.split()], cwd=tmp_path, check=True)
    done = subprocess.run(["./example"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True)
    assert "rejected 0x0" in done.stdout and done.stdout in page
    assert len((folder / "example_estimation.c").read_text(encoding="utf-8").splitlines()) <= 60
    make(folder, "build/example_estimation", "build/example_posix", FLAGS)


def test_a_line_that_is_gone_leaves_the_others_their_targets() -> None:
    """The law pairs by role and order: without a place for the first line, the second would have its target."""
    config, ticks = CASES[CASE].config(), recorded_flight(CASE)
    place = next(place for place, tick in enumerate(ticks) if tick.followed) + 300
    thrusts = []
    for gone in (False, True):
        own = flight_instance(config)
        for tick, followed, *_ in ticks[:place]:
            own.estimate(tick.frame)
            own.act(tick.reference, followed)
        for tick, followed, *_ in ticks[place : place + 5]:
            (line, *_), first = tick.reference.lines, (77,) * gone
            aside = (dataclasses.replace(line, rho=line.rho + 0.1),) * gone
            own.estimate(tick.frame)
            command = own.act(dataclasses.replace(tick.reference, lines=(*aside, line)), (*first, followed[0]))
            assert command.rejected == (REJECT_LINES if gone else 0)
        thrusts.append(np.array(command.thrusts))
    np.testing.assert_allclose(*thrusts, atol=0.5)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["heavy_noise", "octorotor"])
def test_further_flights_give_the_estimates_of_python(case: str) -> None:
    """The push reference is of the law: it follows the thrusts, as a velocity does by the motors' model.

    Redundant thrusts of eight rotors have a weight of 0.01 only: they differ by up to 1 mN.
    """
    largest = differences(flight_instance(CASES[case].config()), recorded_flight(case))
    assert largest.pop("thrusts") <= (1e-3 if case == "octorotor" else THRUST_N)
    assert largest.pop("push_reference") <= THRUST_N
    assert max(largest.values()) <= (OCTOROTOR_ESTIMATE if case == "octorotor" else ESTIMATE), largest


@pytest.mark.slow
@pytest.mark.parametrize("case", [CASE, "heavy_noise"])
def test_flights_in_single_precision_give_the_estimates_of_python(case: str) -> None:
    largest = differences(flight_instance(CASES[case].config(), single=True), recorded_flight(case))
    assert largest.pop("thrusts") <= SINGLE_THRUST_N and largest.pop("stiffness") <= SINGLE_STIFFNESS
    assert largest.pop("push_reference") <= SINGLE_THRUST_N
    assert max(largest.values()) <= SINGLE, largest
