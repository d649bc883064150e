"""Time stamps of ROS (seconds and nanoseconds) and PX4 (microseconds) to and from nanoseconds."""

from __future__ import annotations

from typing import Any

from ibvs_qp.ros.messages import BadMessage, message

#: Nanoseconds per second and per microsecond.
_SECOND, _MICROSECOND = 1_000_000_000, 1_000
#: Seconds of a ROS stamp have 31 bits, so microseconds of PX4 beyond this are no time [us].
_LARGEST_US = 2**31 * 1_000_000


def from_ros(stamp: Any) -> int:
    """Nanoseconds of a ``builtin_interfaces/Time``.

    Raises:
        BadMessage: When the seconds are negative, or the nanoseconds a second or more.
    """
    if stamp.sec < 0 or not 0 <= stamp.nanosec < _SECOND:
        raise BadMessage("stamp out of range")
    return int(stamp.sec) * _SECOND + int(stamp.nanosec)


def to_ros(stamp_ns: int) -> Any:
    """``builtin_interfaces/Time`` of nanoseconds."""
    sec, nanosec = divmod(stamp_ns, _SECOND)
    return message("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)


def from_px4(timestamp_us: int) -> int:
    """Nanoseconds of a time stamp of PX4.

    Raises:
        BadMessage: When it is beyond the range of ROS's stamps.
    """
    if not 0 <= timestamp_us < _LARGEST_US:
        raise BadMessage("stamp out of range")
    return int(timestamp_us) * _MICROSECOND


def to_px4(stamp_ns: int) -> int:
    """Microseconds of a stamp, rounded down: never later than it was."""
    return stamp_ns // _MICROSECOND


def header(stamp_ns: int, frame_id: str) -> Any:
    """``std_msgs/Header`` of a stamp."""
    return message("std_msgs/msg/Header", stamp=to_ros(stamp_ns), frame_id=frame_id)
