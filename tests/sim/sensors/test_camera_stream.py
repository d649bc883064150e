"""Late, stamped frames: rate, latency, pose of the capture, and the worker thread that draws them."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable

import cv2
import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from sim.sensors.cameras import CameraStream, PlaneCamera
from sim.world.canvas import Canvas
from sim.world.scene import CameraScene, Scene

TICK_NS = 4_000_000
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


class CountingCamera:
    """Back end that notes when it was asked."""

    intrinsics = (1.0, 1.0, 0.0, 0.0)

    def __init__(self) -> None:
        self.stamps: list[int] = []

    def capture(self, position_ned: np.ndarray, quaternion_b_in_i: np.ndarray, stamp_ns: int) -> RgbdFrame:
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


class SlowCamera(CountingCamera):
    """Deferred back end that notes the drawing thread, waits for a gate, and fails at the second picture if told to."""

    def __init__(self, fails: bool = False) -> None:
        super().__init__()
        self.fails, self.gate = fails, threading.Event()
        self.threads: list[str] = []

    def expose(self, position_ned: np.ndarray, quaternion_b_in_i: np.ndarray, stamp_ns: int) -> Callable[[], RgbdFrame]:
        frame = self.capture(position_ned, quaternion_b_in_i, stamp_ns)
        number = len(self.stamps)

        def draw() -> RgbdFrame:
            self.gate.wait(10.0)
            self.threads.append(threading.current_thread().name)
            if self.fails and number == 2:
                raise ValueError("broken lens")
            return frame

        return draw


def painted_flight(latency_s: float, threaded: bool, cv_threads: int, ticks: int = 250) -> list[tuple[int, RgbdFrame]]:
    """Frames and arrival times of a camera that moves along the board's lower right corner while the brush paints."""
    scene = Scene(camera=CameraScene(latency_s=latency_s))
    canvas = Canvas(scene, 4)
    camera = PlaneCamera(scene, VehicleParams(), canvas, 4)
    stream = CameraStream(camera, scene.camera.rate_hz, latency_s, threaded)
    before = cv2.getNumThreads()
    cv2.setNumThreads(cv_threads)
    frames, previous = [], None
    position = np.empty(3)  # overwritten in place, as a simulator may do
    for k in range(ticks):
        along = 1.25 - 0.001 * k
        position[0] = -0.7
        position[1:] = canvas.geometry.point(along, 0.05)
        half = 0.01 * np.sin(0.05 * k)
        frame = stream.tick(k * TICK_NS, position, np.array([np.cos(half), np.sin(half), 0.0, 0.3 * half]))
        if frame is not None:
            frames.append((k, frame))
        canvas.stroke(previous, (along, 0.05))
        previous = (along, 0.05)
    stream.close()
    cv2.setNumThreads(before)
    return frames


@pytest.mark.parametrize("latency_s", [0.060, 0.004, 0.0])
def test_the_worker_thread_changes_no_bit(latency_s: float) -> None:
    plain = painted_flight(latency_s, threaded=False, cv_threads=1)
    assert len(plain) >= 28 and plain[0][0] == round(latency_s * 250)
    for cv_threads in (1, 2):
        drawn = painted_flight(latency_s, threaded=True, cv_threads=cv_threads)
        assert [k for k, _ in drawn] == [k for k, _ in plain]
        for (_, one), (_, other) in zip(plain, drawn, strict=True):
            assert one.stamp_ns == other.stamp_ns
            assert np.array_equal(one.rgb, other.rgb) and np.array_equal(one.depth, other.depth)
    red = [int((frame.rgb[..., 0].astype(int) - frame.rgb[..., 2] > 60).sum()) for _, frame in plain]
    assert red[-1] != red[0], "the paint is seen to grow"


def test_paint_that_comes_after_the_capture_stays_out_of_the_picture() -> None:
    scene = Scene()
    canvas = Canvas(scene, 0)
    camera, twin = (PlaneCamera(scene, VehicleParams(), paper, 0) for paper in (canvas, Canvas(scene, 0)))
    pose = np.array([-0.7, *canvas.geometry.point(0.7, 0.05)]), LEVEL
    draw = camera.expose(*pose, 0)
    canvas.stroke((0.85, 0.05), (0.80, 0.05))
    later = canvas.rgb  # looking at the board must not put paint into the picture either
    assert np.array_equal(draw().rgb, twin.capture(*pose, 0).rgb)
    spot = (slice(545, 555), slice(800, 850))
    assert np.abs(later[spot].astype(float).mean(axis=(0, 1)) - scene.paint.color).max() < 6.0


def test_pictures_are_drawn_elsewhere_and_awaited_when_due() -> None:
    camera = SlowCamera()
    stream = CameraStream(camera, 30.0, 0.060)
    assert stream.tick(0, np.zeros(3), LEVEL) is None
    threading.Timer(0.05, camera.gate.set).start()
    frame = stream.tick(60_000_000, np.zeros(3), LEVEL)
    assert frame is not None and frame.stamp_ns == 0
    stream.close()
    assert camera.threads and threading.current_thread().name not in camera.threads


def test_without_latency_or_when_told_so_there_is_no_thread() -> None:
    for latency_s, threaded in ((0.0, True), (0.060, False)):
        camera = SlowCamera()
        stream = CameraStream(camera, 30.0, latency_s, threaded)
        frame = stream.tick(0, np.zeros(3), LEVEL)
        assert (frame is not None) == (latency_s == 0.0)
        assert not camera.threads and camera.stamps == [0]


def test_a_failure_in_the_worker_surfaces_when_the_picture_is_due() -> None:
    camera = SlowCamera(fails=True)
    camera.gate.set()
    stream = CameraStream(camera, 30.0, 0.060)
    arrived, k = 0, 0
    with pytest.raises(ValueError, match="broken lens"):
        for k in range(100):
            frame = stream.tick(k * TICK_NS, np.zeros(3), LEVEL)
            arrived += frame is not None
    stream.close()
    assert arrived == 1 and k * TICK_NS >= camera.stamps[1] + 60_000_000


def test_the_thread_ends_with_its_stream() -> None:
    camera = SlowCamera()
    camera.gate.set()
    before = set(threading.enumerate())
    stream = CameraStream(camera, 30.0, 0.060)
    stream.tick(0, np.zeros(3), LEVEL)
    (worker,) = set(threading.enumerate()) - before
    del stream
    worker.join(5.0)
    assert not worker.is_alive()


LEFT_OPEN = """
import numpy as np
from ibvs_qp.config.vehicle import VehicleParams
from sim.sensors.cameras import CameraStream, PlaneCamera
from sim.world.canvas import Canvas
from sim.world.scene import Scene
scene = Scene()
stream = CameraStream(PlaneCamera(scene, VehicleParams(), Canvas(scene, 0), 0), 30.0, 0.06)
pose = np.array([-0.7, 0.0, 0.0]), np.array([1.0, 0, 0, 0])
for k in range(40):
    stream.tick(k * 4_000_000, *pose)
stream.tick(200_000_000, *pose)
if INTERRUPT:
    raise KeyboardInterrupt
"""


@pytest.mark.parametrize("interrupt", [False, True])
def test_the_interpreter_exits_with_a_picture_under_way(interrupt: bool) -> None:
    code = LEFT_OPEN.replace("INTERRUPT", str(interrupt))
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, cwd=os.getcwd(), check=False
    )
    assert (run.returncode != 0) == interrupt
    assert ("KeyboardInterrupt" in run.stderr) == interrupt and "Exception ignored" not in run.stderr
