"""PX4's rotor parameters, against its formula written anew."""

from __future__ import annotations

import re

import numpy as np
import pytest

from allocation import TAROT_T960, RotorGeometry, control_effectiveness
from ibvs_qp import preset
from ibvs_qp.adapters.px4 import from_px4, to_px4
from ibvs_qp.config.errors import ConfigError

OCTOROTOR = preset("octorotor_qp").controller.vehicle
VEHICLES = {"hexarotor": (TAROT_T960, np.full(6, 52.56)), "octorotor": (OCTOROTOR.geometry, OCTOROTOR.thrust_max)}


def effectiveness_of_px4(text: str) -> np.ndarray:
    """`ActuatorEffectivenessRotors::computeEffectivenessMatrix` on a parameter file: force and moment, (6, n)."""
    values = {name: float(value) for name, value in re.findall(r"(CA_\w+)\t(\S+)", text)}
    columns = []
    for rotor in range(int(values["CA_ROTOR_COUNT"])):
        axis, position = (np.array([values[f"CA_ROTOR{rotor}_{kind}{a}"] for a in "XYZ"]) for kind in "AP")
        ct, km = values[f"CA_ROTOR{rotor}_CT"], values[f"CA_ROTOR{rotor}_KM"]
        axis = axis / np.linalg.norm(axis)
        columns.append(np.concatenate((ct * axis, ct * np.cross(position, axis) - ct * km * axis)))
    return np.array(columns).T


@pytest.mark.parametrize("name", VEHICLES)
def test_the_exported_parameters_have_our_effectiveness(name: str) -> None:
    geometry, thrust_max = VEHICLES[name]
    expected = control_effectiveness(geometry) * thrust_max
    np.testing.assert_allclose(effectiveness_of_px4(to_px4(geometry, thrust_max)), expected, atol=1e-6)


@pytest.mark.parametrize("name", VEHICLES)
def test_exported_parameters_come_back(name: str) -> None:
    geometry, thrust_max = VEHICLES[name]
    found = from_px4(to_px4(geometry, thrust_max))
    np.testing.assert_allclose(control_effectiveness(found.geometry), control_effectiveness(geometry), atol=1e-8)
    np.testing.assert_allclose(found.thrust_coefficients, thrust_max)
    assert found.geometry.spins.tolist() == geometry.spins.tolist()


SCRIPT = """
param set-default CA_AIRFRAME 0
param set-default CA_ROTOR_COUNT 2
param set-default CA_ROTOR0_PX 0.15
param set-default CA_ROTOR0_KM -0.05
param set-default CA_ROTOR1_AX 3.0
param set-default CA_ROTOR1_AZ -4.0
param set-default CA_ROTOR1_CT 8.5
"""


def test_a_script_is_read_and_what_it_leaves_out_has_px4s_default() -> None:
    found = from_px4(SCRIPT)
    assert found.geometry.positions.tolist() == [[0.15, 0.0, 0.0], [0.0, 0.0, 0.0]]
    np.testing.assert_allclose(found.geometry.axes, [[0.0, 0.0, -1.0], [0.6, 0.0, -0.8]])
    assert found.geometry.spins.tolist() == [-1.0, 1.0] and found.geometry.torque_ratios.tolist() == [0.05, 0.05]
    assert found.thrust_coefficients == (6.5, 8.5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"CA_ROTOR_COUNT = 0 is refused: allowed is \[1, 64\]"),
        ("CA_ROTOR_COUNT 99", r"CA_ROTOR_COUNT = 99 is refused"),
        ("CA_ROTOR_COUNT 1\nCA_ROTOR0_PX nan", r"CA_ROTOR0_PX = 'nan' is refused: a finite number"),
        ("CA_ROTOR_COUNT 1\nCA_ROTOR0_CT x", r"CA_ROTOR0_CT = 'x' is refused: a finite number"),
        ("CA_ROTOR_COUNT 1\nCA_ROTOR0_CT 0", r"CA_ROTOR0_CT = 0.0 is refused: it must be above 0"),
        ("CA_ROTOR_COUNT 1\nCA_ROTOR0_AZ 0", r"CA_ROTOR0_AX, _AY, _AZ are refused"),
        ("CA_ROTOR_COUNT 1\nCA_ROTOR0_PX 1e9", r"CA_ROTORn_\*: rotor_0: position_m"),
    ],
)
def test_hostile_parameters_are_refused(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        from_px4(text)


def test_more_rotors_than_px4_has_are_refused() -> None:
    many = RotorGeometry(rotors=TAROT_T960.rotors * 3, circle_radius_m=0.5, torque_ratio_m=0.02)
    with pytest.raises(ConfigError, match="18 rotors are refused: PX4 has at most 12"):
        to_px4(many, [50.0] * 18)
