"""The observer of unmodelled wrenches: wrong mass, shifted centre of mass, wind, and what contact freezes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from symbolic_block import Block

from allocation import control_effectiveness
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.estimation.external_wrench import FORCE_BOUND, MOMENT_BOUND, external_wrench
from ibvs_qp.estimation.inputs import Body, Contact, motor_thrust

VEHICLE = VehicleParams()
MATRIX = control_effectiveness(VEHICLE.geometry)
TICK, WEIGHT, STILL = 0.004, VEHICLE.mass_kg * 9.81, np.array([0.0, 0.0, -9.81])


def observer(adapt_in_contact: bool = True, plane_bandwidth: float | None = None) -> Block:
    """The observer on its own; the moment fed forward is the measured contact moment."""
    config = ControllerConfig(contact_feedforward=adapt_in_contact)
    if plane_bandwidth is not None:
        config = replace(config, contact=replace(config.contact, plane_bandwidth_rad_s=plane_bandwidth))

    def build(signals):
        body, contact = Body.of(signals), Contact.of(signals)
        return external_wrench(
            signals,
            config,
            MATRIX,
            body,
            body.wrench[3:],
            contact.normal,
            contact.touching,
            contact,
            motor_thrust(signals, VEHICLE, body.dt),
            signals.input("along"),
        )

    return Block(build)


def hover(
    external: np.ndarray, seconds: float = 5.0, contact: np.ndarray | None = None, touching: bool = False
) -> Block:
    """A vehicle that stands still because its rotors balance weight, contact and an unknown wrench."""
    contact = np.zeros(6) if contact is None else contact
    thrusts = np.linalg.solve(MATRIX, -np.array([0, 0, WEIGHT, 0, 0, 0]) - external - contact)
    block = observer()
    block.contact(touching=touching)
    for _ in range(round(seconds / TICK)):
        block(thrust_last=thrusts, commanded=1.0, specific_force=STILL, contact_wrench=contact)
    return block


def wrench(block: Block) -> np.ndarray:
    return block.step.outputs["value"].copy()


def without_lag(block: Block, thrusts: np.ndarray, **inputs: np.ndarray) -> None:
    """One tick with rotors that follow at once."""
    block.step.states["motor_thrust"][:] = thrusts
    block(thrust_last=thrusts, commanded=1.0, **inputs)


def test_a_wrong_mass_is_a_weight() -> None:
    """One kilogram more than the model thinks: 9.81 N downwards."""
    found = wrench(hover(np.array([0, 0, 9.81, 0, 0, 0])))
    np.testing.assert_allclose(found, [0, 0, 9.81, 0, 0, 0], atol=0.02)


def test_a_shifted_centre_of_mass_is_a_moment() -> None:
    shift = np.array([0.01, -0.02, 0.0])
    moment = np.cross(shift, [0, 0, VEHICLE.mass_kg * 9.81])
    found = wrench(hover(np.concatenate((np.zeros(3), moment))))
    np.testing.assert_allclose(found[3:], moment, atol=0.01)
    np.testing.assert_allclose(found[:3], 0.0, atol=0.02)


def test_wind_and_contact_are_told_apart() -> None:
    contact = np.array([-5.0, 1.0, 0, 0, 0, 0.7])
    found = wrench(hover(np.array([0.0, 3.0, 1.0, 0, 0, 0]), contact=contact, touching=True, seconds=8.0))
    np.testing.assert_allclose(found[1:3], [3.0, 1.0], atol=0.05)
    np.testing.assert_allclose(found[3:], 0.0, atol=0.01)


def test_along_the_normal_the_force_in_contact_is_that_of_the_push_filter() -> None:
    block = hover(np.array([2.0, 3.0, 1.0, 0, 0, 0]), seconds=8.0)
    before = wrench(block)[:3]
    block.contact(touching=1.0)
    block(along=-1.5)
    np.testing.assert_allclose(wrench(block)[:3], [-1.5, *before[1:]], atol=0.02)
    block.contact(touching=0.0)
    block()
    assert -1.5 < wrench(block)[0] < -1.3  # it goes on from there, at the bandwidth of free flight


def test_acceleration_is_not_taken_for_a_load() -> None:
    block = observer()
    for k in range(2000):
        push = 3.0 * np.sin(0.01 * k)
        thrusts = np.linalg.solve(MATRIX, [push, 0, -WEIGHT, 0, 0, 0])
        without_lag(block, thrusts, specific_force=np.array([push / VEHICLE.mass_kg, 0.0, -9.81]))
    np.testing.assert_allclose(wrench(block), 0.0, atol=1e-9)


def test_a_turn_by_the_rotors_is_not_taken_for_a_moment() -> None:
    """Momentum observer: spinning up about all axes, gyroscopic moment included."""
    block, inertia = observer(), np.array(VEHICLE.inertia_kg_m2)
    omega = np.zeros(3)
    for k in range(2000):
        moment = 0.3 * np.array([np.sin(0.01 * k), np.cos(0.013 * k), np.sin(0.007 * k)])
        thrusts = np.linalg.solve(MATRIX, [0, 0, -WEIGHT, *moment])
        without_lag(block, thrusts, specific_force=STILL, angular_velocity=omega)
        omega = omega + TICK * (moment - np.cross(omega, inertia * omega)) / inertia
    np.testing.assert_allclose(wrench(block)[3:], 0.0, atol=0.01)


def test_rotors_lag_as_modelled() -> None:
    block = observer()
    block(thrust_last=10.0, commanded=1.0)
    block(thrust_last=20.0, dt=VEHICLE.motor_lag_up_s)
    np.testing.assert_allclose(block.step.states["motor_thrust"], 20.0 - 10.0 * np.exp(-1.0))
    block(thrust_last=0.0, dt=VEHICLE.motor_lag_down_s)
    np.testing.assert_allclose(block.step.states["motor_thrust"], (20.0 - 10.0 * np.exp(-1.0)) * np.exp(-1.0))


def test_bounds_hold_and_nothing_moves_before_the_first_command() -> None:
    found = wrench(hover(np.array([500.0, -500.0, 0, 50.0, 0, -50.0])))
    assert np.abs(found[:3]).max() <= FORCE_BOUND and np.abs(found[3:]).max() <= MOMENT_BOUND
    np.testing.assert_array_equal(observer()(commanded=0.0, specific_force=np.ones(3)), 0.0)


def test_no_accelerometer_freezes_the_force_only() -> None:
    block = hover(np.array([0, 0, 5.0, 0, 0, 0]))
    before = wrench(block)[:3]
    for _ in range(500):
        block(specific_force_known=0.0, specific_force=0.0)
    np.testing.assert_array_equal(wrench(block)[:3], before)


def test_without_feedforward_contact_moments_are_not_learnt() -> None:
    """The observer rests at the wall then: it would take the contact's moment for a load."""
    block = observer(adapt_in_contact=False)
    block.contact(touching=True)
    thrusts = np.linalg.solve(MATRIX, [0, 0, -WEIGHT, 0, 0, 0.5])
    for _ in range(1000):
        block(thrust_last=thrusts, commanded=1.0, specific_force=STILL)
    np.testing.assert_array_equal(wrench(block), 0.0)


