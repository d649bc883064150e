"""A vehicle from a robot model: MJCF with thrust actuators at sites, or URDF with rotors as joints."""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import copy
import dataclasses
import math
import re
import xml.etree.ElementTree as ET  # nosec B405
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from allocation import Rotor, RotorGeometry
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.files import LARGEST_TOML, read_bytes
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import R_BODY_CAMERA
from sim.world.drawn_shape import FLIP

#: Names of places, of sites, bodies or links.
_TIP = re.compile(r"(^|_)(tip|brush|tool_?tip|end_?effector|tcp)($|_)", re.IGNORECASE)
_SENSOR = re.compile(r"(^|_)(ft|force_?torque|wrench)(_|$)", re.IGNORECASE)
_CAMERA = re.compile(r"(^|_)(camera|rgbd|realsense)(_|$)", re.IGNORECASE)
_ROTOR = re.compile(r"rotor|prop", re.IGNORECASE)
#: Moment per thrust of rotors without one [m].
_ASSUMED_RATIO_M = 0.02
#: A moment per thrust below this is none [m].
_LEAST_RATIO_M = 1e-6
#: Entries of Gazebo's motor model.
_MOTOR = ("turningDirection", "momentConstant", "motorConstant")
#: Relative and absolute difference of a custom number from the model, by rounding: MuJoCo keeps cameras as floats.
_ROUNDING = 1e-5, 1e-9


@dataclass(frozen=True, kw_only=True)
class ModelVehicle:
    """A vehicle of a robot model; attributes as of `sim.vehicles.vehicle_file.VehicleFile`."""

    vehicle: VehicleParams
    kind: str
    stated: frozenset[str]
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class _Thrust:
    """One rotor: hub and axis in world axes; spin, moment per thrust [m] and limits [N], None where not stated."""

    name: str
    hub: np.ndarray
    axis: np.ndarray
    spin: float | None = None
    moment: float | None = None
    limits: tuple[float, float] | None = None


def read_model(file: Path) -> ModelVehicle:
    """Read MJCF or URDF: mass, inertia, rotors, and the places named tip, force_torque and camera.

    Axes are front-left-up, those of the first body. In MJCF a rotor is an actuator at a site whose gear is a force
    along the thrust axis and a moment, as in MuJoCo's own models of quadrotors; in URDF it is a joint whose link has
    "rotor" or "prop" in its name, its axis that of the thrust. Spin, moment and thrust are those of Gazebo's motor
    plugin for the link; else the spin is "ccw" or "cw" in the link's name, or a turn by azimuth. Bodies beyond the
    force sensor are the tool. Custom numbers ``vehicle.FIELD`` count where the model states nothing else.

    Args:
        file: The model.

    Raises:
        ConfigError: When it is no such model, or a vehicle is refused.
    """
    text = read_bytes(file, LARGEST_TOML).decode("utf-8-sig", errors="replace")
    try:
        root = ET.fromstring(text)  # nosec B314: expat limits the expansion of entities, and the file's size is limited
        if root.tag not in ("mujoco", "robot"):
            raise ConfigError(f"its root is <{root.tag}>; MJCF has <mujoco>, URDF <robot>")
        urdf = root.tag == "robot"
        model = mujoco.MjModel.from_xml_string(_kinematic(root)) if urdf else mujoco.MjModel.from_xml_path(str(file))
        return _vehicle(model, root if urdf else None)
    except (ET.ParseError, ValueError, ConfigError) as error:
        words = " ".join(str(error).split())
        raise ConfigError(f"{file}: {words}") from None


def _kinematic(root: ET.Element) -> str:
    """The URDF without shapes and with all joints fixed: frames and inertias remain."""
    model = copy.deepcopy(root)
    for link in model.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    for joint in model.findall("joint"):
        joint.set("type", "fixed")
    options = ET.SubElement(model, "mujoco")
    ET.SubElement(options, "compiler", fusestatic="false", discardvisual="true")
    return ET.tostring(model, encoding="unicode")


