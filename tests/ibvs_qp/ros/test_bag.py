"""Bags to frames and back, and bags that are none."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the extra ros")

from rosbags.rosbag2 import Writer

from ibvs_qp import ConfigError, Pilot, RgbdFrame, SensorFrame, preset
from ibvs_qp.ros.bag import Bag, commands, sensor_frames
from ibvs_qp.ros.messages import IMU, WRENCH, encoded, typestore
from ibvs_qp.ros.samples import to_imu, to_wrench
from ibvs_qp.ros.topics import Px4Topics, Topics
from ibvs_qp.ros.write_bag import write_bag

TICK = 4_000_000
BEGIN = 1_700_000_000_000_000_000


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
    np.testing.assert_allclose(theirs, ours, atol=1e-9)


def test_messages_of_no_use_are_left_out_and_counted(tmp_path: Path) -> None:
    good = to_imu(BEGIN, np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3))
    bad = to_imu(BEGIN, np.array([1.0, 0, 0, 0]), np.full(3, np.nan), np.zeros(3))
    with Writer(tmp_path / "bag", version=8) as writer:
        imu = writer.add_connection("/imu/data", IMU, typestore=typestore())
        wrench = writer.add_connection("/ft_sensor/wrench", WRENCH, typestore=typestore())
        writer.write(wrench, 1, encoded(to_wrench(BEGIN, np.zeros(6), "flu", "tool"), WRENCH))
        for place, data in enumerate((encoded(bad, IMU), b"\0\1\0\0garbage", encoded(good, IMU)), 2):
            writer.write(imu, place, data)
    bag = Bag(tmp_path / "bag")
    assert len(list(bag.sensor_frames())) == 1
    assert dict(bag.held.ignored) == {"imu: not finite": 1, "imu: undecodable": 1}


def test_a_pair_needs_close_stamps_and_equal_sizes(tmp_path: Path) -> None:
    frames = flight(20)
    write_bag(frames, tmp_path / "bag")
    bag = Bag(tmp_path / "bag", Topics(depth="/camera/camera/color/image_raw"))
    assert list(bag.pictures()) == []
    assert set(bag.held.ignored) == {"depth: encoding is not 16UC1 or 32FC1"}


def test_refusals_name_the_topic_and_those_that_would_fit(tmp_path: Path) -> None:
    write_bag(flight(5), tmp_path / "bag")
    with pytest.raises(ConfigError, match=r"no topic /fmu/out/sensor_combined for imu .*of such a type are /imu/data"):
        list(sensor_frames(tmp_path / "bag", Px4Topics()))
    with pytest.raises(ConfigError, match=r"topic /imu/data for wrench has type 'sensor_msgs/msg/Imu', not geometry"):
        list(sensor_frames(tmp_path / "bag", Topics(wrench="/imu/data")))
    with pytest.raises(ConfigError, match=r"no topic /ft for wrench \(geometry_msgs/WrenchStamped\); of such a type"):
        list(sensor_frames(tmp_path / "bag", Topics(wrench="/ft")))


@pytest.mark.parametrize("name", ["imu", "/imu data", "/", "/imu/", "//imu", "/1"])
def test_names_that_are_no_topics_are_refused(name: str) -> None:
    with pytest.raises(ConfigError, match="imu ="):
        Topics(imu=name)


def test_a_bag_is_not_overwritten(tmp_path: Path) -> None:
    write_bag(flight(5), tmp_path / "bag")
    with pytest.raises(ConfigError, match="cannot write the bag"):
        write_bag(flight(5), tmp_path / "bag")
    with pytest.raises(ConfigError, match="storage"):
        write_bag(flight(5), tmp_path / "other", storage="bag")


def hostile_bags(folder: Path) -> dict[str, Path]:
    """Bags that are none, by what is wrong with them."""
    found = {}
    for storage, ending in (("mcap", "mcap"), ("sqlite3", "db3")):
        for kind, spoil in {
            "cut": lambda data: data[: len(data) // 2],
            "empty": lambda data: b"",
            "text": lambda data: b"no bag\n" * 100,
            "flipped": lambda data: bytes(255 - byte for byte in data),
        }.items():
            path = folder / f"{kind}_{storage}"
            write_bag(flight(20), path, storage=storage)
            file = path / f"{path.name}.{ending}"
            file.write_bytes(spoil(file.read_bytes()))
            found[path.name] = path
            found[f"{path.name}_file"] = file
    for kind, text in {
        "no_yaml": ": [",
        "other_yaml": "a: 1\n",
        "list_yaml": "- 1\n",
        "empty_yaml": "",
        "no_version": "rosbag2_bagfile_information: {version: x}\n",
        "future": "rosbag2_bagfile_information: {version: 99}\n",
    }.items():
        path = folder / kind
        write_bag(flight(5), path)
        (path / "metadata.yaml").write_text(text)
        found[kind] = path
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
