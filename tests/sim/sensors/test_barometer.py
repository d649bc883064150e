"""Barometer: sensor model, gate, faults, log, bag, and the blind descent that ends more gently with it."""

from __future__ import annotations

import dataclasses
import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recorded_flights import flown

from ibvs_qp import SensorFrame
from ibvs_qp.frames import rotate, rotation_from_quaternion
from ibvs_qp.interfaces.log import Recorder, read_log, replay
from ibvs_qp.interfaces.log.messages import decode, encode
from ibvs_qp.validation.sensor_frame import SensorGate
from sim.experiments.scenes import changed, short_job
from sim.faults.rotors import Derate
from sim.flight.closed_loop import fly
from sim.flight.options import FlightOptions
from sim.flight.trace import LANDED, Trace
from sim.sensors.barometer import Barometer
from sim.sensors.suite import SensorSuite
from sim.world.errors import world_errors
from sim.world.plant import Plant
from sim.world.scene import BarometerScene, Scene

TICK_NS = 4_000_000


def frame(tick: int = 100, **changes: Any) -> SensorFrame:
    stamp = tick * TICK_NS
    vectors = {"attitude": np.array([1.0, 0.0, 0.0, 0.0]), "angular_velocity": np.zeros(3), "wrench": np.zeros(6)}
    vectors |= {"specific_force": np.array([0.0, 0.0, -9.81])}
    return SensorFrame(**({"stamp_ns": stamp, "wrench_stamp_ns": stamp, "height_rate": 0.3} | vectors | changes))


def test_without_a_barometer_a_frame_has_no_rate_of_climb() -> None:
    plant = Plant(Scene())
    got = SensorSuite(Scene(), plant.vehicle).sample(plant)
    assert got.height_rate is None and got.height_rate_stamp_ns is None


def test_the_rate_of_climb_is_late_and_noisy_and_positive_upwards() -> None:
    scene = BarometerScene(fitted=True, rate_hz=50.0, latency_s=0.02, sigma_m_s=0.05, wander_m_s=0.0)
    plant, barometer, errors = Plant(Scene()), Barometer(scene, seed=0), []
    sinks: dict[int, float] = {}
    for _ in range(500):
        sinks[plant.time_ns] = rotate(plant.rotation, plant.velocity)[2]
        barometer.sample(plant)
        if barometer.reading:
            stamp = barometer.reading["height_rate_stamp_ns"]
            assert 0.02 <= (plant.time_ns - stamp) * 1e-9 < 0.04
            errors.append(barometer.reading["height_rate"] + sinks[stamp])
        plant.step(1.01 * plant.thrusts_actual)
    assert min(sinks.values()) < -0.5, "it climbs"
    single = errors[:: len(errors) // 99]
    assert abs(np.mean(single)) < 0.02 and np.std(single) == pytest.approx(0.05, rel=0.25)


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"height_rate": math.nan}, "height_rate: not within [-20, 20] m/s"),
        ({"height_rate": -21.0}, "height_rate: not within [-20, 20] m/s"),
        ({"height_rate": "up"}, "height_rate: str, not a number"),
        ({"height_rate_stamp_ns": 0}, "height_rate: 0.4 s old, at most 0.2 s"),
        ({"height_rate_stamp_ns": 10**12}, "height_rate_stamp_ns: not a time"),
        ({"height_rate_stamp_ns": 0.5}, "height_rate_stamp_ns: not a time"),
    ],
)
def test_an_unusable_rate_is_named_and_dropped(changes: dict[str, Any], name: str) -> None:
    gate = SensorGate(latest_s=0.3)
    gate.check(frame(99))
    checked, rejected = gate.check(frame(**changes))
    assert checked is not None and checked.height_rate is None and checked.height_rate_stamp_ns is None
    assert len(rejected) == 1 and rejected[0].startswith(f"sensor {name}")


