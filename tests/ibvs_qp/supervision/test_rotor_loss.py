"""Loss of rotors: what counts as one, and the tilt that carries the weight and leads away from the wall."""

from __future__ import annotations

import math

import numpy as np
import pytest

from allocation import allocate_least_squares, control_effectiveness
from ibvs_qp.config.gains import Gains
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.supervision.rotor_loss import ESCAPE_DISTANCE, TILT_BOUND, TILT_RATE, RotorLoss

VEHICLE = VehicleParams()
LOWER, UPPER = np.full(6, 1.2), np.full(6, 52.56)
INTO_WALL = np.array([1.0, 0.0, 0.0])


def lost(rotor: int) -> tuple[np.ndarray, np.ndarray]:
    lower, upper = LOWER.copy(), UPPER.copy()
    lower[rotor] = upper[rotor] = 0.0
    return lower, upper


def settled(monitor: RotorLoss, distance: float, closing: float = 0.0) -> np.ndarray:
    for _ in range(1000):
        tilt = monitor.tilt(distance, closing, 0.0, INTO_WALL, 0.004)
    return tilt


def test_only_a_lost_hover_is_reported_and_only_once() -> None:
    monitor = RotorLoss(VEHICLE)
    assert not monitor.update(None) and not monitor.update((LOWER, UPPER))
    weak = UPPER.copy()
    weak[0] = 0.4 * 52.56
    assert not monitor.update((LOWER, weak)) and not monitor.lost
    assert monitor.update(lost(0)) and monitor.lost
    assert not monitor.update(lost(0)) and monitor.lost
    assert not monitor.update((LOWER, UPPER)) and not monitor.lost, "the rotor is back"


@pytest.mark.parametrize("rotor", range(6))
def test_the_trim_turns_the_remaining_force_upright(rotor: int) -> None:
    monitor, (lower, upper) = RotorLoss(VEHICLE), lost(rotor)
    monitor.update((lower, upper))
    hover = np.array([0.0, 0.0, -VEHICLE.mass_kg * 9.81, 0.0, 0.0, 0.0])
    matrix = control_effectiveness(VEHICLE.geometry)
    force = (matrix @ allocate_least_squares(hover, matrix, lower, upper + 1e-6))[:3]
    roll, pitch = settled(monitor, ESCAPE_DISTANCE)
    forward = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    sideways = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    lateral = (forward @ sideways @ force)[:2]
    assert np.linalg.norm(lateral) < 0.1 * np.linalg.norm(force[:2])


def test_tilt_leads_away_from_the_wall_within_its_bounds() -> None:
    monitor = RotorLoss(VEHICLE)
    monitor.update(lost(2))
    trim = settled(monitor, ESCAPE_DISTANCE)
    near = settled(monitor, 0.7)
    assert near[1] > trim[1], "nose up: backwards"
    assert np.hypot(*settled(monitor, 0.1, closing=5.0)) <= TILT_BOUND + 1e-12


def test_a_tilt_begins_with_the_lead_of_the_attitude_loop() -> None:
    monitor, gains, dt = RotorLoss(VEHICLE), Gains(), 0.004
    monitor.update(lost(0))
    first = monitor.tilt(ESCAPE_DISTANCE, 0.0, 0.0, INTO_WALL, dt)
    lead = gains.attitude_kd / gains.attitude_kp
    assert first == pytest.approx([0.0, -TILT_RATE * (dt + lead)])
    settled(monitor, ESCAPE_DISTANCE)
    assert np.abs(monitor.tilt(ESCAPE_DISTANCE, 0.0, 0.0, INTO_WALL, dt)).max() < TILT_BOUND


@pytest.mark.parametrize("rotor", range(6))
@pytest.mark.parametrize("thrust", [0.0, 8.0, 15.0])
def test_the_vehicle_tilts_only_where_its_rotors_give_no_force(rotor: int, thrust: float) -> None:
    monitor, (lower, upper) = RotorLoss(VEHICLE), (LOWER.copy(), UPPER.copy())
    lower[rotor] = upper[rotor] = thrust
    monitor.update((lower, upper))
    rest = settled(monitor, ESCAPE_DISTANCE)
    into, across = (settled(monitor, ESCAPE_DISTANCE, closing=speed) - rest for speed in (0.2, -0.2))
    matrix = control_effectiveness(VEHICLE.geometry)
    # Force ahead that the others give beside the hover, without moments and change of lift.
    others = np.delete(matrix, rotor, axis=1)
    free = np.linalg.svd(others[2:])[2][-1] if np.linalg.matrix_rank(others[2:]) < 5 else np.zeros(5)
    direction = (others @ free)[:2]
    assert np.linalg.norm(direction) > 0.1, "one lateral direction stays free"
    for change in (into, across):
        acceleration = np.array((-change[1], change[0]))  # ahead, right
        assert abs(float(acceleration @ direction)) < 1e-9


def test_a_vehicle_that_turned_away_stays_turned_until_its_hover_is_back() -> None:
    monitor = RotorLoss(VEHICLE)
    assert not monitor.turns(0.5), "a sound vehicle may face any way"
    monitor.update(lost(0))
    assert not monitor.turns(0.99) and monitor.turns(0.9) and monitor.turns(0.99)
    monitor.update((LOWER, UPPER))
    assert not monitor.turns(0.9)
