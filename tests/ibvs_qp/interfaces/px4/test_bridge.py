"""The whole bridge tick by tick, with queues in place of DDS and a clock of its own."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs the extra ros")

from dds_queues import NOW, Queue, attitude, camera_info, color, combined, depth, mode, wrench

import ibvs_qp.interfaces.px4.bridge as module
from ibvs_qp import Pilot, PilotConfig, SafetyState, preset
from ibvs_qp.interfaces.px4.bridge import Bridge, BridgeState
from ibvs_qp.interfaces.px4.config import BridgeConfig
from ibvs_qp.interfaces.px4.inputs import MODE, subscriptions

TICK = 4_000_000
WAITING, CHECKING, READY, FLYING, STOPPED = BridgeState
ALIVE, MOTORS = "/fmu/in/offboard_control_mode", "/fmu/in/actuator_motors"
SHAPE = (24, 32)


class World:
    """A bridge, and a vehicle at rest that sends everything every tick."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, flight: PilotConfig) -> None:
        self.dds, self.now, config = Queue(), NOW, BridgeConfig(check_s=0.2)
        monkeypatch.setattr(module, "Participant", lambda domain: self.dds)
        self.bridge = Bridge(config, flight, clock=lambda: self.now, pilot=Pilot(flight))
        self.gate, self.topics = self.bridge.gate, {each.role: each.topic for each in subscriptions(config)}
        self.silent: set[str] = set()
        self.late: dict[str, int] = {}  # delay of stamps by role [ns]
        self.every = 1  # ticks between two attitudes
        self.camera_shape, self.lens, self.gravity = SHAPE, "plumb_bob", 9.81
        self.engaged = False

    def go(self, ticks: int = 1, engaged: bool | None = None, silent: set[str] | None = None) -> BridgeState:
        self.engaged = self.engaged if engaged is None else engaged
        self.silent = self.silent if silent is None else silent
        for _ in range(ticks):
            self.now += TICK
            stamp = {role: self.now - self.late.get(role, 0) for role in self.topics}
            sent = {
                "imu": combined(stamp["imu"], accelerometer_m_s2=np.array([0, 0, -self.gravity], np.float32)),
                "attitude": attitude(stamp["attitude"]),
                "wrench": wrench(self.now),
                MODE: mode(self.engaged, self.engaged, stamp_ns=self.now),
                "camera_info": camera_info(self.now, self.camera_shape, self.lens),
                "color": color(self.now, SHAPE),
                "depth": depth(stamp["depth"], SHAPE),
            }
            skipped = self.silent | ({"attitude"} if self.now // TICK % self.every else set())
            for role in sent.keys() - skipped:
                self.dds.readers[self.topics[role]].data.append(sent[role])
            self.bridge.tick(self.now - NOW)
        return self.gate.state

    def sent(self, topic: str) -> list:
        """Messages since the last call."""
        return self.dds.readers[topic].take()


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> World:
    return World(monkeypatch, preset())


@pytest.fixture
def flying(world: World) -> World:
    assert world.go(100) is READY and world.go(10, engaged=True) is FLYING
    world.sent(ALIVE), world.sent(MOTORS)
    return world


def test_from_rest_to_flight(world: World) -> None:
    assert world.go(40) is CHECKING and world.sent(ALIVE) == []
    assert world.go(25) is READY
    world.go(250)
    assert 19 <= len(world.sent(ALIVE)) <= 26 and world.sent(MOTORS) == []
    assert world.go(50, engaged=True) is FLYING
    motors = world.sent(MOTORS)
    assert len(motors) == 50 == world.bridge.status.commands
    assert motors[-1].timestamp_sample == world.now // 1000
    assert world.bridge.status.phase == "start" and world.bridge.status.safety.startswith("nominal")


@pytest.mark.slow
@pytest.mark.parametrize("role", ["imu", "attitude", "wrench", "color", "depth", "camera_info", MODE])
def test_every_input_is_needed_before_and_only_inertial_data_and_mode_in_flight(world: World, role: str) -> None:
    assert world.go(400, silent={role}) is WAITING and world.sent(ALIVE) == []
    assert {MODE: "mode of PX4"}.get(role, role) in world.gate.reason
    assert world.go(100, silent=set()) is READY
    world.go(engaged=True)
    assert (world.go(400, silent={role}) is STOPPED) == (role in ("imu", "attitude", MODE))


@pytest.mark.parametrize("role", ["imu", "attitude"])
def test_data_that_arrive_late_never_make_it_ready(world: World, role: str) -> None:
    world.late = {role: 300_000_000}
    assert world.go(400) is WAITING and world.gate.reason.startswith(f"{role}, ") and world.sent(ALIVE) == []


@pytest.mark.parametrize("role", ["imu", "attitude"])
def test_data_that_become_late_stop_the_flight_though_messages_arrive(flying: World, role: str) -> None:
    flying.late = {role: 90_000_000}
    assert flying.go(30) is FLYING  # the pilot estimates them so long
    flying.late = {role: 110_000_000}
    # Samples that are older than the one before are left out; 12 ms later that one is too old itself.
    assert flying.go(3) is STOPPED and flying.gate.reason == f"link lost: {role}"


def test_a_sample_that_is_sent_again_does_not_count_as_fresh(flying: World) -> None:
    for _ in range(26):  # 0.104 s
        flying.late["attitude"] = flying.late.get("attitude", 0) + TICK
        flying.go()
    assert flying.gate.state is STOPPED and flying.gate.reason == "link lost: attitude"


def test_an_attitude_of_50_hz_never_makes_it_ready(world: World) -> None:
    world.every, world.late = 5, {"attitude": 6_000_000}  # PX4's default, and 6 ms on its way
    assert {world.go() for _ in range(400)} == {WAITING, CHECKING} and world.sent(ALIVE) == []
    assert "last fault: attitude: 22 ms old, at most 20 ms" in world.gate.reason
    world.every = 2
    assert world.go(100) is READY


def test_one_late_sample_does_not_end_a_readiness(world: World) -> None:
    assert world.go(100) is READY
    assert world.go(8, silent={"attitude"}) is READY


def test_setpoints_end_soon_after_the_mode_is_silent(flying: World) -> None:
    """PX4 may have left Offboard mode unseen, and its own setpoints then collide with ours."""
    assert flying.go(round(0.6e9 / TICK), silent={MODE}) is FLYING  # PX4 sends it every 0.5 s
    assert flying.go(round(0.12e9 / TICK)) is STOPPED


def test_a_stopped_bridge_sends_nothing(flying: World) -> None:
    assert flying.go(26, silent={"imu"}) is STOPPED  # 0.1 s
    flying.sent(ALIVE), flying.sent(MOTORS)
    assert flying.go(500, silent=set()) is STOPPED
    assert flying.sent(ALIVE) == [] and flying.sent(MOTORS) == []
    assert flying.go(100, engaged=False) is READY


def test_the_end_of_the_flight_ends_the_proof_of_life(flying: World, monkeypatch: pytest.MonkeyPatch) -> None:
    step = flying.bridge.pilot.step

    def terminated(frame):
        return dataclasses.replace(step(frame), safety=SafetyState.TERMINATED, safety_reasons=("landed",))

    monkeypatch.setattr(flying.bridge.pilot, "step", terminated)
    assert flying.go() is STOPPED and not flying.bridge._check.passed  # the next flight needs a rest again
    assert flying.go(100) is STOPPED and flying.gate.reason == "flight ended: landed"
    assert flying.sent(MOTORS) == [] and flying.sent(ALIVE) == []
    assert flying.go(100, engaged=False) is READY
    assert flying.go(engaged=True) is STOPPED and not flying.bridge._check.passed  # it ends in its first tick


def test_every_flight_begins_anew(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    resets, reset = [], world.bridge.pilot.reset
    monkeypatch.setattr(world.bridge.pilot, "reset", lambda: (resets.append(world.now), reset()))
    for flights in (1, 2):
        assert world.go(100) is READY
        assert world.go(50, engaged=True) is FLYING and len(resets) == flights
        assert world.go(engaged=False) is CHECKING


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"gravity": -9.81}, "FLU"),
        ({"camera_shape": (480, 640)}, "depth"),
        ({"lens": "equidistant"}, "camera_info"),
    ],
    ids=str,
)
def test_wrong_axes_and_cameras_are_named_and_keep_it_from_being_ready(
    world: World, wrong: dict[str, object], reason: str
) -> None:
    vars(world).update(wrong)
    assert world.go(400) is WAITING and reason in world.gate.reason and world.sent(ALIVE) == []
    if "camera_shape" in wrong:
        assert world.gate.reason == "depth"
        assert "depth: size is not that of camera_info" in world.bridge.status.ignored


def test_pictures_must_come_in_pairs(world: World) -> None:
    assert world.go(100) is READY
    world.late = {"depth": 400_000_000}
    assert world.go(130) is WAITING and "pairs of colour and depth" in world.gate.reason


def test_the_lens_of_the_camera_must_be_the_configured_one(monkeypatch: pytest.MonkeyPatch) -> None:
    flight = preset()
    camera = dataclasses.replace(flight.camera, distortion=(0.1, 0.0, 0.0, 0.0))
    world = World(monkeypatch, dataclasses.replace(flight, camera=camera))
    assert world.go(200) is WAITING and "camera.distortion" in world.gate.reason
