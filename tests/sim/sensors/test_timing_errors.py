"""Errors of delivery and stamps: stated sizes, order of arrival, and contents that never change."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest
from controller_scenes import TICK_NS

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import FeatureFrame, RgbdFrame
from sim.sensors.cameras import CameraStream
from sim.sensors.cameras.protocol import Schedule
from sim.sensors.cameras.timing import DeliveryErrors, delivery_errors
from sim.sensors.features import GeometricFeatures
from sim.world.errors import TimingErrors, WorldErrors
from sim.world.painted_edges import PaintedEdges
from sim.world.plant import Plant
from sim.world.scene import Scene

STAMPS = TimingErrors(stamp_error_s=-0.005, stamp_jitter_s=0.004)


class Blank:
    """A camera whose pictures hold the number of the capture."""

    intrinsics = (500.0, 500.0, 319.5, 239.5)

    def __init__(self) -> None:
        self.captures = 0

    def capture(self, position_ned: np.ndarray, quaternion_b_in_i: np.ndarray, stamp_ns: int, *_: Any) -> RgbdFrame:
        self.captures += 1
        rgb = np.full((2, 2, 3), self.captures % 256, np.uint8)
        return RgbdFrame(rgb=rgb, depth=np.ones((2, 2)), intrinsics=self.intrinsics, stamp_ns=stamp_ns)


def pictures(timing: TimingErrors, ticks: int, seed: int = 0) -> list[tuple[int, RgbdFrame]]:
    """Times of delivery [ns] and pictures of a stream at 30 Hz with a latency of 60 ms."""
    stream = CameraStream(Blank(), 30.0, 0.060, errors=delivery_errors(timing, seed))
    found = ((tick * TICK_NS, stream.tick(tick * TICK_NS, np.zeros(3), np.zeros(4))) for tick in range(ticks))
    return [(now, picture) for now, picture in found if picture is not None]


def features(timing: TimingErrors, ticks: int = 60) -> list[FeatureFrame]:
    scene = Scene(errors=WorldErrors(timing=timing))
    plant = Plant(scene)
    sensor = GeometricFeatures(scene, VehicleParams(), PaintedEdges(scene), 0)
    found = (sensor.tick(n * TICK_NS, plant.position, plant.quaternion, plant.velocity) for n in range(ticks))
    return [frame for frame in found if frame is not None]


def test_stamps_are_off_by_the_stated_size():
    errors = DeliveryErrors(STAMPS, 0)
    captured = np.arange(1, 5001) * 33_333_333
    off = (np.array([errors.stamp_ns(int(now)) for now in captured]) - captured) * 1e-9
    assert off.mean() == pytest.approx(-0.005, abs=2e-4)
    assert off.std() == pytest.approx(0.004, rel=0.03)


def test_stamps_never_run_back():
    errors = DeliveryErrors(TimingErrors(stamp_jitter_s=0.05), 0)
    stamps = [errors.stamp_ns(index * 5_000_000) for index in range(500)]
    assert stamps[0] >= 0 and all(late > early for early, late in itertools.pairwise(stamps))


def test_latency_is_exponential_with_the_stated_mean_and_keeps_the_order():
    errors = DeliveryErrors(TimingErrors(jitter_s=0.008), 0)
    delays = np.array([errors.delay_ns() for _ in range(20_000)]) * 1e-9
    assert delays.mean() == pytest.approx(0.008, rel=0.03) and delays.std() == pytest.approx(0.008, rel=0.04)
    found = pictures(TimingErrors(jitter_s=0.03), 5000)
    late = [(now - picture.stamp_ns) * 1e-9 for now, picture in found]
    assert min(late) >= 0.060 and max(late) > 0.150
    stamps = [picture.stamp_ns for _, picture in found]
    assert stamps == sorted(stamps)


def test_the_content_of_a_picture_is_the_one_of_its_capture():
    exact, wrong = pictures(TimingErrors(), 500)[1:], pictures(STAMPS, 500)[1:]  # no stamp lies before the flight
    for (now, picture), (moment, moved) in zip(exact, wrong, strict=True):
        assert now == moment
        np.testing.assert_array_equal(picture.rgb, moved.rgb)
        assert picture.stamp_ns != moved.stamp_ns


def test_all_stamps_of_a_feature_frame_move_alike_and_nothing_else():
    for exact, wrong in zip(features(TimingErrors())[1:], features(STAMPS)[1:], strict=True):
        assert wrong.stamp_ns == wrong.velocity_stamp_ns != exact.stamp_ns
        assert {line.stamp_ns for line in wrong.lines} == {wrong.stamp_ns}
        for one, other in zip(exact.lines, wrong.lines, strict=True):
            assert (one.rho, one.theta, one.track_id) == (other.rho, other.theta, other.track_id)
        np.testing.assert_array_equal(exact.velocity, wrong.velocity)
        assert exact.plane == wrong.plane


def test_no_errors_without_timing_errors_and_the_same_bits_for_the_same_seed():
    assert delivery_errors(TimingErrors(), 0) is None
    plain, zero = Schedule(30.0, 0.06), Schedule(30.0, 0.06, DeliveryErrors(TimingErrors(), 0))
    assert [plain.stamp(now) for now in range(0, 10**9, 10**8)] == [zero.stamp(now) for now in range(0, 10**9, 10**8)]
    jitter = dataclasses.replace(STAMPS, jitter_s=0.01)

    def key(seed: int) -> list[tuple[int, int]]:
        return [(now, picture.stamp_ns) for now, picture in pictures(jitter, 300, seed)]

    assert key(1) == key(1) != key(2)
