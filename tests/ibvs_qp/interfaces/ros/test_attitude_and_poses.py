"""Attitude of an IMU without orientation, and the poses of sensors by ``/tf_static``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the extra ros")

from bag_files import LEVEL, REST, TICK, Log, frames, wrench

from ibvs_qp.config import VehicleParams
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.interfaces.px4.config import BridgeConfig
from ibvs_qp.interfaces.ros import samples
from ibvs_qp.interfaces.ros.bag import Bag
from ibvs_qp.interfaces.ros.latest_samples import AttitudeFilter
from ibvs_qp.interfaces.ros.messages import IMU, WRENCH, BadMessage, header, message
from ibvs_qp.interfaces.ros.static_poses import TF, StaticPoses, differences
from ibvs_qp.interfaces.ros.topics import Px4Topics, Topics


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


def test_the_filter_keeps_its_yaw_over_a_gap_and_is_no_attitude_of_a_flight() -> None:
    turning = AttitudeFilter(1.0)
    for tick in range(1, 252):
        before = turning.update(tick * TICK, np.array((0.0, 0.0, 1.0)), REST)
    after = turning.update(252 * TICK + 300_000_000, np.zeros(3), REST)
    np.testing.assert_allclose(after, before, atol=1e-9)
    assert abs(after[3]) > 0.4  # 1 rad
    with pytest.raises(ConfigError, match="attitude_filter_s"):
        BridgeConfig(topics=Px4Topics(attitude_filter_s=1.0))
