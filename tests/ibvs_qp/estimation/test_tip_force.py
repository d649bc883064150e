"""Force across the tool from force and moment: noise of either is learned and avoided."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.config import EstimationConfig, VehicleParams
from ibvs_qp.estimation.tip_force import TipForce

SIGMA_NM = 0.005


def flown(
    sigma_n: float, sigma_nm: float = SIGMA_NM, off: tuple[float, float] = (0.0, 0.0), tip_down: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Truth and fused wrenches of a sliding tip that presses with 5 N, ``off`` the tip's centre [m]."""
    vehicle = VehicleParams(tip_position_m=(0.70, 0.0, tip_down))
    rng, fuse = np.random.default_rng(0), TipForce(vehicle, EstimationConfig())
    lever = np.subtract(vehicle.tip_position_m, vehicle.force_torque_position_m) + np.array((0.0, *off))
    truth, found = [], []
    for k in range(400):
        force = np.array([-5.0, 1.5 * np.cos(0.02 * k), 0.8 * np.sin(0.03 * k)])
        wrench = np.concatenate((force, np.cross(lever, force)))
        noise = np.array([sigma_n] * 3 + [sigma_nm] * 3) * rng.standard_normal(6)
        truth.append(wrench)
        found.append(fused(fuse, wrench + noise))
    return np.array(truth)[50:], np.array(found)[50:]


def fused(fuse: TipForce, wrench: np.ndarray) -> np.ndarray:
    better = wrench.copy()
    better[1:3] = fuse.across(wrench[:3].tolist(), wrench[3:].tolist())
    return better


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


def test_reset_and_a_sensor_at_the_tip() -> None:
    at_tip = TipForce(VehicleParams(force_torque_position_m=(0.69, 0.0, 0.0)), EstimationConfig())
    wrench = np.arange(6.0)
    np.testing.assert_array_equal(fused(at_tip, wrench), wrench)
    fuse = TipForce(VehicleParams(), EstimationConfig())
    first = [fused(fuse, k * wrench) for k in range(5)]
    fuse.reset()
    np.testing.assert_array_equal(first, [fused(fuse, k * wrench) for k in range(5)])
