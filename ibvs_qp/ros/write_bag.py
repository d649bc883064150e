"""Sensor frames to a bag of ROS 2."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.measurement import SensorFrame
from ibvs_qp.ros import pictures, samples
from ibvs_qp.ros.messages import CAMERA_INFO, IMAGE, IMU, WRENCH, encoded, typestore
from ibvs_qp.ros.topics import Topics

#: Version of the bag's format: read by ROS 2 Humble and later.
_VERSION = 8
STORAGES = ("mcap", "sqlite3")
_TYPES = {"imu": IMU, "wrench": WRENCH, "color": IMAGE, "depth": IMAGE, "camera_info": CAMERA_INFO}


def write_bag(
    frames: Iterable[SensorFrame], path: str | Path, topics: Topics | None = None, storage: str = "mcap"
) -> int:
    """Write frames as messages in ROS's axes; `ibvs_qp.ros.bag.sensor_frames` reads them back.

    Attitude, gyro and accelerometer are one ``sensor_msgs/Imu``, stamped by ``imu_stamp_ns``, or the tick. Wrench and
    pictures are written when they are new, one nanosecond before the tick that has them. Features are not written.

    Args:
        frames: Of the flight, in order.
        path: Folder of the bag; it must not exist.
        topics: Names, and axes of the force sensor; None for the defaults. The attitude is in the IMU's messages.
        storage: "mcap" or "sqlite3".

    Returns:
        Number of frames.

    Raises:
        ConfigError: When the folder exists or cannot be written, or an option is refused.
    """
    topics = topics or Topics()
    if storage not in STORAGES:
        raise out_of_range("storage", storage, "", f"allowed are {', '.join(STORAGES)}")
    if topics.attitude:
        raise out_of_range("attitude", topics.attitude, "", "it must be empty: a bag has the attitude in imu")
    store = typestore()
    from rosbags.rosbag2 import StoragePlugin, Writer, WriterError

    count, wrench_ns = 0, None
    try:
        with Writer(Path(path), version=_VERSION, storage_plugin=StoragePlugin[storage.upper()]) as writer:
            connections = {
                role: writer.add_connection(getattr(topics, role), name, typestore=store)
                for role, name in _TYPES.items()
            }

            def write(role: str, recorded_ns: int, value: object) -> None:
                writer.write(connections[role], recorded_ns, encoded(value, _TYPES[role]))

            for frame in frames:
                before = max(frame.stamp_ns - 1, 0)
                if frame.wrench_stamp_ns != wrench_ns:
                    wrench_ns = frame.wrench_stamp_ns
                    axes = topics.wrench_axes, topics.wrench_on
                    write("wrench", before, samples.to_wrench(wrench_ns, np.asarray(frame.wrench, float), *axes))
                if (image := frame.image) is not None:
                    info = pictures.from_intrinsics(image.intrinsics, image.rgb.shape, image.stamp_ns)
                    write("camera_info", before, info)
                    write("color", before, pictures.from_rgb(image.rgb, image.stamp_ns))
                    write("depth", before, pictures.from_depth(image.depth, image.stamp_ns))
                stamp = frame.stamp_ns if frame.imu_stamp_ns is None else frame.imu_stamp_ns
                vectors = frame.attitude, frame.angular_velocity, frame.specific_force
                write("imu", frame.stamp_ns, samples.to_imu(stamp, *vectors))
                count += 1
    except (WriterError, OSError) as error:
        raise ConfigError(f"cannot write the bag {path}: {error}") from None
    return count
