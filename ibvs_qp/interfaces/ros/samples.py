"""Messages of inertial unit, attitude and force sensor to the vectors of a sensor frame, and back.

ROS's messages are in front-left-up and east-north-up, PX4's in front-right-down and north-east-down
(`ibvs_qp.axes`). ``linear_acceleration`` of ROS is the specific force of an accelerometer: +9.81 m/s^2 upwards at rest.
A message with a number that is not finite, or whose sender marks the quantity as absent, raises BadMessage.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ibvs_qp.axes import swap_attitude, swap_vector
from ibvs_qp.interfaces.ros.messages import (
    IMU,
    SENSOR_COMBINED,
    VEHICLE_ATTITUDE,
    WRENCH,
    BadMessage,
    from_px4,
    from_ros,
    header,
    message,
    type_of,
)
from ibvs_qp.interfaces.ros.topics import TWIST, Topics

#: Largest difference of a quaternion's length from 1 [-].
LENGTH_ERROR = 0.01
#: First entry of a covariance whose quantity the IMU does not measure (REP 145).
ABSENT = -1.0
#: PX4's RELATIVE_TIMESTAMP_INVALID: there is no accelerometer.
NO_ACCELEROMETER = 0x7FFFFFFF


class Sample(NamedTuple):
    """Vectors of `ibvs_qp.SensorFrame` by name, and their time."""

    stamp_ns: int
    values: dict[str, Any]


def inertial(value: Any) -> Sample:
    """Angular velocity and specific force of a ``sensor_msgs/Imu`` or ``px4_msgs/SensorCombined``."""
    if type_of(value) == SENSOR_COMBINED:
        if value.accelerometer_timestamp_relative == NO_ACCELEROMETER:
            raise BadMessage("accelerometer is invalid")
        stamp, rate, force = from_px4(value.timestamp), _finite(value.gyro_rad), _finite(value.accelerometer_m_s2)
    else:
        if ABSENT in (value.angular_velocity_covariance[0], value.linear_acceleration_covariance[0]):
            raise BadMessage("has no angular velocity or no linear acceleration")
        rate, force = (swap_vector(_finite(_xyz(each))) for each in (value.angular_velocity, value.linear_acceleration))
        stamp = from_ros(value.header.stamp)
    return Sample(stamp, {"angular_velocity": rate, "specific_force": force})


def attitude(value: Any) -> Sample:
    """Attitude of B in I of a ``px4_msgs/VehicleAttitude`` or ``sensor_msgs/Imu``."""
    if type_of(value) == VEHICLE_ATTITUDE:
        return Sample(from_px4(value.timestamp_sample), {"attitude": _unit(value.q)})
    ros = getattr(value, "orientation", None)  # SensorCombined has none
    if ros is None or value.orientation_covariance[0] == ABSENT or not any((ros.w, ros.x, ros.y, ros.z)):
        raise BadMessage("has no orientation: name a topic as attitude, or set attitude_filter_s")
    return Sample(from_ros(value.header.stamp), {"attitude": swap_attitude(_unit((ros.w, ros.x, ros.y, ros.z)))})


def wrench(value: Any, axes: str, on: str) -> Sample:
    """Raw wrench of the vehicle on its tool, FRD, of a ``geometry_msgs/WrenchStamped``.

    Args:
        value: The message.
        axes: "flu" or "frd", in which the sensor reports.
        on: "tool" if it reports the wrench of the vehicle on the tool, "vehicle" for the opposite.
    """
    vector = _finite((*_xyz(value.wrench.force), *_xyz(value.wrench.torque)))
    return Sample(from_ros(value.header.stamp), {"wrench": _convention(vector, axes, on)})


def height_rate(value: Any) -> Sample:
    """Rate of climb of a ``geometry_msgs/TwistStamped``: z upwards, as in ROS's world."""
    return Sample(from_ros(value.header.stamp), {"height_rate": _finite([value.twist.linear.z]).item()})


def to_imu(stamp_ns: int, quaternion: np.ndarray, rate: np.ndarray, force: np.ndarray) -> Any:
    """``sensor_msgs/Imu`` of attitude (w, x, y, z), angular velocity [rad/s] and specific force [m/s^2]."""
    w, x, y, z = swap_attitude(quaternion)
    return message(
        IMU,
        header=header(stamp_ns, "base_link"),
        orientation=message("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w),
        angular_velocity=_vector3(swap_vector(rate)),
        linear_acceleration=_vector3(swap_vector(force)),
    )


def to_wrench(stamp_ns: int, vector: np.ndarray, axes: str, on: str) -> Any:
    """``geometry_msgs/WrenchStamped`` of a raw wrench [N, N m], (6,); `wrench` restores it."""
    vector = _convention(np.asarray(vector, float), axes, on)
    value = message("geometry_msgs/msg/Wrench", force=_vector3(vector[:3]), torque=_vector3(vector[3:]))
    return message(WRENCH, header=header(stamp_ns, "force_torque"), wrench=value)


def to_twist(stamp_ns: int, climb: float) -> Any:
    """``geometry_msgs/TwistStamped`` of a rate of climb [m/s]."""
    value = message("geometry_msgs/msg/Twist", linear=_vector3(np.array((0.0, 0.0, climb))))
    return message(TWIST, header=header(stamp_ns, "map"), twist=value)


#: Sample of a message of every role.
READERS: dict[str, Callable[[Any, Topics], Sample]] = {
    "imu": lambda value, topics: inertial(value),
    "attitude": lambda value, topics: attitude(value),
    "wrench": lambda value, topics: wrench(value, topics.wrench_axes, topics.wrench_on),
    "height_rate": lambda value, topics: height_rate(value),
}
#: Message of a channel of a frame by its role and its time, beside those of the IMU.
WRITERS: dict[str, Callable[[int, Any, Topics], Any]] = {
    "wrench": lambda stamp_ns, vector, topics: to_wrench(stamp_ns, vector, topics.wrench_axes, topics.wrench_on),
    "height_rate": lambda stamp_ns, climb, topics: to_twist(stamp_ns, climb),
}


def _convention(vector: np.ndarray, axes: str, on: str) -> np.ndarray:
    """A wrench in FRD on the tool in the sensor's axes and sign, or back."""
    vector = swap_vector(vector) if axes == "flu" else vector
    return vector if on == "tool" else -vector


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _vector3(vector: np.ndarray) -> Any:
    return message("geometry_msgs/msg/Vector3", **dict(zip("xyz", vector.tolist(), strict=True)))


def _finite(vector: Any) -> np.ndarray:
    array = np.array(vector, float)
    if not np.isfinite(array).all():
        raise BadMessage("not finite")
    return array


def _unit(quaternion: Any) -> np.ndarray:
    array = _finite(quaternion)
    if abs(float(np.linalg.norm(array)) - 1.0) > LENGTH_ERROR:
        raise BadMessage("no unit quaternion")
    return array
