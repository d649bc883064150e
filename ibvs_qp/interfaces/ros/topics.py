"""Names and axes of the topics; set in a TOML file or in code."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ibvs_qp.config.errors import out_of_range
from ibvs_qp.config.settings import choice, setting, validate
from ibvs_qp.interfaces.ros.messages import (
    CAMERA_INFO,
    COMPRESSED_IMAGE,
    IMAGE,
    IMU,
    SENSOR_COMBINED,
    VEHICLE_ATTITUDE,
    WRENCH,
)

TWIST = "geometry_msgs/msg/TwistStamped"
#: Types that every topic may have, the usual one first.
ACCEPTED = {
    "imu": (IMU, SENSOR_COMBINED),
    "attitude": (VEHICLE_ATTITUDE, IMU),
    "wrench": (WRENCH,),
    "height_rate": (TWIST,),
    "color": (IMAGE, COMPRESSED_IMAGE),
    "depth": (IMAGE, COMPRESSED_IMAGE),
    "camera_info": (CAMERA_INFO,),
}
#: Topics of pictures; of everything else that a frame needs, and that it may have.
CAMERA, MOTION = ("color", "depth", "camera_info"), ("imu", "attitude", "wrench")
SAMPLES = tuple([role for role in ACCEPTED if role not in CAMERA])
#: Topics without which a frame is complete, or whose quantity comes with another one: their names may be empty.
OPTIONAL = ("attitude", "color", *[role for role in SAMPLES if role not in MOTION])
_NAME = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")


def check_name(field: str, name: str) -> None:
    """Raise ConfigError if the name is not absolute in ROS 2."""
    if not _NAME.fullmatch(name):
        raise out_of_range(field, name, "", "a topic's name begins with / and has letters, digits and _")


@dataclass(frozen=True, kw_only=True)
class Topics:
    """Topics of a vehicle; the camera's are those of RealSense's ROS wrapper with depth aligned to colour."""

    imu: str = setting("/imu/data", "gyro and accelerometer: sensor_msgs/Imu, or px4_msgs/SensorCombined")
    attitude: str = setting("", "px4_msgs/VehicleAttitude or sensor_msgs/Imu; empty for the orientation in imu")
    attitude_filter_s: float = setting(
        0.0,
        "time constant of a complementary filter of gyro and accelerometer, where the IMU has no orientation; 0: none",
        unit="s",
        why="1 s follows a hover; a lasting acceleration leans it",
        low=0.0,
        high=100.0,
    )
    wrench: str = setting("/ft_sensor/wrench", "force/torque sensor: geometry_msgs/WrenchStamped")
    height_rate: str = setting("", "rate of climb: geometry_msgs/TwistStamped, linear.z upwards; empty for none")
    color: str = setting(
        "/camera/camera/color/image_raw", "colour: Image of 8 bits per channel, or CompressedImage; empty for none"
    )
    depth: str = setting(
        "/camera/camera/aligned_depth_to_color/image_raw",
        "depth, registered or not: Image in 16UC1 (mm) or 32FC1 (m), or compressedDepth",
    )
    depth_registered: bool = setting(
        True, "depth has colour's pixels (False: its own; depth_intrinsics and the like in [camera] place them)"
    )
    camera_info: str = setting("/camera/camera/color/camera_info", "sensor_msgs/CameraInfo of the colour pictures")
    rectified: bool = setting(
        False, "pictures are rectified (image_rect): their camera is P of camera_info, and they have no lens"
    )
    base_frame: str = setting("base_link", "frame of /tf_static at the vehicle's body, front-left-up")
    wrench_axes: str = choice("flu", "axes of the force sensor: front-left-up or front-right-down", ("flu", "frd"))
    wrench_on: str = choice(
        "tool", "whom the reported wrench acts on; a push reads +x on the tool", ("tool", "vehicle")
    )
    pair_s: float = setting(
        0.005,
        "largest difference of the stamps of colour and depth",
        unit="s",
        why="aligned ones agree",
        low=0.0,
        high=0.1,
    )

    def __post_init__(self) -> None:
        """Validate numbers, choices and names."""
        validate(self)
        for role in ACCEPTED:
            if getattr(self, role) or role not in OPTIONAL:
                check_name(role, getattr(self, role))

    def names(self, roles: tuple[str, ...]) -> dict[str, str]:
        """Topics by role; without those whose name is empty."""
        return {role: name for role in roles if (name := getattr(self, role))}


@dataclass(frozen=True, kw_only=True)
class Px4Topics(Topics):
    """Topics with PX4's inertial sensors and attitude, as uXRCE-DDS publishes them."""

    imu: str = setting("/fmu/out/sensor_combined", "as of Topics")
    attitude: str = setting("/fmu/out/vehicle_attitude", "as of Topics")
