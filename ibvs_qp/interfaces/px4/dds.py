"""DDS topics as ROS 2 names them, with samples as bytes; this module decodes none of them."""

from __future__ import annotations

import functools
from typing import Any

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.interfaces.ros.messages import encoded, typestore

#: Samples that wait between two ticks: pictures are large, everything else is read in bursts.
PICTURE_DEPTH, SAMPLE_DEPTH = 4, 64


def dds_topic(name: str) -> str:
    """Name of a ROS 2 topic in DDS: "/fmu/in/actuator_motors" is "rt/fmu/in/actuator_motors"."""
    return f"rt{name}"


def dds_type(name: str) -> str:
    """Name of a ROS 2 type in DDS: "px4_msgs/msg/ActuatorMotors" is "px4_msgs::msg::dds_::ActuatorMotors_"."""
    package, kind, message = name.split("/")
    return f"{package}::{kind}::dds_::{message}_"


class Participant:
    """Readers and writers in one DDS domain, all best effort, volatile and of the last samples, as PX4's.

    Args:
        domain_id: ROS_DOMAIN_ID. CYCLONEDDS_URI configures the network (docs/px4.md).

    Raises:
        ConfigError: Without the extra ``dds``, or when DDS cannot start.
    """

    def __init__(self, domain_id: int) -> None:
        try:
            from cyclonedds.core import DDSException
            from cyclonedds.domain import DomainParticipant
        except ImportError:
            raise ConfigError("the bridge needs the extra dds: pip install -c constraints.txt -e '.[dds]'") from None
        try:
            self._participant = DomainParticipant(domain_id)
        except DDSException as error:
            raise ConfigError(f"DDS cannot start in domain {domain_id} ({error}); see CYCLONEDDS_URI") from None

    def reader(self, topic: str, name: str, depth: int = SAMPLE_DEPTH) -> Reader:
        """Reader of a ROS 2 topic and type, with the last ``depth`` samples."""
        from cyclonedds.sub import DataReader

        return Reader(DataReader(self._participant, self._topic(topic, name), qos=_qos(depth)), depth)

    def writer(self, topic: str, name: str) -> Writer:
        """Writer of a ROS 2 topic and type."""
        from cyclonedds.pub import DataWriter

        return Writer(DataWriter(self._participant, self._topic(topic, name), qos=_qos(1)), name)

    def _topic(self, topic: str, name: str) -> Any:
        from cyclonedds.topic import Topic

        return Topic(self._participant, dds_topic(topic), raw_type(name))


class Reader:
    """Reads samples as bytes."""

    def __init__(self, reader: Any, depth: int) -> None:
        self._reader, self._depth = reader, depth

    def take(self) -> list[bytes]:
        """The samples since the last call, as received, headers of CDR included."""
        return [sample.data for sample in self._reader.take(self._depth) if hasattr(sample, "data")]


class Writer:
    """Writes messages of one type."""

    def __init__(self, writer: Any, name: str) -> None:
        self._writer, self._name = writer, name

    def write(self, message: Any) -> None:
        """Write a message of `ibvs_qp.interfaces.ros.messages`."""
        self.write_bytes(encoded(message, self._name))

    def write_bytes(self, data: bytes) -> None:
        """Write bytes as CDR."""
        self._writer.write(raw_type(self._name)(data))


@functools.cache
def raw_type(name: str) -> Any:
    """The type of a message for DDS, whose samples keep the bytes in ``data``."""
    kind = _struct(name)

    def keep(self: Any, data: bytes) -> None:
        self.data = bytes(data)

    kind.__init__, kind.serialize = keep, lambda self, **_: self.data
    kind.deserialize = classmethod(lambda _, data, **__: kind(data))
    kind.deserialize_key = classmethod(lambda *_, **__: None)
    return kind


def _struct(name: str) -> Any:
    from cyclonedds.idl import make_idl_struct

    fields = {field: _idl(description) for field, description in typestore().fielddefs[name][1]}
    return make_idl_struct(name.split("/")[2] + "_", dds_type(name).replace("::", "."), fields, dataclassify=False)


def _idl(description: Any) -> Any:
    """Type of a field in IDL from its description by rosbags: (kind, details)."""
    from cyclonedds.idl import types
    from rosbags.interfaces import Nodetype

    kind, details = description
    if kind == Nodetype.BASE:
        return {"bool": bool, "string": str}.get(details[0]) or getattr(types, details[0])
    if kind == Nodetype.NAME:
        return _struct(details)
    element, size = _idl(details[0]), details[1]
    return types.array[element, size] if kind == Nodetype.ARRAY else types.sequence[element]


def _qos(depth: int) -> Any:
    from cyclonedds.qos import Policy, Qos

    return Qos(
        Policy.Reliability.BestEffort,
        Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )
