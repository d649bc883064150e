"""Sensor data in other axes than FRD and NED: found by name at the start, in a turn, or at the first touch."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ibvs_qp.validation.self_check import SelfCheck, TurnCheck

DT = 0.004
#: From front-left-up to front-right-down and back, and from NED to ENU.
FLU = np.array([1.0, -1.0, -1.0])
ENU = Rotation.from_matrix([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FLIP = Rotation.from_matrix(np.diag(FLU))
WALL = (1.0, 0.0, 0.0)
Sensors = tuple[Sequence[float], Sequence[float], Sequence[float]]


def quaternion(rotation: Rotation) -> list[float]:
    x, y, z, w = rotation.as_quat().tolist()
    return [w, x, y, z]


def sensed(attitude: Rotation, rate: np.ndarray) -> Sensors:
    """What sensors in FRD say of a vehicle without acceleration."""
    return quaternion(attitude), rate.tolist(), attitude.inv().apply([0.0, 0.0, -9.81]).tolist()


def unchanged(seen: Sensors) -> Sensors:
    return seen


def fly(check: SelfCheck, seen_as: Callable[[Sensors], Sensors] = unchanged, turn: Sequence[float] = (0, 0, 0)) -> None:
    """Two seconds of noisy sensors; the vehicle turns there and back by `turn` [rad]."""
    rng = np.random.default_rng(0)
    for tick in range(500):
        phase = math.pi * tick * DT
        angle = 0.5 * np.array(turn) * (1.0 - math.cos(phase))
        attitude = Rotation.from_rotvec([0.0, 0.0, 2.0]) * Rotation.from_rotvec(angle + rng.normal(0.0, 1e-3, 3))
        rate = 0.5 * math.pi * math.sin(phase) * np.array(turn)
        attitude, rate, force = seen_as(sensed(attitude, rate + rng.normal(0.0, 5e-3, 3)))
        check.inertial(attitude, rate, (np.array(force) + rng.normal(0.0, 0.3, 3)).tolist(), DT)


def of_attitude(change: Callable[[Rotation], Rotation]) -> Callable[[Sensors], Sensors]:
    def changed(seen: Sensors) -> Sensors:
        w, x, y, z = seen[0]
        return quaternion(change(Rotation.from_quat([x, y, z, w]))), *seen[1:]

    return changed


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("degrees", [0.0, 2.0, -10.0])
def test_right_axes_pass(axis: int, degrees: float) -> None:
    check = SelfCheck(True)
    assert not check.passed
    fly(check, turn=(math.radians(degrees) * np.eye(3)[axis]).tolist())
    assert check.passed and check.faults() == ()


@pytest.mark.parametrize(
    ("seen_as", "words"),
    [
        (lambda seen: (seen[0], seen[1], (FLU * seen[2]).tolist()), "specific_force: "),
        (lambda seen: (seen[0], (FLU * seen[1]).tolist(), (FLU * seen[2]).tolist()), "its axes are FLU"),
        (lambda seen: (seen[0], seen[1], np.roll(seen[2], 1).tolist()), "its axes are swapped"),
        (of_attitude(lambda attitude: ENU * attitude), "attitude: down is 180 deg off"),
        (of_attitude(lambda attitude: attitude * FLIP), "attitude: down is 180 deg off"),
        (lambda seen: ([*seen[0][1:], seen[0][0]], *seen[1:]), "attitude: down is "),
        (
            of_attitude(lambda attitude: attitude * Rotation.from_rotvec([0.5, 0.0, 0.0])),
            "attitude: down is 29 deg off",
        ),
    ],
)
def test_wrong_axes_are_found_within_a_tenth_of_a_second_at_rest(seen_as: Callable[..., Sensors], words: str) -> None:
    check = SelfCheck(True)
    for _ in range(25):
        attitude, rate, force = seen_as(sensed(Rotation.from_rotvec([0.02, 0.01, 1.0]), np.zeros(3)))
        check.inertial(attitude, rate, force, DT)
    assert not check.passed and len(check.faults()) == 1 and words in check.faults()[0]


@pytest.mark.parametrize(
    ("seen_as", "axes"),
    [
        (of_attitude(lambda attitude: FLIP * attitude * FLIP), ("y", "z")),
        (of_attitude(lambda attitude: ENU * attitude * FLIP), ("y", "z")),
        (of_attitude(lambda attitude: attitude.inv()), ("z",)),  # the others by chance of the yaw
        (lambda seen: (seen[0], (FLU * seen[1]).tolist(), seen[2]), ("y", "z")),
    ],
)
def test_an_attitude_that_is_level_in_wrong_axes_is_found_in_a_turn(
    seen_as: Callable[..., Sensors], axes: tuple[str, ...]
) -> None:
    for index, axis in enumerate("xyz"):
        check = SelfCheck(True)
        fly(check, seen_as, turn=(math.radians(4.0) * np.eye(3)[index]).tolist())
        found = f"attitude: turns against the gyro about {axis}; one of both is FLU, not FRD"
        assert check.faults() == ((found,) if axis in axes else ())
        assert check.passed == (axis not in axes)


@pytest.mark.slow
@pytest.mark.parametrize("bias", [0.05, -0.01])
def test_a_gyro_bias_and_leaps_of_yaw_are_no_wrong_axes(bias: float) -> None:
    check, rng = SelfCheck(True), np.random.default_rng(1)
    for tick in range(15_000):
        yaw = 0.5 * (tick // 500)
        attitude = Rotation.from_rotvec([0.0, 0.0, yaw]) * Rotation.from_rotvec(rng.normal(0.0, 1e-3, 3))
        check.inertial(*sensed(attitude, rng.normal(bias, 5e-3, 3)), DT)
        assert check.faults() == ()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_a_noisy_attitude_is_not_in_other_axes(seed: int) -> None:
    """0.5 degrees a sample; every second the vehicle turns by a degree in a quarter of a second, there or back."""
    check, rng = TurnCheck(), np.random.default_rng(seed)
    for tick in range(15_000):
        second, share = divmod(tick * DT, 1.0)
        done, back = min(4.0 * share, 1.0), second % 2
        angle = math.radians(1.0 - done if back else done) * np.ones(3)
        rate = math.radians(-4.0 if back else 4.0) * (share < 0.25) * np.ones(3)
        noisy = Rotation.from_rotvec(angle) * Rotation.from_rotvec(rng.normal(0.0, math.radians(0.5), 3))
        check.add(quaternion(noisy), (rate + rng.normal(0.0, 5e-3, 3)).tolist(), DT)
        assert check.faults == ()


def test_an_accelerated_or_turning_vehicle_has_not_passed_yet() -> None:
    check = SelfCheck(True)
    for _ in range(50):
        check.inertial([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [3.0, 0.0, -12.0], DT)
        check.inertial([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], DT)  # falls
    assert not check.passed and check.faults() == ()
    for _ in range(20):
        check.inertial([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, -9.8], DT)
    assert check.passed


def touch(check: SelfCheck, raw: np.ndarray, noise: float = 0.05, near: float = -0.002) -> None:
    """A second in free flight, the tool's weight on the sensor, then half a second of a force on it."""
    weight = np.array([0.3, -0.2, -3.4])
    for tick in range(375):
        free = tick < 250
        load = weight if free else weight + raw
        check.contact(load.tolist(), noise, WALL, 0.1 if free else near, DT)


