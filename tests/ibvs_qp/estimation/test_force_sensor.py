"""Contact wrench of raw force samples: weight and inertia of the tool, bias, and noise of either half."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from controller_scenes import attitude, body_to_world
from symbolic_block import Block

from ibvs_qp.config import EstimationConfig, VehicleParams
from ibvs_qp.estimation.force_sensor import contact_wrench

VEHICLE = VehicleParams()
TARE_TIME, FOLLOW_TIME = EstimationConfig().tare_time_s, EstimationConfig().tare_follow_s
SENSOR, TOOL, TIP = (
    np.array(v) for v in (VEHICLE.force_torque_position_m, VEHICLE.tool_position_m, VEHICLE.tip_position_m)
)
BIAS = np.array([0.4, -0.3, 0.5, 0.02, -0.03, 0.01])


class Tare:
    """The contact wrench of samples, and the states of the tare."""

    def __init__(self, vehicle: VehicleParams = VEHICLE) -> None:
        def build(signals):
            numbers = {name: signals.input(name) for name in ("interval", "dt", "free")}
            arrays = {"sample": signals.input("sample", 6), "force": signals.input("force", 3)}
            return ca.vertcat(*contact_wrench(signals, vehicle, EstimationConfig(), **numbers, **arrays))

        self._block, self.ready = Block(build), False
        self.bias = self._block.step.states["tare.bias"]

    def update(self, raw: np.ndarray, force: np.ndarray, free: bool, interval: float = 0.01) -> np.ndarray:
        """Tared wrench after a sample, or after a tick without one."""
        *found, ready = self._block(sample=raw, force=force, free=free, interval=interval)
        self.ready = bool(ready)
        return np.array(found)


def sample(specific_force: np.ndarray, contact: np.ndarray, bias: np.ndarray = BIAS) -> np.ndarray:
    """What the sensor reads: the tool's load less the contact force at the tip, about the sensor, plus a bias."""
    load = VEHICLE.tool_mass_kg * specific_force
    moment = np.cross(TOOL - SENSOR, load) - np.cross(TIP - SENSOR, contact)
    return np.concatenate((load - contact, moment)) + bias


def specific_force(roll: float, pitch: float) -> np.ndarray:
    return body_to_world(attitude(roll, pitch)).T @ np.array([0.0, 0.0, -9.81])


def settle(tare: Tare, seconds: float, *, contact: np.ndarray | None = None, start: int = 0, free: bool = True) -> int:
    """Feed samples at 100 Hz while the vehicle rocks by two degrees; the number of ticks so far."""
    contact = np.zeros(3) if contact is None else contact
    for k in range(start, start + round(seconds / 0.01)):
        force = specific_force(0.035 * np.sin(0.02 * k), 0.035 * np.cos(0.013 * k))
        for _ in range(2):  # the accelerometer is faster
            tare.update(np.full(6, np.nan), force, free, 0.0)
        tare.update(sample(force, contact), force, free)
    return start + round(seconds / 0.01)


def test_signs_of_a_push_without_tool_or_bias() -> None:
    """A push of 5 N: the sensor reads +x, the wrench on the vehicle is -x."""
    tare = Tare(VehicleParams(tool_mass_kg=0.0))
    push = np.array([-5.0, 0.0, 0.0])
    raw = sample(np.zeros(3), push, np.zeros(6))
    assert raw[0] == 5.0
    found = tare.update(raw, np.array([0.0, 0.0, -9.81]), False)
    np.testing.assert_allclose(found, [-5.0, 0, 0, 0, 0, 0], atol=1e-12)
    friction = np.array([0.0, -1.5, 0.0])  # at a tip 0.7 m ahead: a yaw moment of -1.05 N m
    found = tare.update(sample(np.zeros(3), friction, np.zeros(6)), np.array([0.0, 0.0, -9.81]), False)
    np.testing.assert_allclose(found, [0, -1.5, 0, 0, 0, -1.05], atol=1e-12)


def test_bias_and_weight_vanish_in_free_flight_and_contact_remains() -> None:
    tare = Tare()
    settle(tare, 2.0)
    assert tare.ready
    force = specific_force(0.03, -0.02)
    for _ in range(40):
        free = tare.update(sample(force, np.zeros(3)), force, True)
    np.testing.assert_allclose(free[:3], 0.0, atol=0.02)
    np.testing.assert_allclose(free[3:], 0.0, atol=0.01)
    contact = np.array([-5.0, 1.5, 0.2])
    for _ in range(40):
        found = tare.update(sample(force, contact), force, False)
    np.testing.assert_allclose(found[:3], contact, atol=0.03)
    np.testing.assert_allclose(found[3:], np.cross(TIP, contact), atol=0.03)


