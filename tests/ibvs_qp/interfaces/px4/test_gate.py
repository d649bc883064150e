"""When the bridge may fly."""

from __future__ import annotations

import random

import pytest

pytest.importorskip("rosbags", reason="needs the extra ros")

from ibvs_qp.interfaces.px4.bridge import BridgeState, Gate

TICK = 4_000_000
WAITING, CHECKING, READY, FLYING, STOPPED = BridgeState


class Flight:
    """A gate and its time."""

    def __init__(self) -> None:
        self.gate, self.now = Gate(check_s=0.1), 0

    def go(self, ticks: int = 1, lost=(), missing=(), engaged: bool | None = False) -> BridgeState:
        for _ in range(ticks):
            self.now += TICK
            self.gate.update(self.now, lost, missing, engaged)
        return self.gate.state


@pytest.fixture
def ready() -> Flight:
    flight = Flight()
    assert flight.go(30) is READY
    return flight


def test_ready_only_after_the_whole_check() -> None:
    flight = Flight()
    assert flight.go(20) is CHECKING
    assert flight.go(missing=["wrench"]) is WAITING and flight.gate.reason == "wrench"
    assert flight.go(25) is CHECKING  # it begins anew
    assert flight.gate.reason == "self-check; last fault: wrench"
    assert flight.go(2) is READY


@pytest.mark.parametrize("problem", [{"lost": ["imu"]}, {"missing": ["attitude: turned"]}, {"engaged": None}])
def test_nothing_is_ready_with_a_problem(problem: dict) -> None:
    assert Flight().go(1000, **problem) is WAITING


def test_flies_when_px4_is_engaged_and_not_before(ready: Flight) -> None:
    assert ready.go(100) is READY
    assert ready.go(engaged=True) is FLYING and ready.go(100, engaged=True) is FLYING


def test_does_not_fly_when_px4_was_engaged_before(ready: Flight) -> None:
    flight = Flight()
    assert flight.go(1000, engaged=True) is WAITING and "already" in flight.gate.reason
    # Nor in the very tick in which something is missing.
    assert ready.go(engaged=True, lost=["imu"]) is WAITING
    assert ready.go(1000, engaged=True) is WAITING


@pytest.mark.parametrize("loss", [{"lost": ["imu"], "engaged": True}, {"engaged": None}])
def test_a_lost_link_stops_until_px4_left_offboard(ready: Flight, loss: dict) -> None:
    ready.go(engaged=True)
    assert ready.go(**loss) is STOPPED and "link lost" in ready.gate.reason
    assert ready.go(1000, engaged=True) is STOPPED  # the link is back, but PX4 has not left Offboard mode
    assert ready.go(engaged=None) is STOPPED
    assert ready.go(engaged=False) is CHECKING
    assert (ready.go(20), ready.go(10)) == (CHECKING, READY)


def test_the_operator_takes_over_and_gives_back(ready: Flight) -> None:
    ready.go(engaged=True)
    assert ready.go(engaged=False) is CHECKING
    assert ready.go(engaged=True) is WAITING  # switched back before the check: PX4 had no proof of life
    assert (ready.go(40, engaged=False), ready.go(engaged=True)) == (READY, FLYING)


def test_an_ended_flight_stops(ready: Flight) -> None:
    ready.go(engaged=True)
    ready.gate.stop("flight ended: landed")
    assert ready.go(1000, engaged=True) is STOPPED


def test_no_sequence_flies_without_a_sound_second_of_check() -> None:
    """Before every flight there are 0.1 s without a problem and without Offboard mode."""
    rng = random.Random(0)
    for _ in range(200):
        flight, sound = Flight(), 0
        for _ in range(200):
            lost = ["imu"] if rng.random() < 0.02 else []
            engaged = rng.choice((False, False, False, None)) if rng.random() < 0.05 else rng.random() < 0.03
            before = flight.gate.state
            state = flight.go(lost=lost, engaged=engaged)
            if state is FLYING and before is not FLYING:
                assert sound >= 25 and not lost and engaged
            sound = sound + 1 if not lost and engaged is False and before is not FLYING else 0
