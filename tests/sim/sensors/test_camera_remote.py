"""Pictures drawn by another process: the same bits, and a clear word when the process fails."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from sim.flight.closed_loop import FlightOptions, World, pilot_config
from sim.sensors.cameras import Camera, CameraStream, PlaneCamera, RemoteCamera, open_camera, resolve_camera
from sim.world.canvas import Canvas
from sim.world.scene import CameraScene, Scene

TICK_NS = 4_000_000
SCENE = Scene(camera=CameraScene(width=424, height=240))
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


@pytest.fixture
def remote() -> Iterator[tuple[Canvas, RemoteCamera]]:
    canvas = Canvas(SCENE, 4)
    camera = RemoteCamera(SCENE, VehicleParams(), 4, canvas.take)
    yield canvas, camera
    camera.close()


def painted_flight(canvas: Canvas, camera: Camera) -> list[tuple[int, RgbdFrame]]:
    """Frames and arrival ticks of a camera that moves along the lower right corner while the brush paints."""
    stream = CameraStream(camera, SCENE.camera.rate_hz, SCENE.camera.latency_s, threaded=False)
    frames, previous, position = [], None, np.empty(3)
    for k in range(150):
        along = 1.25 - 0.001 * k
        position[0], position[1:] = -0.7, canvas.geometry.point(along, 0.05)
        half = 0.01 * np.sin(0.05 * k)
        frame = stream.tick(k * TICK_NS, position, np.array([np.cos(half), np.sin(half), 0.0, 0.3 * half]))
        if frame is not None:
            frames.append((k, frame))
        canvas.stroke(previous, (along, 0.05))
        previous = (along, 0.05)
    return frames


def test_another_process_changes_no_bit(remote: tuple[Canvas, RemoteCamera]) -> None:
    canvas = Canvas(SCENE, 4)
    here = painted_flight(canvas, PlaneCamera(SCENE, VehicleParams(), canvas, 4))
    there = painted_flight(*remote)
    assert len(here) >= 16 and [k for k, _ in here] == [k for k, _ in there]
    for (_, one), (_, other) in zip(here, there, strict=True):
        assert one.stamp_ns == other.stamp_ns and one.intrinsics == other.intrinsics
        assert np.array_equal(one.rgb, other.rgb) and np.array_equal(one.depth, other.depth)
    assert not np.array_equal(here[0][1].rgb, here[-1][1].rgb)
    assert there[-1][1].rgb.base is None, "the frame owns its arrays; the shared place is used again"


@pytest.mark.skipif(resolve_camera("gl")[0] != "gl", reason="no OpenGL without a display")
def test_another_process_changes_no_bit_of_opengl() -> None:
    canvas, sent = Canvas(SCENE, 4), Canvas(SCENE, 4)
    here = painted_flight(canvas, open_camera("gl", SCENE, VehicleParams(), canvas, 4))
    camera = RemoteCamera(SCENE, VehicleParams(), 4, sent.take, "gl")
    try:
        there = painted_flight(sent, camera)
    finally:
        camera.close()
    assert len(here) >= 16 and [k for k, _ in here] == [k for k, _ in there]
    for (_, one), (_, other) in zip(here, there, strict=True):
        assert np.array_equal(one.rgb, other.rgb) and np.array_equal(one.depth, other.depth)


def test_pictures_must_not_pile_up(remote: tuple[Canvas, RemoteCamera]) -> None:
    _, camera = remote
    waiting = [camera.expose(np.array([-0.7, 0.0, 0.0]), LEVEL, k) for k in range(4)]
    with pytest.raises(RuntimeError, match="under way"):
        camera.expose(np.array([-0.7, 0.0, 0.0]), LEVEL, 9)
    assert [develop().stamp_ns for develop in waiting] == [0, 1, 2, 3]


def test_a_dead_process_is_named(remote: tuple[Canvas, RemoteCamera]) -> None:
    _, camera = remote
    camera.capture(np.array([-0.7, 0.0, 0.0]), LEVEL, 0)
    camera._process.kill()
    camera._process.join()
    with pytest.raises(RuntimeError, match="died"):
        camera.capture(np.array([-0.7, 0.0, 0.0]), LEVEL, 1)
    assert camera.close() == 0


def test_an_error_of_the_process_is_told(remote: tuple[Canvas, RemoteCamera]) -> None:
    _, camera = remote
    with pytest.raises(RuntimeError, match=r"drawing process failed:[\s\S]*Traceback"):
        camera.capture(np.zeros(2), LEVEL, 0)


def test_the_world_draws_apart_when_told_and_tells_the_memory() -> None:
    frames: dict[bool, list[RgbdFrame]] = {}
    for apart in (False, True):
        options = FlightOptions(image_size=(424, 240), camera_process=apart)
        world = World(Scene(), options, pilot_config(Scene(), options))
        frames[apart] = [image for image in (_tick(world) for _ in range(40)) if image is not None]
        memory = world.close()
        assert (memory > 20e6) == apart
    assert len(frames[True]) == len(frames[False]) >= 3
    for one, other in zip(frames[False], frames[True], strict=True):
        assert np.array_equal(one.rgb, other.rgb) and np.array_equal(one.depth, other.depth)


def _tick(world: World) -> RgbdFrame | None:
    image = world.sense().image
    world.act(np.full(6, 11.0))
    return image
