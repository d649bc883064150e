"""Messages of inertial unit, attitude and force sensor to the vectors of a sensor frame, and back.

ROS's messages are in front-left-up and east-north-up, PX4's in front-right-down and north-east-down
(`ibvs_qp.axes`). ``linear_acceleration`` of ROS is what an accelerometer measures: +9.81 m/s^2 upwards at rest.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ibvs_qp.axes import swap_attitude, swap_vector
from ibvs_qp.ros.messages import IMU, SENSOR_COMBINED, VEHICLE_ATTITUDE, WRENCH, BadMessage, message
from ibvs_qp.ros.stamps import from_px4, from_ros, header

#: Largest difference of a quaternion's length from 1 [-].
LENGTH_ERROR = 0.01
#: First entry of a covariance whose quantity the IMU does not measure (REP 145).
ABSENT = -1.0
#: PX4's RELATIVE_TIMESTAMP_INVALID: there is no accelerometer.
NO_ACCELEROMETER = 0x7FFFFFFF
_UNKNOWN = np.zeros(9)


class Sample(NamedTuple):
    """Vectors of `ibvs_qp.SensorFrame` by name, and their time."""

    stamp_ns: int
    values: dict[str, np.ndarray]


def inertial(value: Any) -> Sample:
    """Angular velocity and specific force.

    Args:
        value: ``sensor_msgs/Imu`` or ``px4_msgs/SensorCombined``.

    Raises:
        BadMessage: When a number is not finite, or the message marks one of both as absent.
    """
    if value.__msgtype__ == SENSOR_COMBINED:
        if value.accelerometer_timestamp_relative == NO_ACCELEROMETER:
            raise BadMessage("accelerometer is invalid")
        vectors = {"angular_velocity": value.gyro_rad, "specific_force": value.accelerometer_m_s2}
        return Sample(from_px4(value.timestamp), {name: _finite(vector) for name, vector in vectors.items()})
    if ABSENT in (value.angular_velocity_covariance[0], value.linear_acceleration_covariance[0]):
        raise BadMessage("has no angular velocity or no linear acceleration")
    values = {
        "angular_velocity": swap_vector(_finite(_xyz(value.angular_velocity))),
        "specific_force": swap_vector(_finite(_xyz(value.linear_acceleration))),
    }
    return Sample(from_ros(value.header.stamp), values)


def attitude(value: Any) -> Sample:
    """Attitude of B in I.

    Args:
        value: ``px4_msgs/VehicleAttitude`` or ``sensor_msgs/Imu``.

    Raises:
        BadMessage: When it is no unit quaternion, or the message marks it as absent.
    """
    if value.__msgtype__ == VEHICLE_ATTITUDE:
        stamp, quaternion = from_px4(value.timestamp_sample), _unit(value.q)
    else:
        if value.orientation_covariance[0] == ABSENT:
            raise BadMessage("has no orientation")
        ros = value.orientation
        stamp, quaternion = from_ros(value.header.stamp), swap_attitude(_unit((ros.w, ros.x, ros.y, ros.z)))
    return Sample(stamp, {"attitude": quaternion})


def wrench(value: Any, axes: str, on: str) -> Sample:
    """Raw wrench of the vehicle on its tool, FRD.

    Args:
        value: ``geometry_msgs/WrenchStamped``.
        axes: "flu" or "frd", in which the sensor reports.
        on: "tool" if it reports the wrench of the vehicle on the tool, "vehicle" for the opposite.

    Raises:
        BadMessage: When a number is not finite.
    """
    vector = _finite((*_xyz(value.wrench.force), *_xyz(value.wrench.torque)))
    vector = swap_vector(vector) if axes == "flu" else vector
    return Sample(from_ros(value.header.stamp), {"wrench": vector if on == "tool" else -vector})


def to_imu(stamp_ns: int, quaternion: np.ndarray, rate: np.ndarray, force: np.ndarray) -> Any:
    """``sensor_msgs/Imu`` of attitude (w, x, y, z), angular velocity [rad/s] and specific force [m/s^2]."""
    w, x, y, z = swap_attitude(quaternion)
    return message(
        IMU,
        header=header(stamp_ns, "base_link"),
        orientation=message("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w),
        orientation_covariance=_UNKNOWN,
        angular_velocity=_vector3(swap_vector(rate)),
        angular_velocity_covariance=_UNKNOWN,
        linear_acceleration=_vector3(swap_vector(force)),
        linear_acceleration_covariance=_UNKNOWN,
    )


def to_wrench(stamp_ns: int, vector: np.ndarray, axes: str, on: str) -> Any:
    """``geometry_msgs/WrenchStamped`` of a raw wrench [N, N m], (6,); `wrench` restores it."""
    vector = swap_vector(vector) if axes == "flu" else np.asarray(vector, float)
    vector = vector if on == "tool" else -vector
    value = message("geometry_msgs/msg/Wrench", force=_vector3(vector[:3]), torque=_vector3(vector[3:]))
    return message(WRENCH, header=header(stamp_ns, "force_torque"), wrench=value)


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _vector3(vector: np.ndarray) -> Any:
    x, y, z = vector.tolist()
    return message("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


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
