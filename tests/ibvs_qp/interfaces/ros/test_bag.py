"""Bags to frames and back, and bags that are none."""

from __future__ import annotations

import dataclasses
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the extra ros")

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from ibvs_qp import ConfigError, Pilot, RgbdFrame, SensorFrame, preset
from ibvs_qp.interfaces.ros import storage as bag_storage
from ibvs_qp.interfaces.ros.bag import Bag, commands, sensor_frames
from ibvs_qp.interfaces.ros.messages import CAMERA_INFO, IMAGE, IMU, WRENCH, encoded, typestore
from ibvs_qp.interfaces.ros.pictures import from_depth, from_intrinsics, from_rgb
from ibvs_qp.interfaces.ros.samples import to_imu, to_wrench
from ibvs_qp.interfaces.ros.topics import ACCEPTED, Px4Topics, Topics
from ibvs_qp.interfaces.ros.write_bag import write_bag

TICK = 4_000_000
BEGIN = 1_700_000_000_000_000_000
WRENCH_DATA = encoded(to_wrench(BEGIN, np.zeros(6), "flu", "tool"), WRENCH)


def flight(ticks: int = 60) -> list[SensorFrame]:
    rng = np.random.default_rng(0)
    frames = []
    for tick in range(ticks):
        stamp = BEGIN + tick * TICK
        attitude = rng.normal([1.0, 0.0, 0.0, 0.0], 0.1)
        image = RgbdFrame(
            rgb=rng.integers(0, 256, (12, 16, 3)).astype(np.uint8),
            depth=rng.uniform(0.3, 2.0, (12, 16)).astype(np.float32),
            intrinsics=(15.0, 15.5, 7.5, 5.5),
            stamp_ns=stamp - 60_000_000,
        )
        frames.append(
            SensorFrame(
                stamp_ns=stamp,
                attitude=attitude / np.linalg.norm(attitude),
                angular_velocity=rng.normal(0.0, 0.1, 3),
                specific_force=rng.normal([0.0, 0.0, -9.81], 1.0),
                wrench=rng.normal(0.0, 1.0, 6) if tick % 2 == 0 else frames[-1].wrench,
                wrench_stamp_ns=BEGIN + (tick - tick % 2) * TICK - 1_000_000,
                image=image if tick % 8 == 3 else None,
            )
        )
    return frames


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("options", [{}, {"wrench_axes": "frd", "wrench_on": "vehicle", "imu": "/mavros/imu/data"}])
def test_frames_return_from_a_bag(tmp_path: Path, storage: str, options: dict[str, str]) -> None:
    frames, topics = flight(), Topics(**options)
    assert write_bag(frames, tmp_path / "bag", topics, storage) == len(frames)
    bag = Bag(tmp_path / "bag", topics)
    back = list(bag.sensor_frames())
    assert [frame.stamp_ns for frame in back] == [frame.stamp_ns for frame in frames]
    assert not bag.held.ignored
    for ours, theirs in zip(frames, back, strict=True):
        np.testing.assert_allclose(theirs.attitude, ours.attitude, atol=1e-15)
        for name in ("angular_velocity", "specific_force", "wrench"):
            np.testing.assert_array_equal(getattr(theirs, name), getattr(ours, name))
        assert theirs.wrench_stamp_ns == ours.wrench_stamp_ns
        assert theirs.imu_stamp_ns == theirs.attitude_stamp_ns == ours.stamp_ns
        assert (theirs.image is None) == (ours.image is None)
        if ours.image is not None and theirs.image is not None:
            np.testing.assert_array_equal(theirs.image.rgb, ours.image.rgb)
            np.testing.assert_array_equal(theirs.image.depth, ours.image.depth)
            assert dataclasses.replace(theirs.image, rgb=0, depth=0) == dataclasses.replace(ours.image, rgb=0, depth=0)
    assert [each.stamp_ns for each in bag.pictures()] == [f.image.stamp_ns for f in frames if f.image is not None]


