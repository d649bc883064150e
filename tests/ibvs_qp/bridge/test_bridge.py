"""The whole bridge tick by tick, with queues in place of DDS and a clock of its own."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the extra ros")

from dds_queues import NOW, Queue, attitude, combined, mode, wrench

import ibvs_qp.bridge.bridge as module
from ibvs_qp import Pilot, PilotConfig, SafetyState, preset
from ibvs_qp.bridge.bridge import Bridge
from ibvs_qp.bridge.config import BridgeConfig
from ibvs_qp.bridge.gate import BridgeState
from ibvs_qp.bridge.inputs import MODE, subscriptions
from ibvs_qp.ros.messages import encoded
from ibvs_qp.ros.pictures import from_depth, from_intrinsics, from_rgb

TICK = 4_000_000
WAITING, CHECKING, READY, FLYING, STOPPED = BridgeState
ALIVE, MOTORS = "/fmu/in/offboard_control_mode", "/fmu/in/actuator_motors"


class World:
    """A bridge, and a vehicle at rest that sends everything every tick."""

    def __init__(self, flight: PilotConfig) -> None:
        self.dds, self.now = Queue(), NOW
        config = BridgeConfig(check_s=0.2)
        self.bridge = Bridge(config, flight, clock=lambda: self.now, pilot=Pilot(flight))
        self.topics = {each.role: each.topic for each in subscriptions(config)}
        self.silent: set[str] = set()
        self.late: dict[str, int] = {}  # delay of stamps by role [ns]
        self.every = 1  # ticks between two attitudes
        self.camera_shape, self.lens = (24, 32), "plumb_bob"
        self.engaged = self.flipped = False

    def go(self, ticks: int = 1) -> BridgeState:
        for _ in range(ticks):
            self.now += TICK
            stamp = {role: self.now - self.late.get(role, 0) for role in self.topics}
            info = from_intrinsics((30.0, 30.0, 15.0, 11.0), self.camera_shape, self.now)
            info.distortion_model = self.lens
            force = np.array([0, 0, 9.81 if self.flipped else -9.81], np.float32)
            sent = {
                "imu": combined(stamp["imu"], accelerometer_m_s2=force),
                "attitude": attitude(stamp["attitude"]),
                "wrench": wrench(self.now),
                MODE: mode(int(self.engaged), int(self.engaged), stamp_ns=self.now),
                "camera_info": encoded(info, "sensor_msgs/msg/CameraInfo"),
                "color": encoded(from_rgb(np.zeros((24, 32, 3), np.uint8), self.now), "sensor_msgs/msg/Image"),
                "depth": encoded(from_depth(np.ones((24, 32), np.float32), stamp["depth"]), "sensor_msgs/msg/Image"),
            }
            if self.now // TICK % self.every:
                del sent["attitude"]
            for role, data in sent.items():
                if role not in self.silent:
                    self.dds.readers[self.topics[role]].data.append(data)
            self.bridge.tick(self.now - NOW)
        return self.bridge.gate.state

    def sent(self, topic: str) -> list:
        """What was sent since the last call."""
        return self.dds.readers[topic].take()


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> World:
    return made(monkeypatch, preset())


def made(monkeypatch: pytest.MonkeyPatch, flight: PilotConfig) -> World:
    queues = Queue()
    monkeypatch.setattr(module, "Participant", lambda domain: queues)
    world = World(flight)
    world.dds = queues
    return world


def test_from_rest_to_flight(world: World) -> None:
    assert world.go(40) is CHECKING
    assert world.sent(ALIVE) == []
    assert world.go(25) is READY
    world.go(250)
    assert 19 <= len(world.sent(ALIVE)) <= 26 and world.sent(MOTORS) == []
    world.engaged = True
    assert world.go(50) is FLYING
    motors = world.sent(MOTORS)
    assert len(motors) == 50 == world.bridge.status.commands
    assert motors[-1].timestamp_sample == world.now // 1000
    assert world.bridge.status.phase == "start" and world.bridge.status.safety.startswith("nominal")


@pytest.mark.parametrize("role", ["imu", "attitude", "wrench", "color", "depth", "camera_info", MODE])
def test_every_input_is_needed_before_and_only_inertial_data_and_mode_in_flight(world: World, role: str) -> None:
    world.silent = {role}
    assert world.go(400) is WAITING and world.sent(ALIVE) == []
    assert {MODE: "mode of PX4"}.get(role, role) in world.bridge.gate.reason
    world.silent = set()
    assert world.go(100) is READY
    world.engaged = True
    world.go()
    world.silent = {role}
    world.go(400)
    assert (world.bridge.gate.state is STOPPED) == (role in ("imu", "attitude", MODE))


@pytest.mark.parametrize("role", ["imu", "attitude"])
def test_data_that_arrive_late_never_make_it_ready(world: World, role: str) -> None:
    world.late = {role: 300_000_000}
    assert world.go(400) is WAITING and world.bridge.gate.reason.startswith(f"{role}, ") and world.sent(ALIVE) == []


@pytest.mark.parametrize("role", ["imu", "attitude"])
def test_data_that_become_late_stop_the_flight_though_messages_arrive(world: World, role: str) -> None:
    world.go(100)
    world.engaged = True
    assert world.go(10) is FLYING
    world.late = {role: 90_000_000}
    assert world.go(10) is FLYING  # the pilot estimates them so long
    world.late = {role: 110_000_000}
    assert world.go() is STOPPED and world.bridge.gate.reason == f"link lost: {role}"


def test_a_sample_that_is_sent_again_does_not_count_as_fresh(world: World) -> None:
    world.go(100)
    world.engaged = True
    world.go(10)
    for _ in range(26):  # 0.104 s
        world.late["attitude"] = world.late.get("attitude", 0) + TICK
        world.go()
    assert world.bridge.gate.state is STOPPED and world.bridge.gate.reason == "link lost: attitude"


def test_an_attitude_of_50_hz_never_makes_it_ready(world: World) -> None:
    world.every, world.late = 5, {"attitude": 6_000_000}  # PX4's default, and 6 ms on its way
    states = {world.go() for _ in range(400)}
    assert states == {WAITING, CHECKING} and world.sent(ALIVE) == []
    assert "last fault: attitude: 22 ms old, at most 20 ms" in world.bridge.gate.reason
    world.every = 2
    assert world.go(100) is READY


def test_one_late_sample_does_not_end_a_readiness(world: World) -> None:
    assert world.go(100) is READY
    world.silent = {"attitude"}
    assert world.go(8) is READY


def test_setpoints_end_soon_after_the_mode_is_silent(world: World) -> None:
    """PX4 may have left Offboard mode unseen, and its own setpoints then collide with ours."""
    world.go(100)
    world.engaged = True
    world.go(10)
    world.silent = {MODE}
    assert world.go(round(0.6e9 / TICK)) is FLYING  # PX4 sends it every 0.5 s
    assert world.go(round(0.12e9 / TICK)) is STOPPED


def test_a_stopped_bridge_sends_nothing(world: World) -> None:
    world.go(100)
    world.engaged = True
    world.go(10)
    world.silent = {"imu"}
    assert world.go(26) is STOPPED  # 0.1 s
    world.silent = set()
    world.sent(ALIVE), world.sent(MOTORS)
    assert world.go(500) is STOPPED
    assert world.sent(ALIVE) == [] and world.sent(MOTORS) == []
    world.engaged = False
    assert world.go(100) is READY


def test_the_end_of_the_flight_ends_the_proof_of_life(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    world.go(100)
    world.engaged = True
    world.go(10)
    step = world.bridge.pilot.step

    def terminated(frame):
        return dataclasses.replace(step(frame), safety=SafetyState.TERMINATED, safety_reasons=("landed",))

    monkeypatch.setattr(world.bridge.pilot, "step", terminated)
    world.sent(MOTORS), world.sent(ALIVE)
    assert world.go() is STOPPED and not world.bridge._check.passed  # the next flight needs a rest again
    assert world.go(100) is STOPPED and world.bridge.gate.reason == "flight ended: landed"
    assert world.sent(MOTORS) == [] and world.sent(ALIVE) == []
    world.engaged = False
    assert world.go(100) is READY
    world.engaged = True
    assert world.go() is STOPPED and not world.bridge._check.passed  # it ends in its first tick


def test_every_flight_begins_anew(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    resets, reset = [], world.bridge.pilot.reset
    monkeypatch.setattr(world.bridge.pilot, "reset", lambda: (resets.append(world.now), reset()))
    for flights in (1, 2):
        assert world.go(100) is READY
        world.engaged = True
        assert world.go(50) is FLYING and len(resets) == flights
        world.engaged = False
        assert world.go() is CHECKING


def test_wrong_axes_are_named_and_keep_it_from_being_ready(world: World) -> None:
    world.flipped = True
    assert world.go(400) is WAITING and "FLU" in world.bridge.gate.reason and world.sent(ALIVE) == []


def test_pictures_must_fit_their_camera_info(world: World) -> None:
    world.camera_shape = (480, 640)
    assert world.go(200) is WAITING and world.bridge.gate.reason == "depth"
    assert "depth: size is not that of camera_info" in world.bridge.status.ignored


def test_pictures_must_come_in_pairs(world: World) -> None:
    assert world.go(100) is READY
    world.late = {"depth": 50_000_000}
    assert world.go(130) is WAITING and "pairs of colour and depth" in world.bridge.gate.reason


def test_a_lens_of_another_model_is_no_camera(world: World) -> None:
    world.lens = "equidistant"
    assert world.go(200) is WAITING and "camera_info" in world.bridge.gate.reason


def test_the_lens_of_the_camera_must_be_the_configured_one(monkeypatch: pytest.MonkeyPatch) -> None:
    flight = preset()
    camera = dataclasses.replace(flight.camera, distortion=(0.1, 0.0, 0.0, 0.0))
    world = made(monkeypatch, dataclasses.replace(flight, camera=camera))
    assert world.go(200) is WAITING and "camera.distortion" in world.bridge.gate.reason
