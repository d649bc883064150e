"""A camera drawn by a process of its own: pictures are late anyway, so the flight need not wait for them."""

from __future__ import annotations

import itertools
import math
import multiprocessing
import os
import resource
import signal
import sys
import traceback
from collections.abc import Callable
from multiprocessing import resource_tracker
from typing import NoReturn

import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vehicle import VehicleParams
from sim.cameras.protocol import camera_intrinsics
from sim.cameras.rung_pipe import RungPipe
from sim.canvas import Canvas, FreshPaint
from sim.memory import keep_memory
from sim.scene import Scene

#: Time given to the process to end by itself [s].
_END_S = 5.0


def spare_core(processes: int = 1) -> bool:
    """Whether there are cores for a drawing process beside each of so many flying ones."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return cores >= 2 * processes


class RemoteCamera:
    """`PlaneCamera` or `GLCamera` in another process: the same pictures to the bit, handed over in shared memory.

    Pose and fresh paint of a capture are sent to the process, which draws in order. Close it after use.

    Args:
        scene: Board, wall and camera.
        vehicle: Where camera, arm and propellers are.
        seed: Seed of canvas and noise.
        take: `Canvas.take` of the board that is painted here; the process draws its own of the same scene and seed.
        back_end: "plane" or "gl".
        lend: Whether a picture is lent, not given: read it in place before two more have come, it is then overwritten.
    """

    def __init__(
        self,
        scene: Scene,
        vehicle: VehicleParams,
        seed: int,
        take: Callable[[], FreshPaint | None],
        back_end: str = "plane",
        lend: bool = False,
    ) -> None:
        self.intrinsics, self._take, self._lend = camera_intrinsics(scene.camera), take, lend
        shape = (scene.camera.height, scene.camera.width)
        # every picture under way has its place, one is being read, and the one before may still be looked at
        places = math.ceil(scene.camera.latency_s * scene.camera.rate_hz) + 3
        context = multiprocessing.get_context("spawn")
        memory = context.RawArray("B", places * _bytes(shape))
        self._places = _views(memory, places, shape)
        for part in itertools.chain(*self._places):
            part.flags.writeable = False
        self._begun = self._done = 0
        self._pipe, there = RungPipe.pair(context)
        self._process = context.Process(
            target=_draw, args=(back_end, scene, vehicle, seed, memory, places, there), name="camera", daemon=True
        )
        resource_tracker.ensure_running()  # its own start lets Ctrl-C through again
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # Ctrl-C must not hit its imports
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        there.close()

    def capture(self, position_ned: np.ndarray, quaternion_b_in_i: np.ndarray, stamp_ns: int) -> RgbdFrame:
        """Take a picture and wait for it, see `sim.cameras.protocol.Camera`."""
        return self.expose(position_ned, quaternion_b_in_i, stamp_ns)()

    def expose(self, position_ned: np.ndarray, quaternion_b_in_i: np.ndarray, stamp_ns: int) -> Callable[[], RgbdFrame]:
        """Have a picture drawn; what is returned waits for it, and must be called in the order of exposure.

        Raises:
            RuntimeError: When more pictures are under way than the latency allows, or the process has failed.
        """
        kept = 2 if self._lend else 1  # places of pictures that somebody may still read
        if self._begun - self._done >= len(self._places) - kept:
            raise RuntimeError("more pictures under way than the camera's latency allows")
        place = self._begun % len(self._places)
        pose = np.array(position_ned, float), np.array(quaternion_b_in_i, float)
        try:
            self._pipe.send((place, *pose, stamp_ns, self._take()))
        except OSError:
            self._failed()
        self._begun += 1

        def develop() -> RgbdFrame:
            try:
                answer = self._pipe.recv()
            except (EOFError, OSError):
                self._failed()
            if answer != place:
                raise RuntimeError(f"the drawing process failed:\n{answer}")
            self._done += 1
            rgb, depth = self._places[place]
            if not self._lend:
                rgb, depth = rgb.copy(), depth.copy()
            return RgbdFrame(rgb=rgb, depth=depth, intrinsics=self.intrinsics, stamp_ns=stamp_ns)

        return develop

    def _failed(self) -> NoReturn:
        raise RuntimeError("the drawing process died without a word; was it out of memory?") from None

    def close(self) -> int:
        """End the process.

        Returns:
            Its peak resident memory [bytes]; 0 if it cannot tell any more.
        """
        peak = 0
        try:
            self._pipe.send(None)
            while self._pipe.poll(_END_S):
                answer = self._pipe.recv()
                if isinstance(answer, tuple):
                    (peak,) = answer
                    break
        except (EOFError, OSError):
            pass
        self._pipe.close()
        self._process.join(_END_S)
        if self._process.is_alive():
            self._process.terminate()
        return peak


def _bytes(shape: tuple[int, int]) -> int:
    """Size of one picture: three bytes of colour and four of depth a pixel."""
    return 7 * shape[0] * shape[1]


def _views(memory, places: int, shape: tuple[int, int]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Colour (H, W, 3) and depth (H, W) of every place in shared memory; depth first, as it must lie aligned."""
    flat, size, pixels = np.frombuffer(memory, np.uint8), _bytes(shape), shape[0] * shape[1]
    views = []
    for place in range(places):
        part = flat[place * size : (place + 1) * size]
        views.append((part[4 * pixels :].reshape(*shape, 3), part[: 4 * pixels].view(np.float32).reshape(shape)))
    return views


def _open(back_end: str, scene: Scene, vehicle: VehicleParams, seed: int):
    """The camera that draws; OpenGL is loaded only where it is used."""
    canvas = Canvas(scene, seed)
    if back_end == "gl":
        from sim.cameras.gl import GLCamera

        return GLCamera(scene, vehicle, canvas, seed)
    from sim.cameras.plane import PlaneCamera

    return PlaneCamera(scene, vehicle, canvas, seed)


def _draw(
    back_end: str, scene: Scene, vehicle: VehicleParams, seed: int, memory, places: int, pipe: RungPipe
) -> None:
    """Draw what is asked for until None comes or the other end closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the flight decides what Ctrl-C means
    import cv2

    cv2.setNumThreads(1)
    keep_memory()
    try:
        camera = _open(back_end, scene, vehicle, seed)
        views = _views(memory, places, (scene.camera.height, scene.camera.width))
        while True:
            order = pipe.recv()
            if order is None:
                peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
                pipe.send((peak if sys.platform == "darwin" else 1024 * peak,))
                return
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
