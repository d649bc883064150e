"""Vehicles of robot models: places, mass, inertia and rotors in forward-right-down."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from allocation import TAROT_T960
from ibvs_qp import preset
from ibvs_qp.config import VehicleParams
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.interfaces.px4.rotors import to_px4
from ibvs_qp.pilot.vehicle_check import vehicle_actuation
from sim.commands.cli import main
from sim.vehicles.generator import random_vehicle
from sim.vehicles.mjcf_export import vehicle_mjcf
from sim.vehicles.vehicle_file import VehicleFile, read_vehicle

T960 = VehicleParams()
#: Entries of an inertia in URDF.
AXES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


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


def test_rotors_without_a_spin_or_a_moment_are_noted(tmp_path: Path) -> None:
    found = read(urdf().replace("_ccw", "").replace("_cw", ""), tmp_path)
    assert "spin of rotor_0, rotor_1" in found.notes[0] and "moment per thrust of rotor_0" in found.notes[1]
    (moment,) = read(urdf(), tmp_path).notes
    assert moment.startswith("moment per thrust of rotor_0_") and moment.endswith(": 0.02 m")


def test_spin_moment_and_thrust_of_a_urdf_are_those_of_gazebos_motors(tmp_path: Path) -> None:
    text = urdf().replace("_ccw", "").replace("_cw", "")
    motors = "".join(
        f"<gazebo><plugin><linkName>rotor_{index}</linkName><turningDirection>{'ccw' if spin > 0 else 'cw'}"
        "</turningDirection><momentConstant>0.03</momentConstant><motorConstant>2e-5</motorConstant>"
        "<maxRotVelocity>1000</maxRotVelocity></plugin></gazebo>"
        for index, spin in enumerate(TAROT_T960.spins)
    )
    motors += "<gazebo><plugin><linkName>rotor_0</linkName><topic>wind</topic></plugin></gazebo>"
    found = read(text.replace("</robot>", f"{motors}</robot>"), tmp_path)
    np.testing.assert_array_equal(found.vehicle.geometry.spins, TAROT_T960.spins)
    np.testing.assert_allclose(found.vehicle.geometry.torque_ratios, 0.03)
    np.testing.assert_allclose(found.vehicle.thrust_max, 20.0)
    assert not found.notes and "thrust_max_n" in found.stated
    some = read(text.replace("</robot>", f"{motors.split('</gazebo>')[1]}</gazebo></robot>"), tmp_path)
    np.testing.assert_array_equal(some.vehicle.geometry.spins, TAROT_T960.spins)  # in turn with the one that is stated
    hostile = motors.replace("1000<", "1e200<")
    with pytest.raises(ConfigError, match="thrust_max_n"):
        read(text.replace("</robot>", f"{hostile}</robot>"), tmp_path)


def test_turned_sensors_and_the_tool_beyond_them_are_read(tmp_path: Path) -> None:
    turned = dataclasses.replace(T960, camera_turn_deg=(0.0, -12.0, 3.0), force_torque_turn_deg=(0.0, 0.0, 90.0))
    moments = " ".join(f'{name}="{value}"' for name, value in zip(AXES, (1e-4, 1e-4, 1e-4, 0, 0, 0), strict=True))
    tool = f'<inertial><mass value="0.12"/><inertia {moments}/></inertial>'
    links = "".join(
        f'<link name="{name}">{inertial}</link><joint name="of_{name}" type="fixed">'
        f'<origin xyz="0.3 0 0.1" rpy="{rpy}"/><parent link="{parent}"/><child link="{name}"/></joint>'
        for name, parent, rpy, inertial in (
            ("camera_link", "base", "0 0.1 0", ""),
            ("force_torque", "base", "0 0 0.5", ""),
            ("tool", "force_torque", "0 0 0", tool),
        )
    )
    found = read(urdf().replace("</robot>", f"{links}</robot>"), tmp_path)
    degrees = math.degrees(0.1)
    np.testing.assert_allclose(found.vehicle.camera_turn_deg, (0.0, -degrees, 0.0), atol=1e-5)
    np.testing.assert_allclose(found.vehicle.force_torque_turn_deg, (0.0, 0.0, -math.degrees(0.5)), atol=1e-5)
    assert found.vehicle.tool_mass_kg == pytest.approx(0.12) and "tool_position_m" in found.stated
    over = dataclasses.replace(T960, force_torque_turn_deg=(120.0, 120.0, 120.0))
    back = read(vehicle_mjcf(over), tmp_path)
    assert back.vehicle.force_torque_turn_deg == (120.0, 120.0, 120.0) and not back.notes
    text = vehicle_mjcf(turned)
    assert read(text, tmp_path).vehicle.force_torque_turn_deg == turned.force_torque_turn_deg
    edited = re.sub(r'(name="vehicle.tool_mass_kg" data=)"[^"]*"', r'\1"0.8"', text)
    edited = re.sub(r'(name="vehicle.force_torque_turn_deg" data=)"[^"]*"', r'\1"0 0 10"', edited)
    again = read(edited, tmp_path)
    assert again.vehicle.tool_mass_kg == pytest.approx(turned.tool_mass_kg) and len(again.notes) == 2
    np.testing.assert_allclose(again.vehicle.force_torque_turn_deg, (0.0, 0.0, 90.0), atol=1e-5)


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


VEHICLES = {"T960": T960, "octorotor": preset("octorotor_qp").controller.vehicle}
VEHICLES |= {f"seed {seed}": random_vehicle(seed) for seed in range(10)}


@pytest.mark.parametrize("name", VEHICLES)
def test_mjcf_holds_the_hover_by_itself_and_comes_back(name: str, tmp_path: Path) -> None:
    vehicle, file = VEHICLES[name], tmp_path / "vehicle.xml"
    file.write_text(vehicle_mjcf(vehicle))
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    np.testing.assert_allclose(data.ctrl, vehicle_actuation(vehicle).hover)
    mujoco.mj_step(model, data, 2000)
    assert np.linalg.norm(data.qpos[:3] - (0.0, 0.0, 1.0)) < 1e-3
    assert 2.0 * np.degrees(np.linalg.norm(data.qpos[4:7])) < 0.1
    found = read_vehicle(file)
    assert not found.assumed and not found.notes
    for field in dataclasses.fields(VehicleParams):
        ours, theirs = (getattr(each, field.name) for each in (vehicle, found.vehicle))
        if field.name == "geometry":
            for part in ("positions", "axes", "spins", "torque_ratios"):
                np.testing.assert_allclose(getattr(theirs, part), getattr(ours, part), atol=1e-9, err_msg=part)
            continue
        ours = np.broadcast_to(ours, np.shape(theirs))
        np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=1e-9, err_msg=field.name)


@pytest.mark.parametrize("name", VEHICLES)
def test_px4s_parameters_come_back_in_single_precision(name: str, tmp_path: Path) -> None:
    vehicle, file = VEHICLES[name], tmp_path / "vehicle.params"
    file.write_text(to_px4(vehicle.geometry, vehicle.thrust_max.tolist()))
    found = read_vehicle(file)
    assert found.stated == {"geometry", "thrust_max_n"} and "mass_kg" in found.assumed
    for part in ("positions", "axes", "spins", "torque_ratios"):
        ours, theirs = (getattr(each.geometry, part) for each in (vehicle, found.vehicle))
        np.testing.assert_allclose(theirs, ours, atol=1e-7, err_msg=part)
    np.testing.assert_allclose(found.vehicle.thrust_max, vehicle.thrust_max, rtol=1e-7)


def test_the_command_writes_all_formats(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = [f"--{kind}={tmp_path / kind}" for kind in ("mjcf", "px4", "toml")]
    assert main(["vehicle", "octorotor_qp", *words]) == 0
    assert capsys.readouterr().out.count("Written: ") == 3
    kinds = {kind: read_vehicle(tmp_path / kind).kind for kind in ("mjcf", "px4", "toml")}
    assert kinds == {"mjcf": "MJCF", "px4": "PX4 parameters", "toml": "TOML"}


def test_the_principal_point_of_the_file_is_mujocos() -> None:
    """By the frustum of MuJoCo's renderer, in which columns go to the right and rows down."""
    width, height = T960.camera_size_px
    fx, fy, cx, cy = 600.0, 600.0, 0.5 * (width - 1) + 40.0, 0.5 * (height - 1) + 20.0
    model = mujoco.MjModel.from_xml_string(
        vehicle_mjcf(dataclasses.replace(T960, camera_intrinsics_px=(fx, fy, cx, cy)))
    )
    data, scene, camera = mujoco.MjData(model), mujoco.MjvScene(model, 100), mujoco.MjvCamera()
    mujoco.mj_forward(model, data)
    camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, 0
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
    seen = scene.camera[0]
    scale = fy / seen.frustum_near
    left = scale * (seen.frustum_center - seen.frustum_width)
    assert left == pytest.approx(-(cx + 0.5), abs=0.1)  # the border of the first pixel, left of the axis
    assert scale * seen.frustum_top == pytest.approx(cy + 0.5, abs=0.1)