def _vehicle(model: mujoco.MjModel, urdf: ET.Element | None) -> ModelVehicle:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    base = next((body for body in range(1, model.nbody) if model.body_dofnum[body] == 6), min(1, model.nbody - 1))
    masses = np.array(model.body_mass)
    if (base == 0 and urdf is None) or masses.sum() <= 0.0:
        raise ConfigError("no body with a mass")
    own = [
        body for body in range(model.nbody) if urdf is not None or model.body_rootid[body] == model.body_rootid[base]
    ]
    mass, centre = masses[own].sum(), masses[own] @ data.xipos[own] / masses[own].sum()
    to_body = np.diag(FLIP) @ data.xmat[base].reshape(3, 3).T
    inertia = np.zeros((3, 3))
    for body in own:
        axes, arm = data.ximat[body].reshape(3, 3), data.xipos[body] - centre
        inertia += axes @ np.diag(model.body_inertia[body]) @ axes.T
        inertia += masses[body] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    inertia = to_body @ inertia @ to_body.T
    thrusts = list(_mjcf_rotors(model, data) if urdf is None else _urdf_rotors(model, data, urdf))
    if not thrusts:
        needed = (
            "actuators at sites with a force in their gear"
            if urdf is None
            else 'joints to links named "rotor" or "prop"'
        )
        raise ConfigError(f"no rotors: {needed} are needed")
    values: dict[str, Any] = {"mass_kg": float(mass), "inertia_kg_m2": tuple(np.diag(inertia).tolist())}
    values["inertia_products_kg_m2"] = (float(inertia[0, 1]), float(inertia[0, 2]), float(inertia[1, 2]))
    geometry, notes = _geometry(thrusts, centre, to_body)
    values["geometry"] = geometry
    limits = [thrust.limits for thrust in thrusts if thrust.limits is not None]
    if len(limits) == len(thrusts):
        values["thrust_min_n"], values["thrust_max_n"] = (tuple(side) for side in zip(*limits, strict=True))
    if (tip := _frame(model, data, own, _TIP)) is not None:
        values["tip_position_m"] = tuple((to_body @ (tip.place - centre)).tolist())
    if (sensor := _frame(model, data, own, _SENSOR)) is not None:
        values["force_torque_position_m"] = tuple((to_body @ (sensor.place - centre)).tolist())
        values["force_torque_turn_deg"] = _turn(to_body @ sensor.axes @ np.diag(FLIP))
        values |= _tool(model, data, base, sensor, centre, to_body)
    values |= _camera(model, data, own, centre, to_body)
    custom = _custom(model)
    differing = [name for name in custom if name in values and not _same(name, custom[name], values[name])]
    values |= {name: value for name, value in custom.items() if name not in differing}
    notes += tuple(f"{name} as modelled: the custom number vehicle.{name} is another one" for name in differing)
    kind = "MJCF" if urdf is None else "URDF"
    return ModelVehicle(vehicle=VehicleParams(**values), kind=kind, stated=frozenset(values), notes=notes)


def _mjcf_rotors(model: mujoco.MjModel, data: mujoco.MjData) -> Iterable[_Thrust]:
    for index in range(model.nu):
        gear = model.actuator_gear[index]
        force = float(np.linalg.norm(gear[:3]))
        if model.actuator_trntype[index] != mujoco.mjtTrn.mjTRN_SITE or force == 0.0:
            continue
        site = int(model.actuator_trnid[index, 0])
        axes, axis = data.site_xmat[site].reshape(3, 3), gear[:3] / force
        ratio = -float(gear[3:] @ axis) / force
        turns = abs(ratio) > _LEAST_RATIO_M
        scale, limits = force * float(model.actuator_gainprm[index, 0]), None
        if model.actuator_ctrllimited[index]:
            low, high = (scale * model.actuator_ctrlrange[index]).tolist()
            limits = max(low, 0.0), high
        name = model.actuator(index).name or f"rotor_{index}"
        yield _Thrust(
            name=_clean(name),
            hub=data.site_xpos[site].copy(),
            axis=axes @ axis,
            spin=math.copysign(1.0, ratio) if turns else None,
            moment=abs(ratio) if turns else None,
            limits=limits,
        )


def _urdf_rotors(model: mujoco.MjModel, data: mujoco.MjData, urdf: ET.Element) -> Iterable[_Thrust]:
    motors = {
        (plugin.findtext("linkName") or "").strip(): plugin
        for plugin in urdf.iter("plugin")
        if any(plugin.find(entry) is not None for entry in _MOTOR)
    }
    for joint in urdf.findall("joint"):
        child, axis = joint.find("child"), joint.find("axis")
        name = "" if child is None else child.get("link", "")
        if not _ROTOR.search(name) or joint.get("type") not in ("continuous", "revolute"):
            continue
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
        if body < 0:
            continue
        own = np.array((axis.get("xyz", "1 0 0") if axis is not None else "1 0 0").split(), float)
        own /= max(float(np.linalg.norm(own)), 1e-12)
        turn = 1.0 if "ccw" in name.lower() else -1.0 if re.search(r"(^|_)cw(_|$)", name.lower()) else None
        hub, axis = data.xpos[body].copy(), data.xmat[body].reshape(3, 3) @ own
        thrust = _Thrust(name=_clean(name), hub=hub, axis=axis, spin=turn)
        yield thrust if name not in motors else _with_motor(thrust, motors[name])


def _with_motor(thrust: _Thrust, motor: ET.Element) -> _Thrust:
    """A rotor with the entries of Gazebo's motor model."""

    def number(name: str) -> float:
        return float(motor.findtext(name) or "nan")

    spin = {"ccw": 1.0, "cw": -1.0}.get((motor.findtext("turningDirection") or "").strip().lower(), thrust.spin)
    moment, speed = abs(number("momentConstant")), number("maxRotVelocity")
    largest = number("motorConstant") * speed * speed
    return dataclasses.replace(
        thrust,
        spin=spin,
        moment=moment if moment > _LEAST_RATIO_M else None,
        limits=(0.0, largest) if largest > 0.0 else None,
    )


def _clean(name: str) -> str:
    """A name in one line."""
    return " ".join(name.split())


def _geometry(thrusts: list[_Thrust], centre: np.ndarray, to_body: np.ndarray) -> tuple[RotorGeometry, tuple[str, ...]]:
    """Rotors in B; those without a spin turn in alternation by azimuth."""
    hubs = [to_body @ (thrust.hub - centre) for thrust in thrusts]
    order = sorted(range(len(hubs)), key=lambda index: math.atan2(hubs[index][1], hubs[index][0]))
    alternate = {index: 1.0 if place % 2 == 0 else -1.0 for place, index in enumerate(order)}
    agreement = sum(alternate[index] * (thrust.spin or 0.0) for index, thrust in enumerate(thrusts))
    rotors = []
    for index, (thrust, hub) in enumerate(zip(thrusts, hubs, strict=True)):
        spin = math.copysign(1.0, agreement) * alternate[index] if thrust.spin is None else thrust.spin
        moment = _ASSUMED_RATIO_M if thrust.moment is None else thrust.moment
        axis = to_body @ thrust.axis
        rotors.append(
            Rotor(
                name=thrust.name,
                spin=1 if spin > 0.0 else -1,
                position_m=(float(hub[0]), float(hub[1]), float(hub[2])),
                axis=(float(axis[0]), float(axis[1]), float(axis[2])),
                torque_ratio_m=moment,
            )
        )
    open_ones = [thrust.name for thrust in thrusts if thrust.spin is None]
    without_moment = [thrust.name for thrust in thrusts if thrust.moment is None]
    notes = (
        (open_ones, "spin of {}: in turn by azimuth, one of two possibilities"),
        (without_moment, f"moment per thrust of {{}}: {_ASSUMED_RATIO_M:g} m"),
    )
    words = tuple(text.format(", ".join(names)) for names, text in notes if names)
    return RotorGeometry(rotors=tuple(rotors), torque_ratio_m=_ASSUMED_RATIO_M), words


class _Frame(NamedTuple):
    """A site or body with a sensor's name."""

    name: str
    body: int
    is_body: bool
    place: np.ndarray  # in world axes [m]
    axes: np.ndarray  # its axes in world axes


def _frame(model: mujoco.MjModel, data: mujoco.MjData, own: list[int], pattern: re.Pattern[str]) -> _Frame | None:
    """The first site or body of the vehicle with such a name."""
    for index in range(model.nsite):
        if pattern.search(name := model.site(index).name) and (body := int(model.site_bodyid[index])) in own:
            return _Frame(name, body, False, data.site_xpos[index].copy(), data.site_xmat[index].reshape(3, 3))
    for index in own:
        if pattern.search(name := model.body(index).name):
            return _Frame(name, index, True, data.xpos[index].copy(), data.xmat[index].reshape(3, 3))
    return None