def test_a_good_rate_and_none_pass() -> None:
    gate = SensorGate(latest_s=0.3)
    late = 80 * TICK_NS
    for given in (
        {},
        {"height_rate_stamp_ns": late},
        {"height_rate": None},
        {"height_rate": None, "height_rate_stamp_ns": 1},
    ):
        gate.reset()
        checked, rejected = gate.check(frame(**given))
        assert checked is not None and not rejected and checked.height_rate == given.get("height_rate", 0.3)
        assert checked.height_rate_stamp_ns == (late if given.get("height_rate_stamp_ns") == late else None)


@pytest.mark.parametrize("value", [0.25, None])
def test_a_log_keeps_the_rate(value: float | None) -> None:
    given = frame(height_rate=value, height_rate_stamp_ns=None if value is None else 5)
    back = decode(encode(given), SensorFrame)
    assert (back.height_rate, back.height_rate_stamp_ns) == (value, given.height_rate_stamp_ns)


@pytest.mark.slow
def test_a_flight_with_a_barometer_replays_to_the_bit(tmp_path: Path) -> None:
    subject, inputs = flown("rotor_loss", "pilot")
    with Recorder(tmp_path / "a.mcap", subject) as recorder:
        for tick, (given,) in enumerate(itertools.islice(inputs, 1000)):
            recorder.step(dataclasses.replace(given, height_rate=-0.01 * (tick % 50)))
            recorder.writer.wait_for_room()
    result = replay(read_log(tmp_path / "a.mcap"))
    assert result.same and result.ticks == 1000, result


def test_a_bag_keeps_the_rate(tmp_path: Path) -> None:
    pytest.importorskip("rosbags", reason="needs the extra ros")
    from ibvs_qp.interfaces.ros.bag import Bag
    from ibvs_qp.interfaces.ros.topics import Topics
    from ibvs_qp.interfaces.ros.write_bag import write_bag

    topics = Topics(height_rate="/climb")
    frames = [
        frame(tick, height_rate=0.01 * (tick // 10), height_rate_stamp_ns=tick // 10 * 10 * TICK_NS)
        for tick in range(50)
    ]
    write_bag(frames, tmp_path / "with", topics)
    back = list(Bag(tmp_path / "with", topics).sensor_frames())
    assert [each.height_rate for each in back] == [each.height_rate for each in frames]
    assert [each.height_rate_stamp_ns for each in back] == [each.height_rate_stamp_ns for each in frames]
    write_bag(frames, tmp_path / "without")
    assert all(each.height_rate is None for each in Bag(tmp_path / "without").sensor_frames())


def descent(**barometer: Any) -> Trace:
    """Harsh flight of a vehicle that loses a rotor 2.5 m above the ground."""
    scene = changed(short_job(0.6, rows=1), board={"bottom_m": 2.5}, barometer=barometer)
    scene = dataclasses.replace(scene, errors=world_errors("harsh"))
    lost = Derate(rotor="mid_right", share=0.0, after="approach", delay_s=0.5, watch_s=20.0)
    return fly(scene, FlightOptions(features="geometric", video=False), faults=(lost,))


def last_second(trace: Trace) -> tuple[float, float]:
    """Largest sink before the touchdown, and largest error of its estimate [m/s]."""
    down = [rotation_from_quaternion(attitude)[2] for attitude in trace.attitude[-250:]]
    sink, estimate = (np.sum(down * each[-250:], axis=1) for each in (trace.velocity, trace.velocity_estimate))
    return float(sink.max()), float(np.abs(estimate - sink).max())


@pytest.mark.slow
def test_a_blind_descent_ends_more_gently_with_a_barometer() -> None:
    without, fitted = descent(), descent(fitted=True)
    assert fitted.reason == LANDED
    (hard, drift), (gentle, error) = last_second(without), last_second(fitted)
    assert gentle < 0.8 * hard and error < 0.4 * drift, (hard, gentle, drift, error)
