"""Bags of ROS 2 (rosbag2 in SQLite or MCAP) as sensor frames or pictures."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ibvs_qp.command import Command
from ibvs_qp.config.errors import ConfigError, shown
from ibvs_qp.interfaces.ros.latest_samples import LatestSamples
from ibvs_qp.interfaces.ros.open_bag import OpenBag
from ibvs_qp.interfaces.ros.topics import ACCEPTED, CAMERA, SAMPLES, Topics
from ibvs_qp.measurement import RgbdFrame, SensorFrame
from ibvs_qp.pilot import Pilot

if TYPE_CHECKING:
    from rosbags.interfaces import Connection

#: A message of the IMU makes no frame if the last frame is younger than this ratio of a tick: faster IMUs are thinned.
LEAST_RATIO = 0.75


class Bag:
    """A recorded flight.

    Messages are taken in the order in which they were recorded. Every message of the IMU makes a frame with its stamp,
    and holds the last samples of the others that were recorded before it; a picture goes with the first frame after
    both of its parts (`ibvs_qp.interfaces.ros.latest_samples.LatestSamples`).

    Attributes:
        held: Samples of the last pass, with the messages that were left out.

    Args:
        path: Folder with metadata.yaml, or a single file .mcap or .db3.
        topics: Names and axes of the topics; None for the defaults.
    """

    def __init__(self, path: str | Path, topics: Topics | None = None) -> None:
        self.path, self.topics = Path(path), topics or Topics()
        self.held = LatestSamples(self.topics)

    def sensor_frames(self, period_s: float = 0.004, distortion: tuple[float, ...] = ()) -> Iterator[SensorFrame]:
        """Frames for `ibvs_qp.Pilot.step`; without pictures where the bag has no topic of colour.

        Args:
            period_s: Tick of the controller [s].
            distortion: Coefficients of the lens that the pilot rectifies [-]: its ``camera.distortion``.

        Raises:
            ConfigError: When the bag cannot be read, lacks a topic, has one of another type, or has another lens.
        """
        least_ns, last = round(LEAST_RATIO * 1e9 * period_s), None
        for role in self._pass(SAMPLES, CAMERA):
            camera = self.held.camera
            if role == "camera_info" and camera is not None and not camera.has_lens(distortion):
                raise ConfigError(
                    f"{self.path}: the lens of camera_info has distortion {camera.distortion}, not {distortion}: set "
                    "the pilot's camera.distortion, and the argument distortion of sensor_frames"
                )
            if role != "imu":
                continue
            stamp = self.held.last["imu"].stamp_ns
            if last is not None and 0 <= stamp - last < least_ns:
                continue
            if (frame := self.held.frame(stamp)) is not None:
                last = stamp
                yield frame

    def pictures(self) -> Iterator[RgbdFrame]:
        """Pictures in their order, as taken: ``held.camera`` has the lens.

        Raises:
            ConfigError: As `sensor_frames`.
        """
        for _ in self._pass(CAMERA):
            if (picture := self.held.take_picture()) is not None:
                yield picture

    def _pass(self, roles: tuple[str, ...], camera: tuple[str, ...] = ()) -> Iterator[str]:
        """Roles of all usable messages, each after its message was added to the held samples.

        Args:
            roles: Roles to read.
            camera: Further ones, where the bag has the topic of the colour pictures.
        """
        self.held = LatestSamples(self.topics)
        with contextlib.closing(OpenBag(self.path)) as reader:
            if any(each.topic == self.topics.color for each in reader.connections):
                roles = (*roles, *camera)
            chosen = {role: self._connection(reader, role, name) for role, name in self.topics.names(roles).items()}
            for connection, data in reader.messages(list(chosen.values())):
                for role in (role for role, each in chosen.items() if each.topic == connection.topic):
                    try:
                        value = reader.deserialize(data, connection.msgtype)
                    except Exception:
                        self.held.ignore(role, "undecodable")
                        continue
                    if self.held.add(role, value):
                        yield role

    def _connection(self, reader: OpenBag, role: str, name: str) -> Connection:
        """Connection of a topic; ConfigError where the bag has none, or one of another type."""
        types = " or ".join(kind.replace("/msg/", "/") for kind in ACCEPTED[role])
        found = next((each for each in reader.connections if each.topic == name), None)
        if found is None:
            near = sorted({each.topic for each in reader.connections if each.msgtype in ACCEPTED[role]})
            hint = f"of such a type are {', '.join(near)}" if near else "no topic has such a type"
            raise ConfigError(f"{self.path}: no topic {name} for {role} ({types}); {hint}")
        if found.msgtype not in ACCEPTED[role]:
            raise ConfigError(f"{self.path}: topic {name} for {role} has type {shown(found.msgtype)}, not {types}")
        return found


def sensor_frames(path: str | Path, topics: Topics | None = None) -> Iterator[SensorFrame]:
    """Sensor frames of a bag; `Bag.sensor_frames`."""
    return Bag(path, topics).sensor_frames()


def commands(frames: Iterable[SensorFrame], pilot: Pilot) -> Iterator[tuple[SensorFrame, Command]]:
    """Each frame with the pilot's command, open loop: the next frame contains the recorded motion anyway.

    Args:
        frames: Of a bag, or any others.
        pilot: A pilot as after construction; perception is loaded at the first picture.
    """
    prepared = False
    for frame in frames:
        if frame.image is not None and not prepared:
            pilot.prepare(frame.image)
            prepared = True
        yield frame, pilot.step(frame)