def test_a_fast_imu_is_thinned_to_ticks(tmp_path: Path) -> None:
    fast = [dataclasses.replace(frame, stamp_ns=BEGIN + k * TICK // 4) for k, frame in enumerate(flight(400))]
    write_bag(fast, tmp_path / "bag")
    stamps = np.diff([frame.stamp_ns for frame in sensor_frames(tmp_path / "bag")])
    assert stamps.min() >= 0.75 * TICK and np.median(stamps) <= TICK
    assert len(list(Bag(tmp_path / "bag").sensor_frames(period_s=0.001))) == 400


def test_the_pilot_flies_over_a_bag(tmp_path: Path) -> None:
    frames = [dataclasses.replace(frame, image=None) for frame in flight(100)]
    write_bag(frames, tmp_path / "bag")
    pilots = Pilot(preset()), Pilot(preset())
    ours = [pilots[0].step(frame).thrusts for frame in frames]
    theirs = [command.thrusts for _, command in commands(sensor_frames(tmp_path / "bag"), pilots[1])]
    np.testing.assert_allclose(theirs, ours, atol=1e-5)


def imu(rate: float = 0.0) -> bytes:
    return encoded(to_imu(BEGIN, np.array([1.0, 0, 0, 0]), np.full(3, rate), np.zeros(3)), IMU)


def test_messages_of_no_use_are_left_out_and_counted(tmp_path: Path) -> None:
    sent = ("wrench", WRENCH_DATA), ("imu", imu(np.nan)), ("imu", b"\0\1\0\0garbage"), ("imu", imu())
    bag = Bag(written(tmp_path / "bag", sent))
    assert len(list(bag.sensor_frames())) == 1
    assert dict(bag.held.ignored) == {"imu: not finite": 1, "imu: undecodable": 1}


def camera_bag(path: Path, mode: str = "NONE", storage: str = "MCAP", side: int = 8, **lens: object) -> Path:
    """A bag of one grey picture whose camera info has these fields."""
    info = from_intrinsics((9.0, 9.0, 2.0, 1.0), (side, side), BEGIN)
    vars(info).update(lens)
    color, depth = np.zeros((side, side, 3), np.uint8), np.ones((side, side), np.float32)
    sent = (
        ("camera_info", encoded(info, CAMERA_INFO)),
        ("color", encoded(from_rgb(color, BEGIN), IMAGE)),
        ("depth", encoded(from_depth(depth, BEGIN), IMAGE)),
        ("wrench", WRENCH_DATA),
        ("imu", imu()),
    )
    return written(path, sent, mode, storage)


def written(path: Path, sent: tuple[tuple[str, bytes], ...], mode: str = "NONE", storage: str = "MCAP") -> Path:
    """A bag of messages by role."""
    writer = Writer(path, version=8, storage_plugin=StoragePlugin[storage])
    writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    with writer:
        connections = {
            role: writer.add_connection(getattr(Topics(), role), ACCEPTED[role][0], typestore=typestore())
            for role in dict(sent)
        }
        for time, (role, data) in enumerate(sent, 1):
            writer.write(connections[role], time, data)
    return path


def test_pictures_of_another_encoding_are_left_out(tmp_path: Path) -> None:
    bag = Bag(camera_bag(tmp_path / "bag"), Topics(depth="/camera/camera/color/image_raw"))
    assert list(bag.pictures()) == []
    assert set(bag.held.ignored) == {"depth: encoding is not 16UC1 or 32FC1", "color: no depth within pair_s"}


def test_another_lens_than_the_pilots_is_refused(tmp_path: Path) -> None:
    bag = Bag(camera_bag(tmp_path / "bag", d=np.array([0.1, 0.0, 0.0, 0.0, 0.0])))
    with pytest.raises(ConfigError, match=r"distortion \(0.1, 0.0, 0.0, 0.0, 0.0\), not \(\)"):
        list(bag.sensor_frames())
    assert [frame.image is not None for frame in bag.sensor_frames(distortion=(0.1, 0.0, 0.0, 0.0))] == [True]
    assert len(list(bag.pictures())) == 1 and bag.held.camera is not None and bag.held.camera.distortion[0] == 0.1


def test_pictures_of_another_size_than_their_camera_info_are_left_out(tmp_path: Path) -> None:
    bag = Bag(camera_bag(tmp_path / "bag", width=9))
    assert not list(bag.pictures()) and dict(bag.held.ignored) == {"depth: size is not that of camera_info": 1}


@pytest.mark.parametrize(("mode", "storage"), [("STORAGE", "MCAP"), ("MESSAGE", "MCAP"), ("MESSAGE", "SQLITE3")])
def test_compressed_bags_are_read_up_to_a_size(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: str, storage: str
) -> None:
    path = camera_bag(tmp_path / "bag", mode, storage, side=2048)
    assert sum(file.stat().st_size for file in path.iterdir()) < 100_000
    assert len(list(Bag(path).pictures())) == 1
    monkeypatch.setattr(bag_storage, "LARGEST_UNPACKED", 1 << 20)
    tracemalloc.start()
    try:
        with pytest.raises(ConfigError, match="a compressed part is cut, or has more than 1048576 bytes"):
            list(Bag(path).pictures())
        assert tracemalloc.get_traced_memory()[1] < 8 << 20  # without the limit 12 MB and more
    finally:
        tracemalloc.stop()


def test_lz4_has_the_same_limit() -> None:
    lz4 = pytest.importorskip("lz4.frame")
    data = lz4.compress(bytes(1000))
    assert bag_storage._lz4(data, 1000) == bytes(1000)
    for size, cut in ((999, None), (1000, -1)):
        with pytest.raises(ValueError, match="compressed part"):
            bag_storage._lz4(data[:cut], size)


def test_bags_compressed_as_whole_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"compressed as a whole file; .*ros2 bag convert"):
        list(sensor_frames(camera_bag(tmp_path / "bag", "FILE")))


def test_refusals_name_the_topic_and_those_that_would_fit(tmp_path: Path) -> None:
    write_bag(flight(5), tmp_path / "bag")
    for topics, text in (
        (Px4Topics(), "no topic /fmu/out/sensor_combined for imu .*of such a type are /imu/data"),
        (Topics(wrench="/imu/data"), "topic /imu/data for wrench has type 'sensor_msgs/msg/Imu', not geometry"),
        (Topics(wrench="/ft"), r"no topic /ft for wrench \(geometry_msgs/WrenchStamped\); of such a type"),
    ):
        with pytest.raises(ConfigError, match=text):
            list(sensor_frames(tmp_path / "bag", topics))
    for name in ("imu", "/imu data", "/", "/imu/", "//imu", "/1"):
        with pytest.raises(ConfigError, match="imu ="):
            Topics(imu=name)


def test_a_bag_is_not_overwritten(tmp_path: Path) -> None:
    write_bag(flight(5), tmp_path / "bag")
    for path, storage, text in (("bag", "mcap", "cannot write the bag"), ("other", "bag", "storage")):
        with pytest.raises(ConfigError, match=text):
            write_bag(flight(5), tmp_path / path, storage=storage)


def hostile_bags(folder: Path) -> dict[str, Path]:
    """Bags that are none, by what is wrong with them."""
    found = {}
    spoils = {
        "empty": lambda data: b"",
        "text": lambda data: b"no bag\n" * 100,
        "flipped": lambda data: bytes(255 - byte for byte in data),
    }
    for storage, ending in (("mcap", "mcap"), ("sqlite3", "db3")):
        for kind, spoil in spoils.items():
            path = folder / f"{kind}_{storage}"
            write_bag(flight(20), path, storage=storage)
            file = path / f"{path.name}.{ending}"
            file.write_bytes(spoil(file.read_bytes()))
            found[path.name] = path
            found[f"{path.name}_file"] = file
    (folder / "nothing").mkdir()
    (folder / "bag.db3").mkdir()
    found |= {"nothing": folder / "nothing", "folder": folder / "bag.db3", "missing": folder / "missing.mcap"}
    return found


def test_what_is_no_bag_is_refused_in_one_line(tmp_path: Path) -> None:
    for kind, path in hostile_bags(tmp_path).items():
        with pytest.raises(ConfigError) as refused:
            list(sensor_frames(path))
        text = str(refused.value)
        assert "\n" not in text and str(path) in text and len(text) < 600, (kind, text)
