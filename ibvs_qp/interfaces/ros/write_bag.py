"""Sensor frames to a bag of ROS 2."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.interfaces.ros import pictures, samples
from ibvs_qp.interfaces.ros.messages import encoded, typestore
from ibvs_qp.interfaces.ros.topics import ACCEPTED, CAMERA, Topics
from ibvs_qp.measurement import SensorFrame, channels

#: Version of the bag's format: read by ROS 2 Humble and later.
_VERSION = 8
STORAGES = ("mcap", "sqlite3")
#: Topics of a bag: the attitude is in the IMU's messages.
_WRITTEN = ("imu", *samples.WRITERS, *CAMERA)


def write_bag(
    frames: Iterable[SensorFrame], path: str | Path, topics: Topics | None = None, storage: str = "mcap"
) -> int:
    """Write frames as messages in ROS's axes; `ibvs_qp.interfaces.ros.bag.sensor_frames` reads them back.

    Attitude, gyro and accelerometer are one ``sensor_msgs/Imu``, stamped by ``imu_stamp_ns``, or the tick. Other
    samples and pictures are written when they are new, one nanosecond before the tick that has them. Features are not
    written, nor pictures without a topic of colour.

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

    count, last_ns, names = 0, dict[str, int](), topics.names(_WRITTEN)
    try:
        with Writer(Path(path), version=_VERSION, storage_plugin=StoragePlugin[storage.upper()]) as writer:
            connections = {
                role: writer.add_connection(name, ACCEPTED[role][0], typestore=store) for role, name in names.items()
            }

            def write(role: str, recorded_ns: int, value: object) -> None:
                writer.write(connections[role], recorded_ns, encoded(value, ACCEPTED[role][0]))

            for frame in frames:
                before = max(frame.stamp_ns - 1, 0)
                for role, to_message in samples.WRITERS.items():
                    taken, vector = _taken_ns(frame, role), getattr(frame, role)
                    if role in names and vector is not None and taken != last_ns.get(role):
                        last_ns[role] = taken
                        write(role, before, to_message(taken, vector, topics))
                if (image := frame.image) is not None and topics.color:
                    info = pictures.from_intrinsics(image.intrinsics, image.rgb.shape, image.stamp_ns)
                    write("camera_info", before, info)
                    write("color", before, pictures.from_rgb(image.rgb, image.stamp_ns))
                    write("depth", before, pictures.from_depth(image.depth, image.stamp_ns))
                vectors = frame.attitude, frame.angular_velocity, frame.specific_force
                write("imu", frame.stamp_ns, samples.to_imu(_taken_ns(frame, "specific_force"), *vectors))
                count += 1
    except (WriterError, OSError) as error:
        raise ConfigError(f"cannot write the bag {path}: {error}") from None
    return count


def _taken_ns(frame: SensorFrame, name: str) -> int:
    """Time of a channel's sample."""
    stamp = getattr(frame, channels(SensorFrame)[name].stamp)
    return frame.stamp_ns if stamp is None else stamp
