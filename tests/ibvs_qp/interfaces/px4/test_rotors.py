"""PX4's rotor parameters and setpoints, against its allocation written anew."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np
import pytest

from allocation import TAROT_T960, RotorGeometry, control_effectiveness
from ibvs_qp import preset
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.interfaces.px4.rotors import from_px4, read_px4, setpoint_scale, to_px4

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
def test_exported_parameters_have_our_effectiveness_and_come_back(name: str) -> None:
    geometry, thrust_max = VEHICLES[name]
    text, expected = to_px4(geometry, thrust_max), control_effectiveness(geometry) * thrust_max
    np.testing.assert_allclose(effectiveness_of_px4(text), expected, atol=1e-6)
    found = from_px4(text)
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


#: The parameters of `SCRIPT` as other programs write them.
PAIRS = {name: value for _, _, name, value in (line.split() for line in SCRIPT.split("\n") if line)}


def bson(pairs: dict[str, str]) -> bytes:
    """A file of ``param save``."""
    items = b"".join(
        b"\x10" + name.encode() + b"\0" + struct.pack("<i", int(value))
        if name in ("CA_AIRFRAME", "CA_ROTOR_COUNT")
        else b"\x01" + name.encode() + b"\0" + struct.pack("<d", float(value))
        for name, value in pairs.items()
    )
    return struct.pack("<i", len(items) + 5) + items + b"\0"


@pytest.mark.parametrize(
    "content",
    [
        "".join(f"1\t1\t{name}\t{value}\t9\n" for name, value in PAIRS.items()),
        "".join(f"{name},{value}\n" for name, value in PAIRS.items()),
        "".join(f"{name} = {value}\r\n" for name, value in PAIRS.items()),
        "".join(f"x + {name} [12,345] : {value}\n" for name, value in PAIRS.items()),
        "param set-default -s MC_ROLL_P 7; " + "; ".join(f"param set {each} {value}" for each, value in PAIRS.items()),
        bson(PAIRS),
    ],
    ids=["QGroundControl", "commas", "equals", "param show", "one line", "param save"],
)
def test_every_form_of_a_parameter_file_is_told_by_its_content(tmp_path: Path, content: str | bytes) -> None:
    file = tmp_path / "4050_generic"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert read_px4(file) == from_px4(SCRIPT)


@pytest.mark.parametrize(
    "line",
    [
        "# param set-default CA_ROTOR1_AX -0.25",
        "#CA_ROTOR_COUNT 4 (the old quad)",
        "param set-default MC_YAW_P 2 # CA_ROTOR0_PX 3",
        "if param compare CA_ROTOR_COUNT 4",
        "if param greater -s CA_ROTOR0_PX 0.1",
        "echo CA_ROTOR0_PX 4",
        "param reset CA_ROTOR0_PX 1",
    ],
)
def test_what_sets_nothing_changes_nothing(line: str) -> None:
    assert from_px4(f"{line}\n{SCRIPT}{line}\n") == from_px4(SCRIPT)


def test_damaged_parameters_of_param_save_are_refused(tmp_path: Path) -> None:
    content = bson(PAIRS)
    for spoilt in (content[:4] + b"\x05" + content[5:], content[:4] + b"\x01A\0\0\0" + b"\0"):
        (tmp_path / "params").write_bytes(struct.pack("<i", len(spoilt)) + spoilt[4:])
        with pytest.raises(ConfigError, match="parameters of 'param save' are damaged"):
            read_px4(tmp_path / "params")


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


def px4_motors(geometry: RotorGeometry, coefficient: float, setpoint: np.ndarray) -> np.ndarray:
    """Motors of a setpoint (thrust, torque) by `ControlAllocationPseudoInverse`, entry by entry.

    PX4 orders axes roll, pitch, yaw, x, y, z.
    """
    effectiveness = coefficient * control_effectiveness(geometry)[[3, 4, 5, 0, 1, 2]]
    mix, motors = np.linalg.pinv(effectiveness), geometry.count
    scale = np.ones(6)
    rolling = [sum(abs(mix[i, axis]) > 1e-3 for i in range(motors)) for axis in (0, 1)]
    norms = [np.sqrt(sum(mix[:, axis] ** 2) / (count / 2)) for axis, count in enumerate(rolling)]
    scale[0] = scale[1] = max(norms)
    scale[2] = mix[:, 2].max()
    for axis in (2, 1, 0):
        column = [abs(mix[i, 3 + axis]) for i in range(motors)]
        used = sum(entry > np.finfo(np.float32).eps for entry in column)
        scale[3 + axis] = sum(column) / used if used else scale[5]
    mix = mix / scale
    mix[abs(mix) < 1e-3] = 0.0
    return mix @ setpoint[[3, 4, 5, 0, 1, 2]]


@pytest.mark.parametrize("geometry", [TAROT_T960, OCTOROTOR.geometry])
@pytest.mark.parametrize("coefficient", [52.56, 6.5])  # CT: PX4 needs only the ratios
def test_px4_commands_the_thrusts_of_the_wrench(geometry: RotorGeometry, coefficient: float) -> None:
    matrix = control_effectiveness(geometry)
    rng = np.random.default_rng(0)
    for _ in range(20):
        wrench = np.array([0.0, 0.0, -58.86, 0.0, 0.0, 0.0]) + rng.normal(0.0, [5, 5, 10, 1, 1, 0.5])
        motors = px4_motors(geometry, coefficient, setpoint_scale(geometry, 52.56) * wrench)
        np.testing.assert_allclose(matrix @ (52.56 * motors), wrench, atol=2e-2)


def test_hover_is_thrust_upwards_alone() -> None:
    setpoint = setpoint_scale(TAROT_T960, 52.56) * [0.0, 0.0, -58.86, 0.0, 0.0, 0.0]
    assert setpoint[2] == pytest.approx(-58.86 / (6 * 52.56 * np.cos(np.radians(30.0))), rel=1e-9)
