"""The simulated world as MuJoCo model, generated from the true vehicle and the scene.

Body frame: origin at the ASSUMED centre of mass, axes front-left-up. The vehicle is one body without its tool, and
the tool beyond the force/torque sensor is a rigid child, so that the sensor reads exactly the tool's load; together
they have the scene's mass, centre of mass and inertia. World: x into the wall, y left, z up along it; the board's face
is the plane x = 0, its bottom left corner lies at y = 0 (see `sim.world.board`).
"""

# MuJoCo's bindings carry no types.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from sim.world.board import BoardGeometry
from sim.world.contact import OPTION_XML, pair_xml, set_contact
from sim.world.drawn_shape import tool_xml, vehicle_xml
from sim.world.face import TIP_RADIUS_M
from sim.world.mujoco_frames import FLIP, FLIP_QUATERNION, rotor_quaternion
from sim.world.rigid_body import RigidBody, bare_body, principal_axes, tool_body
from sim.world.scene import Scene
from sim.world.true_vehicle import TrueVehicle, turn_quaternion

#: Thickness of the board drawn [m].
BOARD_THICKNESS_M = 0.004

#: A physics step [ns]; MuJoCo stores its sensors' samples at each step of a control tick.
STEP_NS = 1_000_000


@dataclass(frozen=True, kw_only=True)
class ModelIds:
    """Indices of bodies and sensors in the compiled model."""

    vehicle: int  # body of the vehicle without tool
    tool: int  # body of the tool
    face: int  # geom of the contact plane
    tip: int  # geom of the tip's sphere
    accelerometer: slice  # slice of ``sensordata``: specific force at the body origin, front-left-up [m/s^2]
    force: slice  # slice: force of the vehicle on the tool, front-left-up [N]
    torque: slice  # slice: the moment at the force/torque sensor [N m]
    contact: slice  # slice: found flag, then force (normal, tangents) and the normal and first tangent axes
    # start in ``history`` of the samples of those four sensors at the steps of a tick, oldest first
    remembered: tuple[int, int, int, int]


def numbers(*values: float | np.ndarray) -> str:
    """Numbers and arrays as text of MuJoCo's XML, to the last digit."""
    return " ".join(f"{float(entry):.17g}" for value in values for entry in np.atleast_1d(value))


def inertial_xml(body: RigidBody, least: float = 1e-9) -> str:
    """Mass, centre and inertia of a body by principal axes, front-left-up; a rod has a least moment [kg m^2]."""
    moments, quaternion = principal_axes(body)
    return (
        f'<inertial mass="{numbers(body.mass)}" pos="{numbers(FLIP * body.centre)}" quat="{numbers(quaternion)}" '
        f'diaginertia="{numbers(np.maximum(moments, least))}"/>'
    )


def rotors_xml(vehicle: VehicleParams, lag_s: float, *, limited: bool = False) -> tuple[str, str]:
    """Rotor sites (z = thrust axis), and their actuators: force along z, drag torque against the spin.

    Args:
        vehicle: The vehicle.
        lag_s: First-order lag of every rotor [s].
        limited: Whether the actuators have the thrust limits.
    """
    geometry, limits = vehicle.geometry, np.column_stack((vehicle.thrust_min, vehicle.thrust_max))
    sites, actuators = [], []
    torques = -geometry.spins * geometry.torque_ratios
    rows = zip(geometry.names, geometry.positions, geometry.axes, torques, limits, strict=True)
    for name, position, axis, torque, limit in rows:
        control = f' ctrlrange="{numbers(limit)}"' if limited else ""
        frame = f'pos="{numbers(FLIP * position)}" quat="{numbers(rotor_quaternion(axis))}"'
        sites.append(f'<site name="{name}" {frame} size="0.01"/>')
        actuators.append(
            f'<general name="{name}" site="{name}" dyntype="filterexact" dynprm="{numbers(lag_s)}" '
            f'gainprm="1"{control} gear="0 0 1 0 0 {numbers(torque)}"/>'
        )
    return "\n".join(sites), "\n".join(actuators)


def _surroundings_xml(scene: Scene) -> str:
    """Board and wall, for pictures only."""
    board, slope = scene.board, math.radians(scene.board.slope_deg)
    along, up = np.array([0, -math.cos(slope), -math.sin(slope)]), np.array([0, -math.sin(slope), math.cos(slope)])
    centre = np.array([0.5 * BOARD_THICKNESS_M, 0, board.bottom_m]) + 0.5 * (
        board.width_m * along + board.height_m * up
    )
    half = numbers(0.5 * board.width_m, 0.5 * board.height_m, 0.5 * BOARD_THICKNESS_M)
    board_colour = numbers(np.array(board.color) / 255.0, 1.0)
    wall_colour = numbers(np.array(scene.wall.color) / 255.0, 1.0)
    return f"""<geom name="board" type="box" pos="{numbers(centre)}" xyaxes="{numbers(along, up)}" size="{half}"
      rgba="{board_colour}" contype="0" conaffinity="0"/>
    <geom name="wall" type="box" pos="{numbers(board.gap_m + 0.5, 0, 0)}" size="0.5 20 20" rgba="{wall_colour}"
      contype="0" conaffinity="0"/>"""


