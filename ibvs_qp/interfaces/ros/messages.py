"""Message types of ROS 2 Humble (the same in Jazzy where they are used) and of px4_msgs, and their time stamps."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ibvs_qp.config.errors import ConfigError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

#: Definitions of px4_msgs, one file per message.
PX4_MSGS = Path(__file__).parent / "px4_msgs"
#: Longest array that is decoded [entries]: a depth picture of 4096 x 4096 px in floating point has so many bytes.
MOST_ENTRIES = 4 * 4096 * 4096
#: Nanoseconds per second and per microsecond; seconds of a ROS stamp have 31 bits [us].
_SECOND, _MICROSECOND, _LARGEST_US = 1_000_000_000, 1_000, 2**31 * 1_000_000

IMAGE, CAMERA_INFO, IMU = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/Imu"
COMPRESSED_IMAGE = "sensor_msgs/msg/CompressedImage"
WRENCH = "geometry_msgs/msg/WrenchStamped"
SENSOR_COMBINED, VEHICLE_ATTITUDE = "px4_msgs/msg/SensorCombined", "px4_msgs/msg/VehicleAttitude"


class BadMessage(ValueError):
    """A message that cannot be used; the text is one of few, for any contents of the message."""


@functools.cache
def typestore() -> Typestore:
    """All types, with their encoding in CDR; raises ConfigError without the extra ``ros``."""
    try:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    except ImportError:
        raise ConfigError("ROS messages need the extra ros: pip install -c constraints.txt -e '.[ros]'") from None
    store = get_typestore(Stores.ROS2_HUMBLE)
    for file in sorted(PX4_MSGS.glob("*.msg")):
        store.register(get_types_from_msg(file.read_text(encoding="utf-8"), f"px4_msgs/msg/{file.stem}"))
    store.max_sequence_length = MOST_ENTRIES
    return store


def message(name: str, **fields: Any) -> Any:
    """A message of a type: ``message("px4_msgs/msg/OffboardControlMode", timestamp=1)``; other fields are zero."""
    store = typestore()
    zeros = {field: _zero(kind) for field, kind in store.fielddefs[name][1] if field not in fields}
    return store.types[name](**fields, **zeros)


def _zero(description: Any) -> Any:
    """Zero of a field from its description by rosbags: (kind, details)."""
    from rosbags.interfaces import Nodetype

    kind, details = description
    if kind == Nodetype.NAME:
        return message(details)
    if kind == Nodetype.BASE:
        return {"bool": False, "string": ""}.get(details[0], 0)
    return np.zeros(details[1] if kind == Nodetype.ARRAY else 0, details[0][1][0])


def type_of(value: Any) -> str:
    """Type of a message, also of one of ROS's own Python classes: "sensor_msgs/msg/Imu"."""
    kind = type(value)
    return getattr(value, "__msgtype__", "") or f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"


def decoded(data: bytes, name: str) -> Any:
    """A message from CDR, or BadMessage."""
    try:
        return typestore().deserialize_cdr(data, name)
    except Exception:  # of the decoder, from hostile bytes
        raise BadMessage("undecodable") from None


def encoded(value: Any, name: str) -> bytes:
    """A message as little-endian CDR."""
    return bytes(typestore().serialize_cdr(value, name, little_endian=True))


def from_ros(stamp: Any) -> int:
    """Nanoseconds of a ``builtin_interfaces/Time``, or BadMessage."""
    if stamp.sec < 0 or not 0 <= stamp.nanosec < _SECOND:
        raise BadMessage("stamp out of range")
    return int(stamp.sec) * _SECOND + int(stamp.nanosec)


def from_px4(timestamp_us: int) -> int:
    """Nanoseconds of a time stamp of PX4, or BadMessage beyond the range of ROS's stamps."""
    if not 0 <= timestamp_us < _LARGEST_US:
        raise BadMessage("stamp out of range")
    return int(timestamp_us) * _MICROSECOND


def to_px4(stamp_ns: int) -> int:
    """Microseconds of a stamp, rounded down: never later than it was."""
    return stamp_ns // _MICROSECOND


def header(stamp_ns: int, frame_id: str) -> Any:
    """``std_msgs/Header`` of a stamp."""
    sec, nanosec = divmod(stamp_ns, _SECOND)
    stamp = message("builtin_interfaces/msg/Time", sec=sec, nanosec=nanosec)
    return message("std_msgs/msg/Header", stamp=stamp, frame_id=frame_id)
