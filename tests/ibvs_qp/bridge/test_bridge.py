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
        self.engaged = self.flipped = False

    def go(self, ticks: int = 1) -> BridgeState:
        for _ in range(ticks):
            self.now += TICK
            force = np.array([0, 0, 9.81 if self.flipped else -9.81], np.float32)
            sent = {
                "imu": combined(self.now, accelerometer_m_s2=force),
                "attitude": attitude(self.now),
                "wrench": wrench(self.now),
                MODE: mode(int(self.engaged), int(self.engaged), stamp_ns=self.now),
                "camera_info": encoded(
                    from_intrinsics((30.0, 30.0, 15.0, 11.0), (24, 32), self.now), "sensor_msgs/msg/CameraInfo"
                ),
                "color": encoded(from_rgb(np.zeros((24, 32, 3), np.uint8), self.now), "sensor_msgs/msg/Image"),
                "depth": encoded(from_depth(np.ones((24, 32), np.float32), self.now), "sensor_msgs/msg/Image"),
            }
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
    assert world.go(100) is STOPPED and world.bridge.gate.reason == "flight ended: landed"
    assert world.sent(MOTORS) == [] and world.sent(ALIVE) == []


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


def test_the_lens_of_the_camera_must_be_the_configured_one(monkeypatch: pytest.MonkeyPatch) -> None:
    flight = preset()
    camera = dataclasses.replace(flight.camera, distortion=(0.1, 0.0, 0.0, 0.0))
    world = made(monkeypatch, dataclasses.replace(flight, camera=camera))
    assert world.go(200) is WAITING and "camera.distortion" in world.bridge.gate.reason
