"""Bags as people record them: nothing that a file need not have decides, and every loss is named."""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import lz4.frame
import numpy as np
import pytest
import zstandard

pytest.importorskip("rosbags", reason="needs the extra ros")

from bag_files import COUNT, LEVEL, REST, TICK, Log, frames, imu, rest, wrench
from mcap.reader import NonSeekingReader
from mcap.writer import CompressionType, IndexType
from ruamel.yaml import YAML

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.interfaces.ros import samples
from ibvs_qp.interfaces.ros.bag import Bag
from ibvs_qp.interfaces.ros.messages import (
    COMPRESSED_IMAGE,
    IMU,
    SENSOR_COMBINED,
    VEHICLE_ATTITUDE,
    WRENCH,
    encoded,
    message,
    typestore,
)
from ibvs_qp.interfaces.ros.recording import is_bag
from ibvs_qp.interfaces.ros.topics import Topics
from ibvs_qp.interfaces.ros.write_bag import write_bag
from ibvs_qp.measurement import SensorFrame


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


def test_a_chunk_of_gigabytes_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path, size = tmp_path / "sparse.mcap", 1 << 33
    with open(path, "wb") as stream:
        stream.write(b"\x89MCAP0\r\n" + b"\x06" + size.to_bytes(8, "little") + bytes(16))
        stream.truncate(1 << 34)
    with pytest.raises(ConfigError, match=f"a part has {size} bytes"):
        list(Bag(path).sensor_frames())


def in_cut_chunk(content: bytes, channel: int) -> int:
    """Messages of a channel in the chunk that a file ends in, by its bytes alone; 0 for a whole last record."""
    place = 8
    while place + 9 <= len(content):
        opcode, size = content[place], int.from_bytes(content[place + 1 : place + 9], "little")
        place += 9
        if place + size > len(content) and opcode == 6:
            name = int.from_bytes(content[place + 28 : place + 32], "little")
            records = content[place + 40 + name :]
            if name:
                kinds = {4: zstandard.ZstdDecompressor().decompressobj, 3: lz4.frame.LZ4FrameDecompressor}
                records = kinds[name]().decompress(records)
            found, place = 0, 0
            while place + 9 <= len(records):
                opcode, size = records[place], int.from_bytes(records[place + 1 : place + 9], "little")
                place += 9 + size
                found += opcode == 5 and place <= len(records) and records[place - size] == channel
            return found
        place += size
    return 0


@pytest.mark.slow
@pytest.mark.parametrize("compression", list(CompressionType), ids=lambda each: each.name)
def test_the_chunk_that_a_killed_recorder_ends_in_is_read_up_to_the_end(
    tmp_path: Path, compression: CompressionType
) -> None:
    path, more = rest(tmp_path / "cut.mcap", count=2000, compression=compression, chunk_size=400_000), 0
    content = path.read_bytes()
    for end in np.linspace(0.2, 0.9, 8):
        path.write_bytes(content[: int(end * len(content))])
        with open(path, "rb") as stream, contextlib.suppress(Exception):
            whole = 0
            for _, channel, _ in NonSeekingReader(stream).iter_messages(log_time_order=False):
                whole += channel.topic == "/imu/data"
        extra = in_cut_chunk(path.read_bytes(), 2)
        count, ignored, differences = frames(path)
        assert count + sum(ignored.values()) == whole + extra and len(differences) == 1
        more += extra
    assert more > 200


def test_every_message_before_the_first_frame_and_after_the_last_is_counted(tmp_path: Path) -> None:
    log = Log(tmp_path / "late.mcap")
    force, inertial = log.channel("/ft_sensor/wrench", WRENCH), log.channel("/imu/data", IMU)
    for tick in range(1, COUNT + 1):
        if tick > 30:
            log.put(force, tick * TICK - 1, WRENCH, wrench(tick * TICK - 1))
        log.put(inertial, tick * TICK, IMU, imu(tick * TICK))
    log.close()
    assert frames(tmp_path / "late.mcap") == (COUNT - 30, {"imu: no wrench yet": 30}, [])


def test_a_topic_of_colour_that_is_absent_is_refused_or_named(tmp_path: Path) -> None:
    log = Log(tmp_path / "one.mcap")
    force, inertial = log.channel("/ft_sensor/wrench", WRENCH), log.channel("/imu/data", IMU)
    log.channel("/camera/color/image_raw/compressed", COMPRESSED_IMAGE)
    log.put(force, TICK - 1, WRENCH, wrench(TICK - 1))
    log.put(inertial, TICK, IMU, imu(TICK))
    log.close()
    words = "of such a type are /camera/color/image_raw/compressed"
    (said,) = frames(tmp_path / "one.mcap")[2]
    assert said.startswith("no pictures: no topic /camera/camera/color/image_raw for color") and said.endswith(words)
    with pytest.raises(ConfigError, match=f"no topic /camera/typo for color .*{words}"):
        frames(tmp_path / "one.mcap", Topics(color="/camera/typo"))
    assert frames(tmp_path / "one.mcap", Topics(color="")) == (1, {}, [])


def test_a_damaged_head_of_the_last_chunk_costs_no_other_message(tmp_path: Path) -> None:
    path = rest(tmp_path / "cut.mcap", count=2000, chunk_size=40_000)
    content = path.read_bytes()
    place, start = 8, 0
    while content[place] != 15:  # the end of the data
        start = place if content[place] == 6 else start
        place += 9 + int.from_bytes(content[place + 1 : place + 9], "little")
    cut = bytearray(content[: start + 5000])
    path.write_bytes(bytes(cut))
    whole = frames(path)[0]
    cut[start + 37 : start + 41] = (4).to_bytes(4, "little")  # a compression of four letters that is none
    path.write_bytes(bytes(cut))
    count, _, (damage,) = frames(path)
    assert 0 < count < whole and "ends within a record" in damage and is_bag(path)
    cut[start + 1 : start + 9] = (1 << 40).to_bytes(8, "little")
    path.write_bytes(bytes(cut))
    assert frames(path)[0] == count