@pytest.mark.parametrize(("roll", "pitch"), [(0.2, 0.0), (0.0, 0.2), (-0.15, 0.1)])
def test_a_tilt_after_the_tare_does_not_look_like_contact(roll: float, pitch: float) -> None:
    tare = Tare()
    settle(tare, 2.0)
    force = specific_force(roll, pitch)
    for _ in range(40):
        found = tare.update(sample(force, np.zeros(3)), force, False)
    np.testing.assert_allclose(found, 0.0, atol=0.03)


def test_acceleration_of_the_tool_does_not_look_like_contact() -> None:
    tare = Tare()
    settle(tare, 2.0)
    force = np.array([2.0, -1.0, -9.0])
    for _ in range(40):
        found = tare.update(sample(force, np.zeros(3)), force, False)
    np.testing.assert_allclose(found, 0.0, atol=0.03)


def test_not_ready_until_it_has_averaged_and_blind_to_contact_while_not_free() -> None:
    tare = Tare()
    ticks = settle(tare, TARE_TIME - 0.05)
    assert not tare.ready
    settle(tare, 0.2, start=ticks)
    assert tare.ready
    held = Tare()
    settle(held, 5.0, contact=np.array([-5.0, 0, 0]), free=False)
    assert not held.ready
    np.testing.assert_array_equal(held.bias, 0.0)


def test_a_push_felt_as_free_leaks_slowly() -> None:
    tare = Tare()
    ticks = settle(tare, FOLLOW_TIME + 5.0)
    before = tare.bias[0]
    settle(tare, 1.0, contact=np.array([-5.0, 0, 0]), start=ticks)
    assert abs(tare.bias[0] - before) < 5.0 * 1.1 / FOLLOW_TIME


# ------------------------------------------------------------------------------------ noise of force and moment

SIGMA_NM = 0.005


def flown(
    sigma_n: float, sigma_nm: float = SIGMA_NM, off: tuple[float, float] = (0.0, 0.0), tip_down: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """True and found wrenches about the sensor; a sliding tip presses with 5 N, ``off`` the tip's centre [m]."""
    vehicle = VehicleParams(tip_position_m=(0.70, 0.0, tip_down), tool_mass_kg=0.0)
    rng, tare = np.random.default_rng(0), Tare(vehicle)
    lever = np.subtract(vehicle.tip_position_m, vehicle.force_torque_position_m) + np.array((0.0, *off))
    truth, found = [], []
    for k in range(400):
        force = np.array([-5.0, 1.5 * np.cos(0.02 * k), 0.8 * np.sin(0.03 * k)])
        wrench = np.concatenate((force, np.cross(lever, force)))
        noise = np.array([sigma_n] * 3 + [sigma_nm] * 3) * rng.standard_normal(6)
        truth.append(wrench)
        felt = tare.update(-(wrench + noise), np.zeros(3), False)
        found.append(np.concatenate((felt[:3], felt[3:] - np.cross(vehicle.force_torque_position_m, felt[:3]))))
    return np.array(truth)[50:], np.array(found)[50:]


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("tip_down", [0.0, 0.1])
@pytest.mark.parametrize("sigma_n", [1.0, 2.0, 3.0])
def test_noisy_forces_are_told_by_the_moments(sigma_n: float, tip_down: float) -> None:
    """3 N per sample become a tenth; with a tip below the sensor's axis its share of the push's noise remains."""
    truth, found = flown(sigma_n, tip_down=tip_down)
    right, down = rms((found - truth)[:, 1]), rms((found - truth)[:, 2])
    assert right < 0.05 * sigma_n
    assert down < (0.05 if tip_down == 0.0 else 0.25) * sigma_n
    assert rms((found - truth)[:, 0]) == pytest.approx(sigma_n, rel=0.2)  # nothing else tells the push


def test_noisy_moments_are_not_believed() -> None:
    truth, found = flown(0.1, sigma_nm=0.5)
    assert rms((found - truth)[:, 1:3]) < 0.12


def test_a_contact_off_the_tip_costs_no_more_than_allowed() -> None:
    """A brush that presses 1 cm beside its centre: the error is what `contact_spread_m` admits, not a bias of 0.1 N."""
    truth, found = flown(0.02, off=(0.01, -0.01))
    bias = np.abs((found - truth)[:, 1:3].mean(axis=0))
    assert (bias < 0.03).all()
    np.testing.assert_allclose((found - truth)[:, 3:].mean(axis=0), 0.0, atol=0.002)  # these stay as measured


def test_a_sensor_at_the_tip_measures_no_force_by_its_moments() -> None:
    tare = Tare(VehicleParams(force_torque_position_m=(0.69, 0.0, 0.0), tool_mass_kg=0.0))
    np.testing.assert_array_equal(tare.update(-np.arange(6.0), np.zeros(3), False)[:3], [0.0, 1.0, 2.0])
