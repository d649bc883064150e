"""DDS of queues in one process, and the bytes of good messages."""

from __future__ import annotations

import numpy as np

from ibvs_qp.ros.messages import SENSOR_COMBINED, VEHICLE_ATTITUDE, WRENCH, encoded, message
from ibvs_qp.ros.samples import to_wrench

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
    fields: dict[str, object] = {
        "timestamp": stamp_ns // 1000,
        "gyro_rad": np.zeros(3, np.float32),
        "gyro_integral_dt": 4000,
        "accelerometer_timestamp_relative": 0,
        "accelerometer_m_s2": np.array([0, 0, -9.81], np.float32),
        "accelerometer_integral_dt": 4000,
        "accelerometer_clipping": 0,
        "gyro_clipping": 0,
        "accel_calibration_count": 0,
        "gyro_calibration_count": 0,
    }
    return encoded(message(SENSOR_COMBINED, **(fields | changes)), SENSOR_COMBINED)


def attitude(stamp_ns: int) -> bytes:
    q = np.array([1, 0, 0, 0], np.float32)
    fields = {"timestamp": stamp_ns // 1000, "timestamp_sample": stamp_ns // 1000, "quat_reset_counter": 0}
    return encoded(message(VEHICLE_ATTITUDE, q=q, delta_q_reset=np.zeros(4, np.float32), **fields), VEHICLE_ATTITUDE)


def mode(armed: int, offboard: int, more: int = 10, stamp_ns: int = NOW) -> bytes:
    return b"\0\1\0\0" + (stamp_ns // 1000).to_bytes(8, "little") + bytes((armed, 0, 1, 0, offboard)) + bytes(more)


def wrench(stamp_ns: int) -> bytes:
    return encoded(to_wrench(stamp_ns, np.arange(6.0), "flu", "tool"), WRENCH)
