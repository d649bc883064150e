"""DDS of queues in one process, and the bytes of good messages."""

from __future__ import annotations

import numpy as np

from ibvs_qp.interfaces.ros.messages import (
    CAMERA_INFO,
    IMAGE,
    SENSOR_COMBINED,
    VEHICLE_ATTITUDE,
    WRENCH,
    encoded,
    message,
)
from ibvs_qp.interfaces.ros.pictures import from_depth, from_intrinsics, from_rgb
from ibvs_qp.interfaces.ros.samples import to_wrench

NOW = 1_700_000_000_000_000_000


class Queue:
    """A reader, and a participant of nothing but readers."""

    def __init__(self) -> None:
        self.data: list[bytes] = []
        self.readers: dict[str, Queue] = {}

    def reader(self, topic: str, name: str, depth: int) -> Queue:
        return self.readers.setdefault(topic, Queue())

    def take(self) -> list[bytes]:
        data, self.data = self.data, []
        return data

    def writer(self, topic: str, name: str) -> Queue:
        return self.readers.setdefault(topic, Queue())

    def write(self, value: object) -> None:
        self.data.append(value)  # type: ignore[arg-type]


def combined(stamp_ns: int, **changes: object) -> bytes:
    fields = {"timestamp": stamp_ns // 1000, "accelerometer_m_s2": np.array([0, 0, -9.81], np.float32)}
    return encoded(message(SENSOR_COMBINED, **(fields | changes)), SENSOR_COMBINED)


def attitude(stamp_ns: int) -> bytes:
    q, us = np.array([1, 0, 0, 0], np.float32), stamp_ns // 1000
    return encoded(message(VEHICLE_ATTITUDE, q=q, timestamp=us, timestamp_sample=us), VEHICLE_ATTITUDE)


def mode(armed: int, offboard: int, more: int = 10, stamp_ns: int = NOW) -> bytes:
    return b"\0\1\0\0" + (stamp_ns // 1000).to_bytes(8, "little") + bytes((armed, 0, 1, 0, offboard)) + bytes(more)


def wrench(stamp_ns: int) -> bytes:
    return encoded(to_wrench(stamp_ns, np.arange(6.0), "flu", "tool"), WRENCH)


def color(stamp_ns: int, shape: tuple[int, int] = (4, 6)) -> bytes:
    return encoded(from_rgb(np.zeros((*shape, 3), np.uint8), stamp_ns), IMAGE)


def depth(stamp_ns: int, shape: tuple[int, int] = (4, 6)) -> bytes:
    return encoded(from_depth(np.ones(shape, np.float32), stamp_ns), IMAGE)


def camera_info(stamp_ns: int, shape: tuple[int, int] = (4, 6), lens: str = "plumb_bob") -> bytes:
    info = from_intrinsics((9.0, 9.0, 2.0, 1.0), shape, stamp_ns)
    info.distortion_model = lens
    return encoded(info, CAMERA_INFO)
