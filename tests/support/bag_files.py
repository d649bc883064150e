"""Bags of ROS 2 for tests, written message by message."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, Writer

from ibvs_qp.interfaces.ros import samples
from ibvs_qp.interfaces.ros.bag import Bag
from ibvs_qp.interfaces.ros.messages import IMU, WRENCH, encoded, typestore
from ibvs_qp.interfaces.ros.topics import Topics

TICK, COUNT = 4_000_000, 100
REST = np.array([0.0, 0.0, -9.81])
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


class Log:
    """A file of ROS 2 messages."""

    def __init__(self, path: Path, **options: Any) -> None:
        self._stream = open(path, "wb")
        self._writer = Writer(self._stream, **({"compression": CompressionType.NONE} | options))
        self._writer.start(profile="ros2")

    def channel(self, topic: str, name: str, definition: str | None = None, **metadata: str) -> int:
        if definition is None:
            definition = typestore().generate_msgdef(name, ros_version=2)[0]
        schema = self._writer.register_schema(name, "ros2msg" if definition else "", definition.encode())
        return self._writer.register_channel(topic, "cdr", schema, metadata)

    def put(self, channel: int, time_ns: int, name: str, value: object, recorded_ns: int | None = None) -> None:
        recorded_ns = time_ns if recorded_ns is None else recorded_ns
        self._writer.add_message(channel, recorded_ns, encoded(value, name), recorded_ns)

    def close(self) -> None:
        self._writer.finish()
        self._stream.close()


def imu(stamp: int) -> object:
    return samples.to_imu(stamp, LEVEL, np.zeros(3), REST)


def wrench(stamp: int) -> object:
    return samples.to_wrench(stamp, np.zeros(6), "flu", "tool")


def rest(path: Path, first: int = 0, count: int = COUNT, channels: int = 1, **options: Any) -> Path:
    """A vehicle at rest; the IMU's messages take turns on so many channels, each of a QoS of its own."""
    log = Log(path, **options)
    force = log.channel("/ft_sensor/wrench", WRENCH)
    inertial = [log.channel("/imu/data", IMU, offered_qos_profiles=str(each)) for each in range(channels)]
    for tick in range(first, first + count):
        log.put(force, (tick + 1) * TICK - 1, WRENCH, wrench((tick + 1) * TICK - 1))
        log.put(inertial[tick % channels], (tick + 1) * TICK, IMU, imu((tick + 1) * TICK))
    log.close()
    return path


def frames(path: Path, topics: Topics | None = None) -> tuple[int, dict[str, int], list[str]]:
    """Frames, messages left out, and differences of a bag; the differences are warnings as well."""
    bag = Bag(path, topics)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        count = len(list(bag.sensor_frames()))
    assert [str(each.message) for each in found] == [f"{path}: {each}" for each in bag.differences]
    return count, dict(bag.held.ignored), bag.differences