def _option_xml(scene: Scene) -> str:
    option = OPTION_XML.format(gravity=numbers(GRAVITY * FLIP * BoardGeometry(scene).down))
    return option.replace('spring="disable" damper="disable" ', "") if scene.errors.arm.mode_hz else option


def _swing_xml(scene: Scene, vehicle: TrueVehicle) -> str:
    """Pitch and yaw of a flexible arm about the force/torque sensor; straight while the tool hangs level."""
    errors = scene.errors.arm
    if not errors.mode_hz:
        return ""
    tool, rate = tool_body(vehicle), 2.0 * math.pi * errors.mode_hz
    lever = tool.centre - np.asarray(vehicle.force_torque_position_m)
    inertia = float(tool.inertia[1, 1]) + tool.mass * float(lever @ lever)
    stiffness, damping = inertia * rate**2, 2.0 * errors.damping * inertia * rate
    place = numbers(FLIP * vehicle.force_torque_position_m)
    sag = tool.mass * GRAVITY * float(lever[0]) / stiffness  # the spring's turn upwards that carries the tool
    return "".join(
        f'<joint name="{name}" type="hinge" axis="{axis}" pos="{place}" stiffness="{numbers(stiffness)}" '
        f'damping="{numbers(damping)}" springref="{numbers(spring)}"/>'
        for name, axis, spring in (("arm_pitch", "0 1 0", -sag), ("arm_yaw", "0 0 1", 0.0))
    )


def build_xml(scene: Scene, vehicle: TrueVehicle, steps: int, drawn: bool = True) -> str:
    """MJCF text of the world; contact numbers follow after compilation, see `build_model`.

    The contact plane is infinite; `sim.world.face` moves it to the surface before the tip.
    """
    sites, actuators = rotors_xml(vehicle, vehicle.motor_lag_up_s)
    tip, sensor = FLIP * vehicle.tip_position_m, FLIP * vehicle.force_torque_position_m
    sphere = tip - np.array([TIP_RADIUS_M, 0.0, 0.0])
    turn = FLIP_QUATERNION * turn_quaternion(vehicle.force_torque_turn_deg)
    # Geometry without contact costs MuJoCo time at every step.
    surroundings = body = tool = ""
    if drawn:
        surroundings, body, tool = _surroundings_xml(scene), vehicle_xml(vehicle), tool_xml(vehicle, scene)
    return f"""<mujoco model="ibvs_qp">
  <compiler angle="radian" balanceinertia="true" autolimits="true"/>
  {_option_xml(scene)}
  <statistic extent="1"/>
  <worldbody>
    <geom name="face" type="plane" size="0 0 1" zaxis="-1 0 0" contype="0" conaffinity="0" group="3"/>
    {surroundings}
    <body name="vehicle">
      <freejoint/>
      {inertial_xml(bare_body(vehicle))}
      <site name="imu"/>
      {sites}
      {body}
      <body name="tool">
        {inertial_xml(tool_body(vehicle))}
        {_swing_xml(scene, vehicle)}
        <site name="force_torque" pos="{numbers(sensor)}" quat="{numbers(turn)}"/>
        {tool}
        <geom name="tip" type="sphere" pos="{numbers(sphere)}" size="{numbers(TIP_RADIUS_M)}" contype="0"
          conaffinity="0"/>
      </body>
    </body>
  </worldbody>
  {pair_xml("tip", "face")}
  <actuator>{actuators}</actuator>
  <sensor>
    <accelerometer name="accelerometer" site="imu" nsample="{steps}"/>
    <force name="force" site="force_torque" nsample="{steps}"/>
    <torque name="torque" site="force_torque" nsample="{steps}"/>
    <contact name="contact" geom1="tip" geom2="face" num="1" data="found force normal tangent"
      nsample="{steps}"/>
  </sensor>
</mujoco>"""


def build_model(
    scene: Scene, vehicle: TrueVehicle, steps: int = 1, drawn: bool = True
) -> tuple[mujoco.MjModel, ModelIds]:
    """Compile the world.

    Args:
        scene: Board and wall.
        vehicle: The vehicle that flies.
        steps: Physics steps in a control tick.
        drawn: Whether to add geometry for display only; the motion is bit-identical without it.

    Raises:
        ConfigError: When the tool alone exceeds the vehicle's inertia.
    """
    model = mujoco.MjModel.from_xml_string(build_xml(scene, vehicle, steps, drawn))
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "vehicle")
    # The compiler evens out moments that break the triangle inequality; the plant's numbers are meant literally.
    model.body_inertia[body] = principal_axes(bare_body(vehicle))[0]
    mujoco.mj_setConst(model, mujoco.MjData(model))
    wall = scene.wall
    set_contact(model, stiffness=wall.stiffness_n_m, damping=wall.damping_n_s_m, friction=wall.friction)
    slices, remembered = {}, []
    for name in ("accelerometer", "force", "torque", "contact"):
        sensor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, name)
        start = int(model.sensor_adr[sensor])
        slices[name] = slice(start, start + int(model.sensor_dim[sensor]))
        # Layout: two numbers of MuJoCo's own, the stamps, a ring of samples; after a whole tick the oldest is first.
        remembered.append(int(model.sensor_historyadr[sensor]) + 2 + steps)
    face, tip = (mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name) for name in ("face", "tip"))
    tool = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "tool")
    return model, ModelIds(vehicle=body, tool=tool, face=face, tip=tip, **slices, remembered=tuple(remembered))
