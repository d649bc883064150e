"""A vehicle as MJCF of its own, which MuJoCo's viewer opens and `sim.vehicles.model_file` reads back."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY, R_BODY_CAMERA
from ibvs_qp.pilot.vehicle_check import vehicle_actuation
from sim.world.drawn_shape import tool_xml, vehicle_xml
from sim.world.mjcf import inertial_xml, numbers, rotors_xml
from sim.world.mujoco_frames import FLIP, FLIP_QUATERNION
from sim.world.rigid_body import RigidBody, bare_body, tool_body
from sim.world.scene import Scene
from sim.world.true_vehicle import TrueVehicle, turn_quaternion

#: Fields without a place in MJCF, or only in single precision there: custom numbers ``vehicle.FIELD``.
CUSTOM = (
    "motor_lag_up_s", "motor_lag_down_s", "thrust_rate_n_s", "propeller_radius_m", "linear_drag_n_s_m", "arm_radius_m",
    "force_torque_turn_deg", "tool_mass_kg", "tool_position_m", "camera_intrinsics_px",
)  # fmt: skip
#: Size of a pixel on the camera's sensor [m]; the picture does not depend on it.
PIXEL_M = 3e-6
#: Least moment of inertia that MuJoCo takes, with a margin [kg m^2].
LEAST_MOMENT = 1e-12


def vehicle_mjcf(vehicle: VehicleParams) -> str:
    """MJCF of a vehicle in free air, 1 m above the ground, with the keyframe ``hover``.

    Rotors are actuators at sites with their lag and thrust range; MuJoCo has one lag for both directions, the mean.
    The tool is a body of its own beyond the site ``force_torque``, without mass where it alone has more inertia than
    the whole vehicle. Numbers have 17 digits.

    Raises:
        ConfigError: When no thrusts within the limits hold it level.
    """
    found, true = vehicle_actuation(vehicle), TrueVehicle(**_fields(vehicle))
    if not found.hovers:
        raise ConfigError("no thrusts within the limits hold the vehicle level: MJCF has a hover as its keyframe")
    hover, tip = numbers(found.hover), numbers(FLIP * vehicle.tip_position_m)
    sensor = numbers(FLIP * vehicle.force_torque_position_m)
    turn = numbers(FLIP_QUATERNION * turn_quaternion(vehicle.force_torque_turn_deg))
    try:
        bare, tool = inertial_xml(bare_body(true)), inertial_xml(tool_body(vehicle), LEAST_MOMENT)
    except ConfigError:
        bare, tool = inertial_xml(RigidBody(vehicle.mass_kg, np.zeros(3), vehicle.inertia)), ""
    sites, actuators = rotors_xml(vehicle, vehicle.motor_lag_s, limited=True)
    custom = "".join(
        f'<numeric name="vehicle.{name}" data="{numbers(np.asarray(getattr(vehicle, name)))}"/>' for name in CUSTOM
    )
    return f"""<mujoco model="vehicle">
  <compiler angle="radian" autolimits="true"/>
  <option gravity="0 0 {numbers(-GRAVITY)}" timestep="0.001" integrator="RK4"/>
  <custom>{custom}</custom>
  <worldbody>
    <light pos="0 0 4"/>
    <geom name="ground" type="plane" size="5 5 0.1" rgba="0.8 0.8 0.8 1"/>
    <body name="vehicle" pos="0 0 1">
      <freejoint/>
      {bare}
      <site name="imu"/>
      {sites}
      {_camera(vehicle)}
      {vehicle_xml(true)}
      <body name="tool">
        {tool}
        <site name="force_torque" pos="{sensor}" quat="{turn}"/>
        <site name="tip" pos="{tip}"/>
        {tool_xml(true, Scene())}
      </body>
    </body>
  </worldbody>
  <actuator>{actuators}</actuator>
  <sensor>
    <accelerometer name="accelerometer" site="imu"/>
    <gyro name="gyro" site="imu"/>
    <force name="force" site="force_torque"/>
    <torque name="torque" site="force_torque"/>
  </sensor>
  <keyframe><key name="hover" qpos="0 0 1 1 0 0 0" act="{hover}" ctrl="{hover}"/></keyframe>
</mujoco>
"""


def _fields(vehicle: VehicleParams) -> dict[str, Any]:
    return {field.name: getattr(vehicle, field.name) for field in dataclasses.fields(VehicleParams)}


def _camera(vehicle: VehicleParams) -> str:
    """The camera with its intrinsics; MuJoCo's cameras look along -z with y upwards."""
    turn = Rotation.from_rotvec(vehicle.camera_turn_deg, degrees=True).as_matrix()
    axes = FLIP[:, None] * (turn @ R_BODY_CAMERA)
    (width, height), (fx, fy, cx, cy) = vehicle.camera_size_px, vehicle.camera_intrinsics_px
    principal = numbers(0.5 * (width - 1) - cx, 0.5 * (height - 1) - cy)  # MuJoCo's offsets are those of the picture
    return (
        f'<camera name="camera" pos="{numbers(FLIP * vehicle.camera_position_m)}" '
        f'xyaxes="{numbers(axes[:, 0], -axes[:, 1])}" resolution="{width} {height}" focalpixel="{numbers(fx, fy)}" '
        f'principalpixel="{principal}" sensorsize="{numbers(PIXEL_M * width, PIXEL_M * height)}"/>'
    )
