"""Late, stamped frames: rate, latency, pose of the capture."""

from __future__ import annotations

import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from sim.sensors.cameras import CameraStream, PlaneCamera
from sim.world.canvas import Canvas
from sim.world.scene import Scene

TICK_NS = 4_000_000


class CountingCamera:
    """Back end that records the time of every capture."""

    intrinsics = (1.0, 1.0, 0.0, 0.0)

    def __init__(self) -> None:
        self.stamps: list[int] = []

    def capture(
        self,
        position_ned: np.ndarray,
        quaternion_b_in_i: np.ndarray,
        stamp_ns: int,
        twist: np.ndarray | None = None,
    ) -> RgbdFrame:
        self.stamps.append(stamp_ns)
        depth = np.full((1, 1), position_ned[0], np.float32)
        return RgbdFrame(rgb=np.zeros((1, 1, 3), np.uint8), depth=depth, intrinsics=self.intrinsics, stamp_ns=stamp_ns)


def test_stream_is_late_and_stamped_with_the_time_of_capture() -> None:
    camera, tick = CountingCamera(), TICK_NS
    stream = CameraStream(camera, 30.0, 0.060)
    arrivals = []
    for k in range(501):
        frame = stream.tick(k * tick, np.array([float(k), 0, 0]), np.array([1.0, 0, 0, 0]))
        if frame is not None:
            arrivals.append((k * tick, frame))
    assert len(camera.stamps) == 61 and camera.stamps[0] == 0
    assert np.diff(camera.stamps).mean() == pytest.approx(1e9 / 30.0, rel=1e-3)
    assert set(np.diff(camera.stamps)) <= {32_000_000, 36_000_000}
    for now, frame in arrivals:
        assert 60_000_000 <= now - frame.stamp_ns < 64_000_000
        assert frame.depth[0, 0] == frame.stamp_ns / tick, "pose of the capture, not of the delivery"
        assert isinstance(frame.stamp_ns, int)
    assert [frame.stamp_ns for _, frame in arrivals] == camera.stamps[: len(arrivals)]


def test_stream_drops_what_a_slow_caller_missed() -> None:
    camera = CountingCamera()
    stream = CameraStream(camera, 100.0, 0.010)
    quiet = np.array([1.0, 0, 0, 0])
    assert stream.tick(0, np.zeros(3), quiet) is None
    assert stream.tick(10_000_000, np.zeros(3), quiet) is not None
    frame = stream.tick(95_000_000, np.zeros(3), quiet)
    assert frame is not None and frame.stamp_ns == 10_000_000
    assert stream.tick(96_000_000, np.zeros(3), quiet) is None
    assert camera.stamps == [0, 10_000_000, 95_000_000]


def test_paint_that_comes_after_the_capture_stays_out_of_the_picture() -> None:
    scene = Scene()
    canvas = Canvas(scene, 0)
    camera = CameraStream(PlaneCamera(scene, VehicleParams(), canvas, 0), 30.0, 0.004)
    twin = PlaneCamera(scene, VehicleParams(), Canvas(scene, 0), 0)
    pose = np.array([-0.7, *canvas.geometry.point(0.7, 0.05)]), np.array([1.0, 0.0, 0.0, 0.0])
    assert camera.tick(0, *pose) is None
    canvas.stroke((0.85, 0.05), (0.80, 0.05))
    later, late = canvas.rgb, camera.tick(TICK_NS, *pose)
    assert late is not None and np.array_equal(late.rgb, twin.capture(*pose, 0).rgb)
    spot = (slice(545, 555), slice(800, 850))
    assert np.abs(later[spot].astype(float).mean(axis=(0, 1)) - scene.paint.color).max() < 6.0
