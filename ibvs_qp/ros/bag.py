"""Bags of ROS 2 (rosbag2 in SQLite or MCAP) as sensor frames or pictures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ibvs_qp.command import Command
from ibvs_qp.config.errors import ConfigError, shown
from ibvs_qp.config.files import open_regular
from ibvs_qp.measurement import RgbdFrame, SensorFrame
from ibvs_qp.pilot import Pilot
from ibvs_qp.ros.held import HeldSamples
from ibvs_qp.ros.messages import typestore
from ibvs_qp.ros.topics import ACCEPTED, CAMERA, MOTION, Topics

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader
    from rosbags.interfaces import Connection

#: Largest metadata and data file of a bag [bytes]: half a terabyte holds three hours of raw pictures.
LARGEST_METADATA, LARGEST_DATA = 4 << 20, 1 << 39
#: An IMU's message makes a frame unless the last frame is younger than this share of a tick: faster IMUs are thinned.
LEAST_SHARE = 0.75
_METADATA = "metadata.yaml"


class Bag:
    """A recorded flight.

    Messages are taken in the order in which they were recorded. Every message of the IMU makes a frame with its stamp,
    and holds the last samples of the others that were recorded before it; a picture goes with the first frame after
    both of its parts (`ibvs_qp.ros.held.HeldSamples`).

    Attributes:
        held: Samples of the last pass, with the messages that were left out.

    Args:
        path: Folder with metadata.yaml, or a single file .mcap or .db3.
        topics: Which topic carries what; None for the defaults.
    """

    def __init__(self, path: str | Path, topics: Topics | None = None) -> None:
        self.path, self.topics = Path(path), topics or Topics()
        self.held = HeldSamples(self.topics)

    def sensor_frames(self, period_s: float = 0.004) -> Iterator[SensorFrame]:
        """Frames for `ibvs_qp.Pilot.step`.

        Args:
            period_s: Tick of the controller [s].

        Raises:
            ConfigError: When the bag cannot be read, lacks a topic, or has one of another type.
        """
        least_ns, last = round(LEAST_SHARE * 1e9 * period_s), None
        optional = CAMERA if self._has_pictures() else ()
        for role, _ in self._pass((*MOTION, *optional)):
            if role != "imu":
                continue
            stamp = self.held.last["imu"].stamp_ns
            if last is not None and 0 <= stamp - last < least_ns:
                continue
            if (frame := self.held.frame(stamp)) is not None:
                last = stamp
                yield frame

    def pictures(self) -> Iterator[RgbdFrame]:
        """Pictures in their order.

        Raises:
            ConfigError: As `sensor_frames`.
        """
        for _ in self._pass(CAMERA):
            if (picture := self.held.take_picture()) is not None:
                yield picture

    def _pass(self, roles: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
        """Every usable message of the roles, after it was added to the held samples."""
        self.held = HeldSamples(self.topics)
        with _Open(self.path) as reader:
            chosen = self._connections(reader, roles)
            for connection, data in reader.messages([each for each, _ in chosen.values()]):
                for role in (role for each, role in chosen.values() if each.topic == connection.topic):
                    try:
                        value = reader.deserialize(data, connection.msgtype)
                    except Exception:
                        self.held.ignore(role, "undecodable")
                        continue
                    if self.held.add(role, value):
                        yield role, value

    def _has_pictures(self) -> bool:
        """Whether the bag has the topic of the colour pictures; then it needs the others of the camera as well."""
        with _Open(self.path) as reader:
            return any(each.topic == self.topics.color for each in reader.connections)

    def _connections(self, reader: _Open, roles: tuple[str, ...]) -> dict[str, tuple[Connection, str]]:
        found = {}
        for role, name in self.topics.names(roles).items():
            connection = next((each for each in reader.connections if each.topic == name), None)
            if connection is None:
                near = sorted({each.topic for each in reader.connections if each.msgtype in ACCEPTED[role]})
                hint = f"of such a type are {', '.join(near)}" if near else "no topic has such a type"
                raise ConfigError(f"{self.path}: no topic {name} for {role} ({_names(role)}); {hint}")
            if connection.msgtype not in ACCEPTED[role]:
                kind = shown(connection.msgtype)
                raise ConfigError(f"{self.path}: topic {name} for {role} has type {kind}, not {_names(role)}")
            found[role] = connection, role
        return found


def sensor_frames(path: str | Path, topics: Topics | None = None) -> Iterator[SensorFrame]:
    """Sensor frames of a bag; `Bag.sensor_frames`."""
    return Bag(path, topics).sensor_frames()


def commands(frames: Iterable[SensorFrame], pilot: Pilot) -> Iterator[tuple[SensorFrame, Command]]:
    """Each frame with the pilot's command, open loop: what the vehicle then did is in the next frame anyway.

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


class _Open:
    """An open bag: whatever the library raises becomes one line of ConfigError."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __enter__(self) -> _Open:
        _check_files(self._path)
        store = typestore()  # names the extra where it is missing
        from rosbags.highlevel import AnyReader

        try:
            self._reader: AnyReader = AnyReader([self._path], default_typestore=store)
            self._reader.open()
            self._reader.typestore.max_sequence_length = store.max_sequence_length
        except Exception as error:
            raise self._unreadable(error) from None
        self.connections = list(self._reader.connections)
        return self

    def __exit__(self, *_: object) -> None:
        self._reader.close()

    def deserialize(self, data: bytes, name: str) -> Any:
        """Decode a message by the bag's own definitions, or by ours where it has none."""
        return self._reader.deserialize(data, name)

    def messages(self, connections: list[Connection]) -> Iterator[tuple[Connection, bytes]]:
        """Messages of some connections in the order of recording."""
        stream = self._reader.messages(connections)
        while True:
            try:
                connection, _, data = next(stream)
            except StopIteration:
                return
            except Exception as error:
                raise self._unreadable(error) from None
            yield connection, data

    def _unreadable(self, error: Exception) -> ConfigError:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        return ConfigError(f"{self._path} is no readable ROS 2 bag ({shown(reason)[1:-1]})")


def _check_files(path: Path) -> None:
    """Open every file of a bag before the library does: only regular ones, of bounded size."""
    if not path.is_dir():
        open_regular(path, LARGEST_DATA).close()
        return
    open_regular(path / _METADATA, LARGEST_METADATA).close()
    for file in sorted(path.iterdir()):
        if file.name != _METADATA:
            open_regular(file, LARGEST_DATA).close()


def _names(role: str) -> str:
    return " or ".join(name.replace("/msg/", "/") for name in ACCEPTED[role])