def gust_in_the_plane(plane_bandwidth: float, gust: float, noise: float = 0.0) -> np.ndarray:
    """Force that the observer gives downwards at the wall, in a gust down of period 2 s [N], (n,)."""
    block, rng, found = observer(plane_bandwidth=plane_bandwidth), np.random.default_rng(2), []
    block.contact(touching=1.0, acceleration_noise=noise)
    hovering = np.linalg.solve(MATRIX, -np.array([0, 0, WEIGHT, 0, 0, 0]))
    for tick in range(2500):
        force = gust * np.sin(np.pi * tick * TICK)
        felt = STILL + [0.0, 0.0, force / VEHICLE.mass_kg] + noise * rng.standard_normal(3)
        without_lag(block, hovering, specific_force=felt)
        found.append(wrench(block)[2] - force)
    return np.array(found)[500:]


def test_in_the_plane_a_gust_is_learnt_faster_than_calm_air() -> None:
    """A first-order observer of bandwidth w leaves the part W / sqrt(w^2 + W^2) of a gust at W = pi rad/s."""
    left = {most: float(np.sqrt(np.mean(gust_in_the_plane(most, 2.0) ** 2))) for most in (1.5, 10.0)}
    assert left[1.5] == pytest.approx(np.sqrt(2.0) * np.pi / np.hypot(1.5, np.pi), rel=0.02)
    assert left[10.0] < 1.25 * np.sqrt(2.0) * np.pi / np.hypot(10.0, np.pi)


def test_in_the_plane_noise_of_the_accelerometer_is_no_gust() -> None:
    slow, fast = (float(np.std(gust_in_the_plane(most, 0.0, noise=0.42))) for most in (1.5, 10.0))
    assert fast < 1.3 * slow
