"""Tare: weight and inertia of the tool, bias of the sensor, while tilting and in contact."""

from __future__ import annotations

import numpy as np
import pytest
from controller_scenes import TICK_NS, attitude, body_to_world

from ibvs_qp.config import EstimationConfig, VehicleParams
from ibvs_qp.estimation.wrench_tare import WrenchTare

VEHICLE = VehicleParams()
TARE_TIME, FOLLOW_TIME = EstimationConfig().tare_time_s, EstimationConfig().tare_follow_s
SENSOR, TOOL, TIP = (
    np.array(v) for v in (VEHICLE.force_torque_position_m, VEHICLE.tool_position_m, VEHICLE.tip_position_m)
)
BIAS = np.array([0.4, -0.3, 0.5, 0.02, -0.03, 0.01])


def sample(specific_force: np.ndarray, contact: np.ndarray, bias: np.ndarray = BIAS) -> np.ndarray:
    """What the sensor reads: the tool's load less the contact force at the tip, about the sensor, plus a bias."""
    load = VEHICLE.tool_mass_kg * specific_force
    moment = np.cross(TOOL - SENSOR, load) - np.cross(TIP - SENSOR, contact)
    return np.concatenate((load - contact, moment)) + bias


def specific_force(roll: float, pitch: float) -> np.ndarray:
    return body_to_world(attitude(roll, pitch)).T @ np.array([0.0, 0.0, -9.81])


def settle(
    tare: WrenchTare, seconds: float, *, contact: np.ndarray | None = None, start: int = 0, free: bool = True
) -> int:
    """Feed samples at 100 Hz while the vehicle rocks by two degrees; the number of ticks so far."""
    contact = np.zeros(3) if contact is None else contact
    for k in range(start, start + round(seconds / 0.01)):
        force = specific_force(0.035 * np.sin(0.02 * k), 0.035 * np.cos(0.013 * k))
        for _ in range(2):  # the accelerometer is faster
            tare.update(np.full(6, np.nan), 0, force, free)
        tare.update(sample(force, contact), (k + 1) * 10_000_000, force, free)
    return start + round(seconds / 0.01)


def test_signs_of_a_push_without_tool_or_bias() -> None:
    """A push of 5 N: the sensor reads +x, the wrench on the vehicle is -x."""
    tare = WrenchTare(VehicleParams(tool_mass_kg=0.0))
    push = np.array([-5.0, 0.0, 0.0])
    raw = sample(np.zeros(3), push, np.zeros(6))
    assert raw[0] == 5.0
    found = tare.update(raw, TICK_NS, np.array([0.0, 0.0, -9.81]), False)
    np.testing.assert_allclose(found, [-5.0, 0, 0, 0, 0, 0], atol=1e-12)
    friction = np.array([0.0, -1.5, 0.0])  # at a tip 0.7 m ahead: a yaw moment of -1.05 N m
    found = tare.update(sample(np.zeros(3), friction, np.zeros(6)), 2 * TICK_NS, np.array([0.0, 0.0, -9.81]), False)
    np.testing.assert_allclose(found, [0, -1.5, 0, 0, 0, -1.05], atol=1e-12)


def test_bias_and_weight_vanish_in_free_flight_and_contact_remains() -> None:
    tare = WrenchTare(VEHICLE)
    ticks = settle(tare, 2.0)
    assert tare.ready
    force = specific_force(0.03, -0.02)
    for k in range(40):
        free = tare.update(sample(force, np.zeros(3)), (ticks + k + 1) * 10_000_000, force, True)
    np.testing.assert_allclose(free[:3], 0.0, atol=0.02)
    np.testing.assert_allclose(free[3:], 0.0, atol=0.01)
    contact = np.array([-5.0, 1.5, 0.2])
    for k in range(40, 80):
        found = tare.update(sample(force, contact), (ticks + k + 1) * 10_000_000, force, False)
    np.testing.assert_allclose(found[:3], contact, atol=0.03)
    np.testing.assert_allclose(found[3:], np.cross(TIP, contact), atol=0.03)


@pytest.mark.parametrize(("roll", "pitch"), [(0.2, 0.0), (0.0, 0.2), (-0.15, 0.1)])
def test_a_tilt_after_the_tare_does_not_look_like_contact(roll: float, pitch: float) -> None:
    tare = WrenchTare(VEHICLE)
    ticks = settle(tare, 2.0)
    force = specific_force(roll, pitch)
    for k in range(40):
        found = tare.update(sample(force, np.zeros(3)), (ticks + k + 1) * 10_000_000, force, False)
    np.testing.assert_allclose(found, 0.0, atol=0.03)


def test_acceleration_of_the_tool_does_not_look_like_contact() -> None:
    tare = WrenchTare(VEHICLE)
    ticks = settle(tare, 2.0)
    force = np.array([2.0, -1.0, -9.0])
    for k in range(40):
        found = tare.update(sample(force, np.zeros(3)), (ticks + k + 1) * 10_000_000, force, False)
    np.testing.assert_allclose(found, 0.0, atol=0.03)


def test_not_ready_until_it_has_averaged_and_blind_to_contact_while_not_free() -> None:
    tare = WrenchTare(VEHICLE)
    ticks = settle(tare, TARE_TIME - 0.05)
    assert not tare.ready
    settle(tare, 0.2, start=ticks)
    assert tare.ready
    held = WrenchTare(VEHICLE)
    settle(held, 5.0, contact=np.array([-5.0, 0, 0]), free=False)
    assert not held.ready
    np.testing.assert_array_equal(held._bias, 0.0)


def test_a_push_felt_as_free_leaks_slowly() -> None:
    tare = WrenchTare(VEHICLE)
    ticks = settle(tare, FOLLOW_TIME + 5.0)
    before = tare._bias[0]
    settle(tare, 1.0, contact=np.array([-5.0, 0, 0]), start=ticks)
    assert abs(tare._bias[0] - before) < 5.0 * 1.1 / FOLLOW_TIME


def test_old_and_broken_samples_change_nothing() -> None:
    tare = WrenchTare(VEHICLE)
    ticks = settle(tare, 2.0)
    force = specific_force(0.0, 0.0)
    last = tare.update(sample(force, np.zeros(3)), (ticks + 1) * 10_000_000, force, True).copy()
    assert np.isfinite(last).all()
    for stamp, raw in (((ticks + 1) * 10_000_000, 1e3 * np.ones(6)), (0, np.ones(6)), (2**60, np.full(6, np.nan))):
        np.testing.assert_array_equal(tare.update(raw, stamp, force, True), last)
