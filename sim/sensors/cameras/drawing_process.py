"""What the process of a `RemoteCamera` does: draws pictures into shared memory and follows points through them."""

from __future__ import annotations

import resource
import signal
import sys
import traceback

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.vision.flow_worker import FlowWorker
from sim.flight.memory import keep_memory
from sim.sensors.cameras.rung_pipe import RungPipe
from sim.world.canvas import Canvas, FreshPaint
from sim.world.scene import Scene

#: A picture to draw: place in the shared memory, position, quaternion, stamp [ns] and what is new of the paint.
Order = tuple[int, np.ndarray, np.ndarray, int, FreshPaint | None]

#: Sent when everything is set up, where pictures are answered by their place.
READY = -1


def picture_bytes(shape: tuple[int, int]) -> int:
    """Size of one picture: three bytes of colour and four of depth a pixel."""
    return 7 * shape[0] * shape[1]


def picture_views(memory, places: int, shape: tuple[int, int]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Colour (H, W, 3) and depth (H, W) of every place in shared memory; depth first, as it must lie aligned."""
    flat, size, pixels = np.frombuffer(memory, np.uint8), picture_bytes(shape), shape[0] * shape[1]
    views = []
    for place in range(places):
        part = flat[place * size : (place + 1) * size]
        views.append((part[4 * pixels :].reshape(*shape, 3), part[: 4 * pixels].view(np.float32).reshape(shape)))
    return views


def _open(back_end: str, scene: Scene, vehicle: VehicleParams, seed: int):
    """The camera that draws; OpenGL is loaded only where it is used."""
    canvas = Canvas(scene, seed)
    if back_end == "gl":
        from sim.sensors.cameras.gl import GLCamera

        return GLCamera(scene, vehicle, canvas, seed)
    from sim.sensors.cameras.plane import PlaneCamera

    return PlaneCamera(scene, vehicle, canvas, seed)


def draw(back_end: str, scene: Scene, vehicle: VehicleParams, seed: int, memory, places: int, pipe: RungPipe) -> None:
    """Do what is asked for, each time flow tasks and then a picture (or None), until None comes or the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the flight decides what Ctrl-C means
    import cv2

    cv2.setNumThreads(1)
    keep_memory()
    try:
        camera = _open(back_end, scene, vehicle, seed)
        views = picture_views(memory, places, (scene.camera.height, scene.camera.width))
        worker = FlowWorker()
        pipe.send(READY)
        while True:
            message = pipe.recv()
            if message is None:
                peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
                pipe.send((peak if sys.platform == "darwin" else 1024 * peak,))
                return
            tasks, order = message
            for task in tasks:
                followed = worker.run(task, views)
                if followed is not None:
                    pipe.send(followed)
            if order is None:
                continue
            place, position, quaternion, stamp_ns, paint = order
            frame = camera.develop(position, quaternion, stamp_ns, paint, views[place])
            for drawn, wanted in zip((frame.rgb, frame.depth), views[place], strict=True):
                if drawn is not wanted:
                    wanted[:] = drawn
            pipe.send(place)
    except (EOFError, BrokenPipeError):  # the flight is over, or was never
        return
    except Exception:
        pipe.send(traceback.format_exc())
