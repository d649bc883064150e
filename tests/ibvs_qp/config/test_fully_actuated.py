"""A controller needs a fully-actuated vehicle."""

from __future__ import annotations

import re

import pytest

from allocation import Rotor, RotorGeometry
from ibvs_qp.config import ControllerConfig
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams


def test_a_flat_quadrotor_is_refused() -> None:
    rotors = tuple(Rotor(name=f"r{k}", azimuth_deg=45.0 + 90.0 * k - 180.0, spin=1 - 2 * (k % 2)) for k in range(4))
    geometry = RotorGeometry(rotors=rotors, circle_radius_m=0.3, torque_ratio_m=0.02)
    message = "vehicle.geometry = 4 rotors is refused: they give 4 of 6 directions of a wrench"
    with pytest.raises(ConfigError, match=re.escape(message)):
        ControllerConfig(vehicle=VehicleParams(geometry=geometry, mass_kg=3.0))
