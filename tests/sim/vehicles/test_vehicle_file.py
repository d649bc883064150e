"""Vehicles of robot models: places, mass, inertia and rotors in forward-right-down."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from allocation import TAROT_T960
from ibvs_qp.config import VehicleParams
from ibvs_qp.config.errors import ConfigError
from sim.vehicles.vehicle_file import VehicleFile, read_vehicle

T960 = VehicleParams()


def flu(vector: np.ndarray) -> str:
    """Forward-left-up of forward-right-down, as text."""
    x, y, z = np.asarray(vector, float).tolist()
    return f"{x:.9g} {-y:.9g} {-z:.9g}"


def mjcf() -> str:
    """The Tarot T960 as MJCF, its centre of mass 0.1 m above its frame's origin, turned by 30 degrees in the world."""
    shift = np.array((0.0, 0.0, -0.1))
    sites, motors = [], []
    for index, rotor in enumerate(TAROT_T960.rotors):
        hub, axis = TAROT_T960.positions[index] + shift, TAROT_T960.axes[index]
        sites.append(f'<site name="{rotor.name}" pos="{flu(hub)}" zaxis="{flu(axis)}"/>')
        moment = -rotor.spin * TAROT_T960.torque_ratios[index]
        motors.append(
            f'<motor name="{rotor.name}" site="{rotor.name}" gear="0 0 1 0 0 {moment}" ctrlrange="1.2 52.56"/>'
        )
    for name, place in (("tip", T960.tip_position_m), ("force_torque", T960.force_torque_position_m)):
        sites.append(f'<site name="{name}" pos="{flu(place + shift)}"/>')
    return f"""<mujoco><worldbody><body name="base" pos="0 0 1" euler="0 0 30"><freejoint/>
    <inertial mass="6" pos="{flu(shift)}" diaginertia="0.22 0.30 0.48"/>
    {"".join(sites)}
    <camera name="rgbd" pos="{flu(T960.camera_position_m + shift)}" xyaxes="0 -1 0 0 0 1" fovy="42"/>
    </body></worldbody><actuator>{"".join(motors)}</actuator></mujoco>"""


def urdf() -> str:
    """Its frame and rotors as URDF; the propellers' shapes are files that are not there."""
    parts = []
    for index, rotor in enumerate(TAROT_T960.rotors):
        hub, axis, turn = TAROT_T960.positions[index], TAROT_T960.axes[index], "ccw" if rotor.spin > 0 else "cw"
        parts.append(
            f'<link name="rotor_{index}_{turn}"><visual><geometry><mesh filename="package://none/p.dae"/></geometry>'
            f'</visual></link><joint name="j{index}" type="continuous"><origin xyz="{flu(hub)}"/><parent link="base"/>'
            f'<child link="rotor_{index}_{turn}"/><axis xyz="{flu(axis)}"/></joint>'
        )
    parts.append(
        f'<link name="brush"/><joint name="jt" type="fixed"><origin xyz="{flu(T960.tip_position_m)}"/>'
        '<parent link="base"/><child link="brush"/></joint>'
    )
    return f"""<?xml version="1.0"?><robot name="t960"><link name="base"><inertial><mass value="6"/>
    <inertia ixx="0.22" iyy="0.30" izz="0.48" ixy="0" ixz="0" iyz="0"/></inertial></link>{"".join(parts)}</robot>"""


def read(text: str, tmp_path: Path) -> VehicleFile:
    file = tmp_path / "model.anything"
    file.write_text(text)
    return read_vehicle(file)


@pytest.mark.parametrize("make", [mjcf, urdf])
def test_a_model_of_the_tarot_is_the_tarot(make, tmp_path: Path) -> None:
    found = read(make(), tmp_path)
    vehicle = found.vehicle
    assert found.kind == make.__name__.upper() and vehicle.mass_kg == pytest.approx(6.0)
    np.testing.assert_allclose(vehicle.geometry.positions, TAROT_T960.positions, atol=1e-6)
    np.testing.assert_allclose(vehicle.geometry.axes, TAROT_T960.axes, atol=1e-6)
    np.testing.assert_allclose(vehicle.geometry.spins, TAROT_T960.spins)
    np.testing.assert_allclose(vehicle.geometry.torque_ratios, TAROT_T960.torque_ratios, atol=1e-9)
    np.testing.assert_allclose(vehicle.inertia, T960.inertia, atol=1e-9)
    np.testing.assert_allclose(vehicle.tip_position_m, T960.tip_position_m, atol=1e-6)
    assert "tool_mass_kg" in found.assumed and "mass_kg" in found.stated
    if make is mjcf:
        np.testing.assert_allclose(vehicle.camera_position_m, T960.camera_position_m, atol=1e-6)
        np.testing.assert_allclose(vehicle.camera_turn_deg, 0.0, atol=1e-4)
        np.testing.assert_allclose(vehicle.thrust_max, 52.56)
        focal = 240.0 / math.tan(math.radians(21.0))
        assert vehicle.camera_intrinsics_px == pytest.approx((focal, focal, 319.5, 239.5))
    else:
        assert "thrust_max_n" in found.assumed


def test_rotors_without_a_spin_are_noted(tmp_path: Path) -> None:
    found = read(urdf().replace("_ccw", "").replace("_cw", ""), tmp_path)
    assert "spin of rotor_0, rotor_1" in found.notes[0]


@pytest.mark.parametrize(
    ("text", "needle"),
    [
        ("<robot name='x'><link name='a'/></robot>", "no body with a mass"),
        ("<sdf/>", "its root is <sdf>"),
        ("<mujoco><worldbody>", "no element found"),
        ("<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body></worldbody></mujoco>", "no rotors: actuators"),
    ],
)
def test_other_files_are_refused_with_their_name(text: str, needle: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=needle) as caught:
        read(text, tmp_path)
    assert str(caught.value).startswith(str(tmp_path)) and "\n" not in str(caught.value)


def test_thrusts_of_px4_are_those_of_the_file(tmp_path: Path) -> None:
    lines = ["CA_ROTOR_COUNT 6"]
    for index in range(6):
        position, axis = TAROT_T960.positions[index], TAROT_T960.axes[index]
        values = dict(zip(("PX", "PY", "PZ", "AX", "AY", "AZ"), (*position, *axis), strict=True)) | {"CT": 30.0 + index}
        lines += [f"CA_ROTOR{index}_{name} {value}" for name, value in values.items()]
    found = read("\n".join(lines), tmp_path)
    assert found.kind == "PX4 parameters" and found.stated == {"geometry", "thrust_max_n"}
    np.testing.assert_allclose(found.vehicle.thrust_max, 30.0 + np.arange(6))
    assert found.assumptions[0].startswith("PX4 parameters without mass_kg, inertia_kg_m2")
