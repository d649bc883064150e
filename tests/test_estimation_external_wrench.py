"""The observer of unmodelled wrenches: wrong mass, shifted centre of mass, wind, and what contact freezes."""

from __future__ import annotations

import numpy as np
import pytest

from allocation import control_effectiveness
from ibvs_qp.estimation.external_wrench import FORCE_BOUND, MOMENT_BOUND, ExternalWrench
from ibvs_qp.vehicle import VehicleParams

VEHICLE = VehicleParams()
MATRIX = control_effectiveness(VEHICLE.geometry)
TICK, FORWARD = 0.004, np.array([1.0, 0.0, 0.0])


def hover(
    external: np.ndarray, seconds: float = 5.0, contact: np.ndarray | None = None, touching: bool = False
) -> ExternalWrench:
    """A vehicle that stands still because its rotors balance weight, contact and an unknown wrench."""
    contact = np.zeros(6) if contact is None else contact
    observer = ExternalWrench(VEHICLE, MATRIX)
    weight = np.array([0.0, 0.0, VEHICLE.mass_kg * 9.81, 0.0, 0.0, 0.0])
    thrusts = np.linalg.solve(MATRIX, -weight - external - contact)
    force = np.array([0.0, 0.0, -9.81])
    for _ in range(round(seconds / TICK)):
        observer.follow(thrusts, TICK)
        observer.update(force, np.zeros(3), contact, contact[3:], FORWARD, touching, True, TICK)
    return observer


def test_a_wrong_mass_is_a_weight() -> None:
    """One kilogram more than the model thinks: 9.81 N downwards."""
    found = hover(np.array([0, 0, 9.81, 0, 0, 0])).wrench
    np.testing.assert_allclose(found, [0, 0, 9.81, 0, 0, 0], atol=0.02)


def test_a_shifted_centre_of_mass_is_a_moment() -> None:
    shift = np.array([0.01, -0.02, 0.0])
    moment = np.cross(shift, [0, 0, VEHICLE.mass_kg * 9.81])
    found = hover(np.concatenate((np.zeros(3), moment))).wrench
    np.testing.assert_allclose(found[3:], moment, atol=0.01)
    np.testing.assert_allclose(found[:3], 0.0, atol=0.02)


def test_wind_and_contact_are_told_apart() -> None:
    contact = np.array([-5.0, 1.0, 0, 0, 0, 0.7])
    found = hover(np.array([0.0, 3.0, 1.0, 0, 0, 0]), contact=contact, touching=True, seconds=8.0).wrench
    np.testing.assert_allclose(found[1:3], [3.0, 1.0], atol=0.05)
    np.testing.assert_allclose(found[3:], 0.0, atol=0.01)


def test_in_contact_nothing_is_learnt_along_the_normal() -> None:
    """What the wall takes along n belongs to the force task; an observer there would fight it."""
    found = hover(np.array([4.0, 0, 0, 0, 0, 0]), touching=True)
    assert found.wrench[0] == 0.0
    free = hover(np.array([4.0, 0, 0, 0, 0, 0]))
    assert free.wrench[0] == pytest.approx(4.0, abs=0.02)


def test_acceleration_is_not_taken_for_a_load() -> None:
    observer = ExternalWrench(VEHICLE, MATRIX)
    weight = np.array([0.0, 0.0, -VEHICLE.mass_kg * 9.81, 0, 0, 0])
    for k in range(2000):
        push = 3.0 * np.sin(0.01 * k)
        thrusts = np.linalg.solve(MATRIX, weight + push * np.eye(6)[0])
        observer.thrusts = thrusts  # rotors without lag
        force = np.array([push / VEHICLE.mass_kg, 0.0, -9.81])
        observer.update(force, np.zeros(3), np.zeros(6), np.zeros(3), FORWARD, False, True, TICK)
    np.testing.assert_allclose(observer.wrench, 0.0, atol=1e-9)


def test_a_turn_by_the_rotors_is_not_taken_for_a_moment() -> None:
    """Momentum observer: spinning up about all axes, gyroscopic moment included."""
    observer, inertia = ExternalWrench(VEHICLE, MATRIX), np.array(VEHICLE.inertia_kg_m2)
    omega = np.zeros(3)
    for k in range(2000):
        moment = 0.3 * np.array([np.sin(0.01 * k), np.cos(0.013 * k), np.sin(0.007 * k)])
        observer.thrusts = np.linalg.solve(MATRIX, [0, 0, -58.86, *moment])
        observer.update(np.array([0, 0, -9.81]), omega, np.zeros(6), np.zeros(3), FORWARD, False, True, TICK)
        omega = omega + TICK * (moment - np.cross(omega, inertia * omega)) / inertia
    np.testing.assert_allclose(observer.moment, 0.0, atol=0.01)


def test_rotors_lag_as_modelled() -> None:
    observer = ExternalWrench(VEHICLE, MATRIX)
    observer.follow(np.full(6, 10.0), TICK)
    observer.follow(np.full(6, 20.0), VEHICLE.motor_lag_up_s)
    np.testing.assert_allclose(observer.thrusts, 20.0 - 10.0 * np.exp(-1.0))
    observer.follow(np.zeros(6), VEHICLE.motor_lag_down_s)
    np.testing.assert_allclose(observer.thrusts, (20.0 - 10.0 * np.exp(-1.0)) * np.exp(-1.0))


def test_bounds_hold_and_nothing_moves_before_the_first_command() -> None:
    found = hover(np.array([500.0, -500.0, 0, 50.0, 0, -50.0])).wrench
    assert np.abs(found[:3]).max() <= FORCE_BOUND and np.abs(found[3:]).max() <= MOMENT_BOUND
    fresh = ExternalWrench(VEHICLE, MATRIX)
    fresh.update(np.zeros(3), np.zeros(3), np.zeros(6), np.zeros(3), FORWARD, False, True, TICK)
    np.testing.assert_array_equal(fresh.wrench, 0.0)


def test_no_accelerometer_freezes_the_force_only() -> None:
    observer = hover(np.array([0, 0, 5.0, 0, 0, 0]))
    before = observer.force.copy()
    for _ in range(500):
        observer.update(None, np.zeros(3), np.zeros(6), np.zeros(3), FORWARD, False, True, TICK)
    np.testing.assert_array_equal(observer.force, before)
