"""A full inertia: the commanded turn is the achieved one, about every axis and in a turn."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from controller_scenes import without_rotors
from scipy.spatial.transform import Rotation
from small_vehicle import SmallVehicle

from ibvs_qp.analytic import PaperController
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.controller import HybridController
from ibvs_qp.measurement import Reference
from ibvs_qp.model.hover import hold_thrusts

PRODUCTS = (0.03, -0.05, 0.02)
DIAGONAL, FULL = (
    # A row filter would start at the turn that the last thrusts give, and that one does depend on the inertia.
    without_rotors(ControllerConfig(vehicle=VehicleParams(inertia_products_kg_m2=products)))
    for products in ((0.0, 0.0, 0.0), PRODUCTS)
)


def turn(law: Any, config: ControllerConfig) -> np.ndarray:
    """Angular acceleration [rad/s^2] that the first thrusts of a tilted, turning vehicle give."""
    vehicle = SmallVehicle(config)
    vehicle.attitude, vehicle.omega = Rotation.from_euler("xyz", (0.04, -0.03, 0.02)), np.array([0.1, -0.2, 0.15])
    if law is hold_thrusts:
        vehicle.omega = np.zeros(3)
        thrusts = hold_thrusts(config, vehicle.measure())
    else:
        thrusts = law(config).step(vehicle.measure(), Reference(standoff=0.5)).thrusts
    momentum = config.vehicle.inertia @ vehicle.omega
    moment = (vehicle.matrix @ thrusts)[3:] - np.cross(vehicle.omega, momentum)
    return np.linalg.solve(config.vehicle.inertia, moment)


@pytest.mark.parametrize("law", [HybridController, PaperController, hold_thrusts])
def test_the_achieved_turn_does_not_depend_on_the_inertia(law: Any) -> None:
    expected = turn(law, DIAGONAL)
    assert np.abs(expected).max() > 0.5
    np.testing.assert_allclose(turn(law, FULL), expected, atol=2e-3)


def test_products_that_no_rigid_body_has_are_refused() -> None:
    message = "inertia_kg_m2 = (0.22, 0.3, 0.48) kg m^2 with the products (0.3, 0.0, 0.0) is refused"
    with pytest.raises(ConfigError, match=re.escape(message)):
        VehicleParams(inertia_products_kg_m2=(0.3, 0.0, 0.0))
    with pytest.raises(ConfigError, match="no rigid body"):
        VehicleParams(inertia_kg_m2=(0.1, 0.1, 0.3))