@pytest.mark.parametrize("axes", [np.eye(3), np.eye(3)[[0, 2, 1]], np.diag([1.0, -1.0, -1.0])])
def test_a_touch_against_the_approach_ends_the_check(axes: np.ndarray) -> None:
    """The force of a push is +x on the tool, with friction across it; the other axes cannot be told."""
    check = SelfCheck(True)
    fly(check)
    touch(check, axes @ [4.0, 1.5, -1.5])
    assert check.passed and check.faults() == ()
    fly(check, lambda seen: (seen[0], (FLU * seen[1]).tolist(), (FLU * seen[2]).tolist()))
    assert check.passed and check.faults() == ()


@pytest.mark.parametrize(
    "axes", [-np.eye(3), np.eye(3)[[1, 0, 2]], np.eye(3)[[2, 1, 0]], np.roll(np.eye(3), 1, axis=0)]
)
def test_a_touch_in_another_direction_is_named(axes: np.ndarray) -> None:
    check = SelfCheck(True)
    fly(check)
    touch(check, axes @ [2.5, 0.2, 0.0])
    assert not check.passed and check.faults()[0].startswith("wrench: the first touch is (")


def test_what_is_no_touch_is_not_judged() -> None:
    for raw, noise, near in [
        ([-1.5, 0.0, 0.0], 0.05, 0.0),
        ([-4.0, 0.0, 0.0], 1.0, 0.0),
        ([-4.0, 0.0, 0.0], 0.05, 0.03),
    ]:
        check = SelfCheck(True)
        fly(check)
        touch(check, np.array(raw), noise, near)
        assert check.passed and check.faults() == ()


def test_the_check_can_be_switched_off_and_begins_anew() -> None:
    off, on = SelfCheck(False), SelfCheck(True)
    for check in (off, on):
        fly(check, lambda seen: (seen[0], seen[1], (FLU * seen[2]).tolist()))
    assert off.passed and off.faults() == () and on.faults()
    on.reset()
    assert on.faults() == () and not on.passed
