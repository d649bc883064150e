"""Bags of ROS 2 (rosbag2 in SQLite or MCAP) as sensor frames or pictures."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Generator, Iterable, Iterator
from pathlib import Path

from ibvs_qp.command import Command
from ibvs_qp.config.errors import ConfigError, shown
from ibvs_qp.interfaces.ros.latest_samples import LatestSamples
from ibvs_qp.interfaces.ros.recording import Recording
from ibvs_qp.interfaces.ros.static_poses import TF, TF_TOPIC, StaticPoses
from ibvs_qp.interfaces.ros.topics import ACCEPTED, CAMERA, SAMPLES, Topics
from ibvs_qp.measurement import RgbdFrame, SensorFrame
from ibvs_qp.pilot import Pilot

#: A message of the IMU makes no frame if the last frame is younger than this ratio of a tick: faster IMUs are thinned.
LEAST_RATIO = 0.75


class Bag:
    """A recorded flight.

    Messages are taken in the order in which they were recorded. Every message of the IMU makes a frame with its stamp,
    and holds the last samples of the others that were recorded before it; a picture goes with the first frame after
    both of its parts (`ibvs_qp.interfaces.ros.latest_samples.LatestSamples`).

    A message of the IMU that is not newer than the last frame makes none. Messages left out are counted in
    ``held.ignored``. Differences of the bag from its own statements are in ``differences``, and warnings at the end of
    a pass.

    Attributes:
        held: Samples of the last pass, with the messages that were left out.
        differences: Of the last whole pass, in words: counts that differ from those stated, missing or cut files.
        frame_ids: Frames of the sensors in the last pass, by role.
        poses: Of the last pass: tree of ``/tf_static``.

    Args:
        path: Folder of the bag, or a single file in MCAP or SQLite.
        topics: Names and axes of the topics; None for the defaults.
    """

    def __init__(self, path: str | Path, topics: Topics | None = None) -> None:
        self.path, self.topics = Path(path), topics or Topics()
        self.held, self.differences = LatestSamples(self.topics), list[str]()
        self.frame_ids, self.poses = dict[str, str](), StaticPoses()

    def sensor_frames(
        self, period_s: float = 0.004, distortion: tuple[float, ...] = ()
    ) -> Generator[SensorFrame, None, None]:
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
                    "the pilot's camera.distortion, and the argument distortion of sensor_frames, or 'rectified' of "
                    "Topics if the pictures have no lens any more"
                )
            if role != "imu":
                continue
            stamp = self.held.last["imu"].stamp_ns
            if last is not None and 0 <= stamp - last < least_ns:
                self.held.ignore("imu", "faster than the tick")
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
        self.held, self.differences, self.frame_ids = LatestSamples(self.topics), [], {}
        self.poses = StaticPoses()
        with contextlib.closing(Recording(self.path)) as recording:
            color = self.topics.color
            # A colour topic that was named must be there; without the default one a bag has no pictures.
            named = color != type(self.topics)().color
            if color and (named or any(each.topic == color for each in recording.channels)):
                roles = (*roles, *camera)
            names = self.topics.names(roles)
            for role, name in names.items():
                self._check(recording, role, name)
            unread = self._near(recording, "color") if camera and color and "color" not in names else []
            for message in recording.messages({*names.values(), TF_TOPIC}):
                if message.channel.topic == TF_TOPIC and message.channel.type_name == TF:
                    with contextlib.suppress(Exception):
                        self.poses.add(recording.decode(message))
                for role in (role for role, name in names.items() if name == message.channel.topic):
                    if message.channel.type_name not in ACCEPTED[role]:
                        self.held.ignore(role, "type is another one")
                        continue
                    try:
                        value = recording.decode(message)
                    except Exception:
                        self.held.ignore(role, "undecodable")
                        continue
                    if self.held.add(role, value):
                        if role not in self.frame_ids:
                            self.frame_ids[role] = str(getattr(getattr(value, "header", None), "frame_id", ""))
                        yield role
            self.held.finish()
            self.differences = recording.differences
            if unread:
                self.differences.append(
                    f"no pictures: no topic {color} for color; of such a type are {', '.join(unread)}"
                )
        for each in self.differences:
            warnings.warn(f"{self.path}: {each}", stacklevel=3)

    def _check(self, recording: Recording, role: str, name: str) -> None:
        """ConfigError where the bag has no such topic, or only of another type."""
        types = " or ".join(kind.replace("/msg/", "/") for kind in ACCEPTED[role])
        found = [each.type_name for each in recording.channels if each.topic == name]
        if not found:
            near = self._near(recording, role)
            hint = f"of such a type are {', '.join(near)}" if near else "no topic has such a type"
            raise ConfigError(f"{self.path}: no topic {name} for {role} ({types}); {hint}")
        if not set(found) & set(ACCEPTED[role]):
            raise ConfigError(f"{self.path}: topic {name} for {role} has type {shown(found[0])}, not {types}")

    @staticmethod
    def _near(recording: Recording, role: str) -> list[str]:
        """Topics of a type that the role may have."""
        return sorted({each.topic for each in recording.channels if each.type_name in ACCEPTED[role]})


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