def _turn(axes: np.ndarray) -> tuple[float, float, float]:
    """Rotation vector of axes [deg], rounded to 1e-6."""
    x, y, z = (np.degrees(Rotation.from_matrix(axes).as_rotvec()).round(6) + 0.0).tolist()
    return x, y, z


def _camera(
    model: mujoco.MjModel, data: mujoco.MjData, own: list[int], centre: np.ndarray, to_body: np.ndarray
) -> dict[str, Any]:
    """Place, turn and intrinsics of the first camera of MJCF; place and turn of one in URDF, by ROS's axes."""
    if model.ncam == 0:
        if (frame := _frame(model, data, own, _CAMERA)) is None:
            return {}
        optical, axes = "optical" in frame.name.lower(), to_body @ frame.axes
        turn = _turn(axes @ R_BODY_CAMERA.T if optical else axes @ np.diag(FLIP))
        return {"camera_position_m": tuple((to_body @ (frame.place - centre)).tolist()), "camera_turn_deg": turn}
    axes = to_body @ data.cam_xmat[0].reshape(3, 3) @ np.diag(FLIP)  # right, down, front in B
    turn = _turn(axes @ R_BODY_CAMERA.T)
    (width, height), default = (int(entry) for entry in model.cam_resolution[0]), VehicleParams().camera_size_px
    if min(width, height) < 32:
        width, height = default
    size = np.array(model.cam_sensorsize[0], float)
    if size.any():
        pixels = np.array(model.cam_intrinsic[0], float).reshape(2, 2) / size * (width, height)
        (fx, fy), (cx, cy) = pixels[0].tolist(), (0.5 * np.array((width - 1, height - 1)) - pixels[1]).tolist()
        return _of_camera(data, centre, to_body, turn, (width, height), (fx, fy, cx, cy))
    focal = 0.5 * height / math.tan(0.5 * math.radians(float(model.cam_fovy[0])))
    intrinsics = focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)
    return _of_camera(data, centre, to_body, turn, (width, height), intrinsics)


def _of_camera(
    data: mujoco.MjData,
    centre: np.ndarray,
    to_body: np.ndarray,
    turn: tuple[float, float, float],
    size: tuple[int, int],
    intrinsics: tuple[float, float, float, float],
) -> dict[str, Any]:
    return {
        "camera_position_m": tuple((to_body @ (data.cam_xpos[0] - centre)).tolist()),
        "camera_turn_deg": turn,
        "camera_size_px": size,
        "camera_intrinsics_px": intrinsics,
    }


def _custom(model: mujoco.MjModel) -> dict[str, Any]:
    """Fields that stand as custom numbers ``vehicle.FIELD``."""
    fields, found = {field.name for field in dataclasses.fields(VehicleParams) if field.name != "geometry"}, {}
    for index in range(model.nnumeric):
        name = model.numeric(index).name.removeprefix("vehicle.")
        if name in fields and model.numeric(index).name != name:
            values = np.array(model.numeric(index).data, float).tolist()
            found[name] = values[0] if len(values) == 1 else tuple(values)
    return found


def _same(name: str, one: Any, other: Any) -> bool:
    """Whether two values of a field are equal up to rounding; rotation vectors as rotations."""
    a, b = np.atleast_1d(np.array(one, float)), np.atleast_1d(np.array(other, float))
    if a.shape != b.shape or not np.isfinite(a).all():
        return False
    if name.endswith("turn_deg"):
        a, b = (Rotation.from_rotvec(each, degrees=True).as_matrix() for each in (a, b))
    return np.allclose(a, b, *_ROUNDING)


def _tool(
    model: mujoco.MjModel, data: mujoco.MjData, base: int, sensor: _Frame, centre: np.ndarray, to_body: np.ndarray
) -> dict[str, Any]:
    """Mass and centre of mass of the bodies beyond the force sensor, or of the one named tool where there are none."""
    body, without = sensor.body, sensor.is_body
    if body == base or (without and model.body_subtreemass[body] <= model.body_mass[body]):
        body, without = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "tool"), False
    if body < 0:
        return {}
    own = float(model.body_mass[body]) if without else 0.0
    mass, moment = float(model.body_subtreemass[body]), model.body_subtreemass[body] * data.subtree_com[body]
    if mass - own <= 0.0:
        return {}
    place = to_body @ ((moment - own * data.xipos[body]) / (mass - own) - centre)
    return {"tool_mass_kg": mass - own, "tool_position_m": tuple(place.tolist())}
