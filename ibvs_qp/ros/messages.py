"""Message types: those of ROS 2 Humble (the same in Jazzy where they are used), and a few of px4_msgs."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ibvs_qp.config.errors import ConfigError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

#: Definitions of px4_msgs, one file per message.
PX4_MSGS = Path(__file__).parent / "px4_msgs"
#: Longest array that is decoded [entries]: a depth picture of 4096 x 4096 px in floating point has so many bytes.
MOST_ENTRIES = 4 * 4096 * 4096

IMAGE, CAMERA_INFO, IMU = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/Imu"
WRENCH = "geometry_msgs/msg/WrenchStamped"
SENSOR_COMBINED, VEHICLE_ATTITUDE = "px4_msgs/msg/SensorCombined", "px4_msgs/msg/VehicleAttitude"


class BadMessage(ValueError):
    """A message that cannot be used; the text is one of few, whatever the message contains."""


@functools.cache
def typestore() -> Typestore:
    """All types, with their encoding in CDR.

    Raises:
        ConfigError: Without the extra ``ros``.
    """
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
    """A message of a type: ``message("px4_msgs/msg/OffboardControlMode", timestamp=1, ...)``; all fields are needed."""
    return typestore().types[name](**fields)


def decoded(data: bytes, name: str) -> Any:
    """A message from CDR.

    Raises:
        BadMessage: When the bytes are no such message.
    """
    try:
        return typestore().deserialize_cdr(data, name)
    except Exception:  # whatever a hostile sender makes the decoder meet
        raise BadMessage("undecodable") from None


def encoded(value: Any, name: str) -> bytes:
    """A message as little-endian CDR."""
    return bytes(typestore().serialize_cdr(value, name, little_endian=True))
