"""Bags as people record them: nothing that a file need not have decides, and what is lost is named."""

from __future__ import annotations

import shutil
import sqlite3
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the extra ros")

from mcap.writer import CompressionType, IndexType, Writer
from ruamel.yaml import YAML

from ibvs_qp.config import VehicleParams
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.interfaces.ros import samples
from ibvs_qp.interfaces.ros.attitude_filter import AttitudeFilter
from ibvs_qp.interfaces.ros.bag import Bag
from ibvs_qp.interfaces.ros.messages import (
    IMU,
    SENSOR_COMBINED,
    VEHICLE_ATTITUDE,
    WRENCH,
    BadMessage,
    encoded,
    header,
    message,
    typestore,
)
from ibvs_qp.interfaces.ros.static_poses import TF, StaticPoses, differences
from ibvs_qp.interfaces.ros.topics import Topics
from ibvs_qp.interfaces.ros.write_bag import write_bag
from ibvs_qp.measurement import SensorFrame

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


def metadata(folder: Path, files: list[str], counts: dict[str, int]) -> None:
    topics = [
        {
            "topic_metadata": {"name": name, "type": kind, "offered_qos_profiles": "- depth: 1"},
            "message_count": count,
        }
        for (name, count), kind in zip(counts.items(), (IMU, WRENCH), strict=True)
    ]
    facts = {"version": 5, "relative_file_paths": files, "topics_with_message_count": topics}
    with open(folder / "metadata.yaml", "w") as stream:
        YAML().dump({"rosbag2_bagfile_information": facts}, stream)


def frames(path: Path, topics: Topics | None = None) -> tuple[int, dict[str, int], list[str]]:
    """Frames, messages left out, and differences of a bag; the differences are warnings as well."""
    bag = Bag(path, topics)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        count = len(list(bag.sensor_frames()))
    assert [str(each.message) for each in found] == [f"{path}: {each}" for each in bag.differences]
    return count, dict(bag.held.ignored), bag.differences


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"index_types": IndexType.NONE},
        {"index_types": IndexType.CHUNK},
        {"index_types": IndexType.MESSAGE},
        {"use_chunking": False},
        {"use_summary_offsets": False, "use_statistics": False},
        {"repeat_channels": False, "repeat_schemas": False},
        {"chunk_size": 500},
        {"compression": CompressionType.ZSTD},
        {"compression": CompressionType.LZ4},
        {"channels": 3},
    ],
    ids=str,
)
def test_no_optional_part_of_a_file_decides(tmp_path: Path, options: dict[str, Any]) -> None:
    assert frames(rest(tmp_path / "one.mcap", **options)) == (COUNT, {}, [])


@pytest.mark.parametrize("left", [0.5, 0.97])
def test_a_recorder_that_was_killed_leaves_what_it_wrote(tmp_path: Path, left: float) -> None:
    path = rest(tmp_path / "cut.mcap", chunk_size=2000)
    path.write_bytes(path.read_bytes()[: int(left * path.stat().st_size)])
    count, ignored, differences = frames(path)
    assert 0.4 * COUNT < count <= COUNT and not ignored
    assert len(differences) == 1 and differences[0].startswith("cut.mcap: it ") and "read up to there" in differences[0]


