"""What arrives: hostile bytes, clocks and the mode of PX4, without a network."""

from __future__ import annotations

import random
from collections.abc import Callable

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the extra ros")

from dds_queues import NOW, Queue, attitude, camera_info, color, combined, depth, mode, wrench

from ibvs_qp.interfaces.px4.config import BridgeConfig
from ibvs_qp.interfaces.px4.inputs import MODE, Inputs, control_mode, subscriptions
from ibvs_qp.interfaces.ros.messages import IMU, BadMessage, encoded
from ibvs_qp.interfaces.ros.samples import to_imu
from ibvs_qp.interfaces.ros.topics import Px4Topics


class Received:
    """Inputs with queues in place of DDS."""

    def __init__(self, **settings: object) -> None:
        config, self.queue = BridgeConfig(**settings), Queue()  # type: ignore[arg-type]
        self.inputs = Inputs(config, self.queue, lambda: NOW)  # type: ignore[arg-type]
        self.topics, self.held = {each.role: each for each in subscriptions(config)}, self.inputs.held

    def send(self, role: str, *data: bytes) -> None:
        self.queue.readers[self.topics[role].topic].data += data
        self.inputs.poll(NOW)


def test_a_frame_has_the_last_samples_with_their_stamps() -> None:
    received = Received()
    received.send("imu", combined(NOW - 9_000_000), combined(NOW - 5_000_000))
    received.send("attitude", attitude(NOW - 3_000_000))
    assert received.held.frame(NOW) is None
    received.send("wrench", wrench(NOW - 1_000_000))
    frame = received.held.frame(NOW)
    assert frame is not None
    stamps = frame.imu_stamp_ns, frame.attitude_stamp_ns, frame.wrench_stamp_ns, frame.stamp_ns
    assert stamps == (NOW - 5_000_000, NOW - 3_000_000, NOW - 1_000_000, NOW)
    np.testing.assert_array_equal(frame.wrench, np.arange(6.0))


def test_ros_types_serve_as_well_and_the_imu_may_have_the_attitude() -> None:
    received = Received(imu_type=IMU, topics=Px4Topics(imu="/imu/data", attitude=""))
    received.send("imu", encoded(to_imu(NOW, np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3)), IMU))
    received.send("wrench", wrench(NOW))
    frame = received.held.frame(NOW)
    assert frame is not None and abs(frame.attitude[0]) == pytest.approx(1.0)
    assert not received.inputs.older("attitude", NOW, 0.01)


def test_a_picture_is_given_once() -> None:
    received = Received()
    for role, data in {"camera_info": camera_info(NOW), "color": color(NOW), "depth": depth(NOW + 4_000_000)}.items():
        received.send(role, data)
    picture = received.held.take_picture()
    assert picture is not None and picture.stamp_ns == NOW and received.held.take_picture() is None


@pytest.mark.parametrize(
    ("role", "send"), [("imu", combined), ("attitude", attitude), ("wrench", wrench)], ids=["imu", "attitude", "wrench"]
)
@pytest.mark.parametrize("offset_ns", [-1_001_000_000, 21_000_000, -NOW + 5_000_000_000])
def test_stamps_of_another_clock_are_ignored(role: str, send: Callable[[int], bytes], offset_ns: int) -> None:
    received = Received()
    received.send(role, send(NOW + offset_ns))
    assert role not in received.held.last and received.inputs.older(role, NOW, 1e6)
    assert dict(received.held.ignored) == {f"{role}: stamp is not of this computer's clock, or too old": 1}


def test_the_mode_of_px4() -> None:
    for more in (0, 7, 10, 14):  # the fields behind differ between versions of PX4
        engaged = {flags: control_mode(mode(*flags, more)).engaged for flags in ((0, 0), (0, 1), (1, 0), (1, 1))}
        assert engaged == {(0, 0): False, (0, 1): False, (1, 0): False, (1, 1): True}
    for data in (b"", mode(1, 1)[:16], b"\0\7" + mode(1, 1)[2:], mode(2, 1), mode(1, 255)):
        with pytest.raises(BadMessage):
            control_mode(data)


def test_a_mode_of_another_time_does_not_count() -> None:
    """Random bytes on the topic would otherwise engage the bridge: DDS makes true of every byte but zero."""
    received = Received()
    for stamp in (NOW + 10**9, NOW - 2 * 10**9, 0):
        received.send(MODE, mode(1, 1, stamp_ns=stamp))
    assert received.inputs.mode is None and received.inputs.older(MODE, NOW, 1e6)
    received.send(MODE, mode(1, 1))
    assert received.inputs.mode is not None and received.inputs.mode.engaged


@pytest.mark.parametrize("role", ["camera_info", "color", "imu", MODE])
def test_messages_beyond_a_size_are_left_out_before_they_are_decoded(
    monkeypatch: pytest.MonkeyPatch, role: str
) -> None:
    monkeypatch.setattr("ibvs_qp.interfaces.px4.inputs.decoded", lambda data, name: pytest.fail("decoded"))
    received = Received()
    received.send(role, mode(1, 1, more=received.topics[role].largest))
    assert dict(received.held.ignored) == {f"{role}: too large": 1} and received.inputs.mode is None


def test_a_hundred_thousand_broken_packets_change_nothing() -> None:
    """Random bytes, and good messages with bytes changed, cut or added: never a raise, and no frame of nonsense."""
    received, rng = Received(), random.Random(0)
    good = {"imu": combined(NOW), "attitude": attitude(NOW), "wrench": wrench(NOW), "color": color(NOW)}
    good |= {"depth": depth(NOW), "camera_info": camera_info(NOW), MODE: mode(0, 0)}

    def broken(message: bytes) -> bytes:
        data, kind = bytearray(message), rng.randrange(4)
        if kind == 0:
            return rng.randbytes(rng.randrange(200))
        if kind == 1:
            del data[rng.randrange(len(data)) :]
        elif kind == 2:
            data += rng.randbytes(rng.randrange(4, 40))
        else:
            for _ in range(rng.randrange(1, 20)):
                data[rng.randrange(len(data))] = rng.randrange(256)
        return bytes(data)

    for _ in range(1563):
        role = rng.choice(list(good))
        received.send(role, *(broken(good[role]) for _ in range(64)))
        if (frame := received.held.frame(NOW)) is not None:
            vectors = frame.attitude, frame.angular_velocity, frame.specific_force, frame.wrench
            assert all(np.isfinite(vector).all() for vector in vectors)
            assert abs(np.linalg.norm(frame.attitude) - 1.0) < 0.01
            assert all(abs(s - NOW) <= 10**9 for s in (frame.imu_stamp_ns, frame.wrench_stamp_ns) if s is not None)
    assert len(received.held.ignored) < 60  # reasons are few, whatever comes
    assert sum(received.held.ignored.values()) > 50_000
    assert len(received.held._waiting["color"]) <= 4
