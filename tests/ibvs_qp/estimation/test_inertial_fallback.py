"""Attitude without inertial sensors: motors' model, wall and lines, or what remains of the sensors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ibvs_qp.estimation.inertial_fallback import InertialFallback
from ibvs_qp.estimation.wall_lines import WallAxes, image_line
from ibvs_qp.measurement import FeatureFrame, LineFeature

TIP_FROM_CAMERA = (0.5, 0.0, -0.08)
TICK, TICK_NS = 0.004, 4_000_000
DISTANCE = 0.1
LINES = {1: ("horizontal", 0.5 * math.pi + 0.03, 0.05), 2: ("vertical", 0.02, 0.1)}
ANGLES = {identity: angle for identity, (_, angle, _) in LINES.items()}
#: Pictures at 31 Hz, 60 ms late.
EVERY, LATE = 8, 15


def as_list(rotation: Rotation) -> list[float]:
    x, y, z, w = rotation.as_quat().tolist()
    return [w, x, y, z]


def picture(rotation: Rotation, stamp_ns: int) -> FeatureFrame:
    """What perception finds on a wall across world x."""
    normal, down = rotation.inv().apply((1.0, 0.0, 0.0)), rotation.inv().apply((0.0, 0.0, 1.0))
    depth = float(normal @ TIP_FROM_CAMERA) + DISTANCE
    axes, lines = WallAxes.of(normal.tolist(), down.tolist()), []
    for identity, (role, angle, offset) in LINES.items():
        rho, theta, _ = image_line(offset, angle, axes, TIP_FROM_CAMERA, DISTANCE)
        lines.append(LineFeature(rho=rho, theta=theta, covariance=np.eye(2) * 1e-6, role=role, track_id=identity))
    plane = (normal[1] / depth, normal[2] / depth, normal[0] / depth, -1.0)
    return FeatureFrame(lines=tuple(lines), plane=plane, stamp_ns=stamp_ns)


def begun(start: Rotation, rate: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> InertialFallback:
    fallback = InertialFallback(TIP_FROM_CAMERA, TICK)
    normal = tuple(start.inv().apply((1.0, 0.0, 0.0)).tolist())
    fallback.begin(as_list(start), rate, normal, ANGLES)  # type: ignore[arg-type]
    return fallback


def error_deg(fallback: InertialFallback, truth: Rotation) -> float:
    return math.degrees(2.0 * math.acos(min(1.0, abs(float(np.dot(fallback.attitude, as_list(truth)))))))


@pytest.mark.parametrize("axis", range(3))
def test_wall_and_lines_correct_every_axis(axis: int) -> None:
    """An unmodelled moment turns the vehicle; late pictures alone must show it."""
    start, unmodelled = Rotation.from_euler("xyz", (0.01, 0.02, -0.03)), np.zeros(3)
    unmodelled[axis] = 0.02  # rad/s^2: 2.3 degrees in two seconds
    fallback, past = begun(start), [start]
    for tick in range(1, 500):
        truth = start * Rotation.from_rotvec(0.5 * unmodelled * (tick * TICK) ** 2)
        past.append(truth)
        fallback.step(tick * TICK_NS, TICK, (0.0, 0.0, 0.0), None, None)
        if tick % EVERY == 0 and tick > LATE:
            fallback.correct(picture(past[tick - LATE], (tick - LATE) * TICK_NS), DISTANCE)
    assert error_deg(fallback, truth) < 0.15 and error_deg(fallback, start) > 2.0
    assert fallback.rate[axis] == pytest.approx(0.04, abs=0.01)


def test_commanded_rotations_are_followed_without_pictures() -> None:
    start, fallback = Rotation.identity(), begun(Rotation.identity())
    for tick in range(1, 101):
        fallback.step(tick * TICK_NS, TICK, (0.5, 0.0, 0.0), None, None)
    assert error_deg(fallback, start * Rotation.from_rotvec((0.5 * 0.5 * 0.4**2, 0.0, 0.0))) < 0.1


def test_a_gyro_or_an_attitude_that_remains_is_used() -> None:
    for measured in ("gyro", "attitude"):
        start, rate = Rotation.identity(), np.array((0.05, -0.1, 0.2))
        fallback = begun(start, tuple(rate.tolist()))
        for tick in range(1, 251):
            truth = start * Rotation.from_rotvec(rate * tick * TICK)
            gyro, attitude = (rate.tolist(), None) if measured == "gyro" else (None, as_list(truth))
            fallback.step(tick * TICK_NS, TICK, (0.0, 0.0, 0.0), attitude, gyro)
        assert error_deg(fallback, truth) < 0.3, measured
        assert fallback.rate == pytest.approx(rate.tolist(), abs=0.01), measured


def test_without_anything_the_attitude_is_lost_in_time() -> None:
    fallback, tick = begun(Rotation.identity()), 0
    while not fallback.lost:
        tick += 1
        fallback.step(tick * TICK_NS, TICK, (0.0, 0.0, 0.0), None, None)
    assert 0.3 < tick * TICK < 5.0
    fallback.reset()
    assert not fallback.lost and not fallback.active