def test_messages_come_in_the_order_of_recording_across_chunks_and_files(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()
    for part in (1, 0):
        rest(folder / f"bag_{part}.mcap", first=50 * part, count=50, chunk_size=700)
    metadata(folder, ["bag_1.mcap", "bag_0.mcap"], {"/imu/data": 100, "/ft_sensor/wrench": 100})
    bag = Bag(folder)
    stamps = [frame.stamp_ns for frame in bag.sensor_frames()]
    assert stamps == [(tick + 1) * TICK for tick in range(COUNT)] and not bag.differences


def test_a_publisher_that_restarts_with_another_qos_is_one_topic(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()
    rest(folder / "bag_0.mcap", channels=2)
    metadata(folder, ["bag_0.mcap"], {"/imu/data": 100, "/ft_sensor/wrench": 100})
    assert frames(folder) == (COUNT, {}, [])


def test_files_beside_the_storage_are_no_fault_and_other_storage_is_read(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    (folder / "calibration").mkdir(parents=True)
    (folder / "notes.txt").symlink_to(tmp_path / "gone")
    (folder / "old.mcap").symlink_to(tmp_path / "gone.mcap")
    rest(folder / "bag_0.mcap", count=60)
    rest(folder / "bag_1.mcap", first=60, count=40)
    assert frames(folder) == (COUNT, {}, [])  # as of a recorder that was killed before it wrote the metadata
    metadata(folder, ["bag_0.mcap", "bag_2.mcap"], {"/imu/data": 120, "/ft_sensor/wrench": 100})
    count, ignored, differences = frames(folder)
    assert (count, ignored) == (COUNT, {})
    assert differences == [
        "bag_2.mcap of metadata.yaml is missing",
        "bag_1.mcap: not in metadata.yaml, read as well",
        "/imu/data: metadata.yaml states 120 messages, 100 were read",
    ]


@pytest.mark.parametrize("text", [": [", "a: 1\n", "- 1\n", "", "rosbag2_bagfile_information: {version: x}\n", "\0"])
def test_damaged_metadata_cost_no_message(tmp_path: Path, text: str) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()
    rest(folder / "bag_0.mcap")
    (folder / "metadata.yaml").write_text(text)
    count, ignored, differences = frames(folder)
    assert (count, ignored) == (COUNT, {}) and set(differences) <= {
        "metadata.yaml is damaged; its counts are not compared"
    }


PX4 = Topics(imu="/fmu/out/sensor_combined", attitude="/fmu/out/vehicle_attitude")


@pytest.mark.parametrize("definition", ["", "no definition at all /", "unknown_msgs/Thing thing\n"])
@pytest.mark.parametrize("foreign", ["", "\0broken [[", "a_msgs/B b\n"])
def test_a_definition_that_nobody_can_use_spoils_nothing_else(tmp_path: Path, definition: str, foreign: str) -> None:
    log = Log(tmp_path / "px4.mcap")
    inertial = log.channel(PX4.imu, SENSOR_COMBINED, definition)
    attitude = log.channel(PX4.attitude, VEHICLE_ATTITUDE, definition)
    force, other = log.channel(PX4.wrench, WRENCH), log.channel("/other", "their_msgs/msg/Thing", foreign or " ")
    for tick in range(1, COUNT + 1):
        us = tick * TICK // 1000
        log.put(force, tick * TICK - 1, WRENCH, wrench(tick * TICK - 1))
        log.put(other, tick * TICK - 1, WRENCH, wrench(tick * TICK - 1))
        q = {"timestamp": us, "timestamp_sample": us, "q": LEVEL.astype(np.float32)}
        log.put(attitude, tick * TICK - 1, VEHICLE_ATTITUDE, message(VEHICLE_ATTITUDE, **q))
        values = {"timestamp": us, "gyro_rad": np.zeros(3, np.float32), "accelerometer_m_s2": REST.astype(np.float32)}
        log.put(inertial, tick * TICK, SENSOR_COMBINED, message(SENSOR_COMBINED, **values))
    log.close()
    assert frames(tmp_path / "px4.mcap", PX4) == (COUNT, {}, [])


def test_a_type_that_has_changed_is_read_by_the_definition_of_the_bag(tmp_path: Path) -> None:
    """A field more, before the ones that are needed."""
    ours = typestore().generate_msgdef(WRENCH, ros_version=2)[0]
    definition = ours.replace("geometry_msgs/Wrench", "int64 more\ngeometry_msgs/Wrench", 1)
    log = Log(tmp_path / "two.mcap")
    inertial, force = log.channel("/imu/data", IMU), log.channel("/ft_sensor/wrench", WRENCH, definition)
    data = encoded(samples.to_wrench(1, np.arange(6.0), "flu", "tool"), WRENCH)
    head = data[: len(data) - 48]
    log._writer.add_message(force, 1, head + (7).to_bytes(8, "little") + data[len(data) - 48 :], 1)
    log.put(inertial, TICK, IMU, imu(TICK))
    log.close()
    (frame,) = Bag(tmp_path / "two.mcap").sensor_frames()
    assert frame.wrench is not None and np.abs(frame.wrench).tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]


def test_sqlite_with_a_write_ahead_log_is_read_whole_and_left_alone(tmp_path: Path) -> None:
    values = {"attitude": LEVEL, "angular_velocity": np.zeros(3), "specific_force": REST, "wrench": np.zeros(6)}
    flown = [SensorFrame(stamp_ns=(k + 1) * TICK, wrench_stamp_ns=(k + 1) * TICK - 1, **values) for k in range(COUNT)]
    write_bag(flown, tmp_path / "bag", storage="sqlite3")
    file = next((tmp_path / "bag").glob("*.db3"))
    base = sqlite3.connect(file)
    base.execute("PRAGMA journal_mode=WAL")
    base.execute("PRAGMA wal_autocheckpoint=0")
    base.execute("UPDATE messages SET timestamp = timestamp + 1 WHERE id > 100")
    base.commit()
    killed = tmp_path / "killed"
    shutil.copytree(tmp_path / "bag", killed)  # as of a recorder that was killed: the log is there
    base.close()
    assert next(killed.glob("*.db3-wal")).stat().st_size > 0
    before = {each.name: each.read_bytes() for each in killed.iterdir() if not each.name.endswith("-shm")}
    assert frames(killed) == (COUNT, {}, [])
    assert {each.name: each.read_bytes() for each in killed.iterdir() if not each.name.endswith("-shm")} == before


def test_a_bag_of_ros_1_is_named_as_one(tmp_path: Path) -> None:
    (tmp_path / "viewer.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(4096))
    for path in (tmp_path / "viewer.bag", tmp_path):
        with pytest.raises(ConfigError, match="it is a bag of ROS 1; convert it"):
            list(Bag(path).sensor_frames())


def test_samples_that_are_late_or_repeated_make_no_frames_and_are_counted(tmp_path: Path) -> None:
    """A RealSense with unite_imu_method "copy": accelerometer samples come 3 ms late between those of the gyro."""
    log = Log(tmp_path / "copy.mcap")
    inertial, force = log.channel("/imu/data", IMU), log.channel("/ft_sensor/wrench", WRENCH)
    log.put(force, 1, WRENCH, wrench(1))
    for tick in range(1, COUNT + 1):
        log.put(inertial, tick * TICK, IMU, imu(tick * TICK))
        log.put(inertial, tick * TICK - 3_000_000, IMU, imu(tick * TICK - 3_000_000), tick * TICK + 1)
        log.put(inertial, tick * TICK, IMU, imu(tick * TICK), tick * TICK + 2)
    log.close()
    bag = Bag(tmp_path / "copy.mcap")
    assert [frame.stamp_ns for frame in bag.sensor_frames()] == [(tick + 1) * TICK for tick in range(COUNT)]
    assert dict(bag.held.ignored) == {"imu: not newer than the one before": 2 * COUNT}


def fuzzed(content: bytes, rng: np.random.Generator) -> Iterator[bytes]:
    """A file with flipped bytes, a part missing, or a part twice."""
    for _ in range(60):
        spoilt = bytearray(content)
        start, length = int(rng.integers(8, len(content))), int(rng.integers(1, 40))
        change: Callable[[bytes], bytes] = [
            lambda part: bytes(byte ^ 0xFF for byte in part), lambda part: b"", lambda part: part * 2
        ][int(rng.integers(3))]  # fmt: skip
        spoilt[start : start + length] = change(bytes(spoilt[start : start + length]))
        yield bytes(spoilt)


def test_a_damaged_file_is_read_in_part_or_refused_in_one_line(tmp_path: Path) -> None:
    content = rest(tmp_path / "one.mcap", count=20, chunk_size=1000).read_bytes()
    for number, spoilt in enumerate(fuzzed(content, np.random.default_rng(0))):
        path = tmp_path / f"{number}.mcap"
        path.write_bytes(spoilt)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                list(Bag(path).sensor_frames())
        except ConfigError as error:
            assert "\n" not in str(error) and str(path) in str(error)


def turned_imu(tick: int, orientation: bool) -> Any:
    """A vehicle that rolls by 10 degrees in 2 s and stays there."""
    roll, rate = np.radians(min(10.0, 0.02 * tick)), np.radians(5.0) if tick < 500 else 0.0
    quaternion = np.array((np.cos(roll / 2), np.sin(roll / 2), 0.0, 0.0))
    force = 9.81 * np.array((0.0, -np.sin(roll), -np.cos(roll)))
    value = samples.to_imu((tick + 1) * TICK, quaternion, np.array((rate + 0.005, 0.0, 0.0)), force)
    if not orientation:
        value.orientation_covariance[0] = -1.0
    return value


def rolling(path: Path, orientation: bool) -> Path:
    log = Log(path)
    force, inertial = log.channel("/ft_sensor/wrench", WRENCH), log.channel("/imu/data", IMU)
    for tick in range(1000):
        log.put(force, (tick + 1) * TICK - 1, WRENCH, wrench((tick + 1) * TICK - 1))
        log.put(inertial, (tick + 1) * TICK, IMU, turned_imu(tick, orientation))
    log.close()
    return path


def test_an_imu_without_orientation_names_its_remedies_and_flies_with_the_filter(tmp_path: Path) -> None:
    path = rolling(tmp_path / "none.mcap", False)
    assert frames(path) == (
        0,
        {"imu: has no orientation: name a topic as attitude, or set attitude_filter_s": 1000},
        [],
    )
    true = [frame.attitude for frame in Bag(rolling(tmp_path / "own.mcap", True)).sensor_frames()]
    found = [frame.attitude for frame in Bag(path, Topics(attitude_filter_s=1.0)).sensor_frames()]
    assert len(found) == len(true) == 1000
    errors = [2.0 * np.degrees(np.arccos(min(1.0, abs(one @ other)))) for one, other in zip(true, found, strict=True)]
    assert max(errors) < 0.5  # the bias of the gyro, 0.3 deg/s, times the time constant


def test_an_accelerating_vehicle_turns_by_the_gyro_alone() -> None:
    begun = AttitudeFilter(1.0)
    with pytest.raises(BadMessage, match="no vertical"):
        begun.update(1, np.zeros(3), np.array((0.0, 0.0, -20.0)))
    begun.update(2, np.zeros(3), REST)
    for tick in range(1, 250):
        attitude = begun.update(2 + tick * TICK, np.zeros(3), np.array((6.0, 0.0, -9.81)))
    np.testing.assert_allclose(attitude, LEVEL, atol=1e-12)


def transform(parent: str, child: str, position: tuple[float, ...], quaternion: tuple[float, ...]) -> Any:
    x, y, z, w = quaternion
    move = message("geometry_msgs/msg/Vector3", **dict(zip("xyz", position, strict=True)))
    turn = message("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)
    value = message("geometry_msgs/msg/Transform", translation=move, rotation=turn)
    stamped = {"header": header(0, parent), "child_frame_id": child, "transform": value}
    return message("geometry_msgs/msg/TransformStamped", **stamped)


def test_poses_of_tf_static_are_those_of_the_vehicle_or_named() -> None:
    vehicle = VehicleParams()
    base = np.array((0.1, 0.0, -0.05))  # of base_link from the centre of mass, FRD
    camera, force = np.array(vehicle.camera_position_m) - base, np.array(vehicle.force_torque_position_m) - base
    optical = (-0.5, 0.5, -0.5, 0.5)  # of a frame that looks along +x of front-left-up

    def tree(moved: float = 0.0, turn: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)) -> StaticPoses:
        flu = np.array((1.0, -1.0, -1.0))
        return StaticPoses([
            message(TF, transforms=[
                transform("/base_link", "camera_link", tuple(flu * camera + (0.0, 0.0, moved)), turn),
                transform("camera_link", "camera_color_optical_frame", (0.0, 0.0, 0.0), optical),
            ]),
            message(TF, transforms=[transform("base_link", "force_torque", tuple(flu * force), (0.0, 0.0, 0.0, 1.0))]),
        ])  # fmt: skip

    def said(poses: StaticPoses) -> list[str]:
        found = [poses.pose(name, "base_link") for name in ("camera_color_optical_frame", "force_torque")]
        assert all(found)
        return differences(*found, vehicle)

    pose = tree().pose("camera_color_optical_frame", "base_link")
    assert pose is not None
    np.testing.assert_allclose(pose.position_m, camera, atol=1e-12)
    assert said(tree()) == [] and tree().pose("lidar", "base_link") is None
    (moved,) = said(tree(moved=0.03))
    assert moved.startswith("from force sensor to camera tf_static has")
    (turned,) = said(tree(turn=(0.0, np.sin(np.radians(4.0)), 0.0, np.cos(np.radians(4.0)))))
    assert turned == "the camera of tf_static is turned by 8.0 deg from that of the vehicle"
    circle = [transform("a", "b", (0.0,) * 3, optical), transform("b", "a", (0.0,) * 3, optical)]
    loop = StaticPoses([message(TF, transforms=circle)])
    assert loop.pose("a", "base_link") is None


def test_a_damaged_chunk_is_left_out_and_named(tmp_path: Path) -> None:
    path = rest(tmp_path / "one.mcap", chunk_size=1000)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)
    count, _, differences = frames(path)
    assert 0.8 * COUNT < count < COUNT
    assert any("is damaged and left out" in each for each in differences)
    assert any(each.startswith("/imu/data: the file states 100 messages") for each in differences)


def test_counts_are_compared_file_by_file(tmp_path: Path) -> None:
    """A killed recorder's second file states nothing; the first is whole."""
    folder = tmp_path / "bag"
    folder.mkdir()
    rest(folder / "bag_0.mcap", count=50)
    second = rest(folder / "bag_1.mcap", first=50, count=50, chunk_size=500)
    second.write_bytes(second.read_bytes()[: second.stat().st_size // 2])
    _, _, differences = frames(folder)
    assert len(differences) == 1 and differences[0].startswith("bag_1.mcap: it ends within a record")


@pytest.mark.parametrize(
    "metadata",
    [
        "rosbag2_bagfile_information: {topics_with_message_count:"
        " [{topic_metadata: {name: /imu/data}, message_count: .inf}]}",
        "a: &a [x,x,x,x,x,x,x,x,x,x]\n"
        + "".join(f"{b}: &{b} [{','.join(['*' + a] * 10)}]\n" for a, b in zip("abcdefg", "bcdefgh", strict=True))
        + "rosbag2_bagfile_information: {relative_file_paths: [*h], topics_with_message_count:"
        " [{topic_metadata: {name: *h}, message_count: 1}]}",
    ],
    ids=["infinite", "aliases"],
)
def test_hostile_metadata_cost_neither_time_nor_messages(tmp_path: Path, metadata: str) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()
    rest(folder / "bag_0.mcap")
    (folder / "metadata.yaml").write_text(metadata)
    began = time.process_time()
    assert frames(folder)[0] == COUNT
    assert time.process_time() - began < 10.0


def test_a_record_of_a_terabyte_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = rest(tmp_path / "one.mcap", count=2, use_chunking=False)
    content = path.read_bytes()
    at = content.index(b"\x05", 60)
    with open(path, "wb") as stream:
        stream.write(content[:at] + b"\x05" + (1 << 33).to_bytes(8, "little") + bytes(22))
        stream.truncate(1 << 34)
    with pytest.raises(ConfigError):
        list(Bag(path).sensor_frames())
