"""A camera drawn by a process of its own: pictures are late anyway, so the flight need not wait for them."""

from __future__ import annotations

import collections
import itertools
import math
import multiprocessing
import os
import signal
from collections.abc import Callable
from multiprocessing import resource_tracker
from typing import NoReturn

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.flow_task import FlowAnswer, FlowTask
from sim.sensors.cameras.drawing_process import READY, Order, draw, picture_bytes, picture_views
from sim.sensors.cameras.protocol import camera_intrinsics
from sim.sensors.cameras.rung_pipe import RungPipe
from sim.world.canvas import FreshPaint
from sim.world.scene import Scene

#: Time given to the process to end by itself [s].
_END_S = 5.0


def spare_core(processes: int = 1) -> bool:
    """Whether there are cores for a drawing process beside each of so many flying ones."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return cores >= 2 * processes


class RemoteCamera:
    """`PlaneCamera` or `GLCamera` in another process: the same pictures to the bit, handed over in shared memory.

    Pose and fresh paint of a capture are sent to the process, which draws in order. It also follows the flow from
    picture to picture for who asks (`ibvs_qp.vision.flow_ahead.FlowLink`), of lent pictures. Close it after use.

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
        memory = context.RawArray("B", places * picture_bytes(shape))
        self._places = picture_views(memory, places, shape)
        for part in itertools.chain(*self._places):
            part.flags.writeable = False
        self._begun, self._done, self._set_up = 0, 0, False
        self._taken: collections.deque[tuple[int, int]] = collections.deque(maxlen=places)  # place and stamp
        self._tasks: list[FlowTask] = []
        self._drawn: collections.deque[int] = collections.deque()
        self._followed: collections.deque[FlowAnswer] = collections.deque()
        self._failure = "died without a word; was it out of memory?"
        self._pipe, there = RungPipe.pair(context)
        self._process = context.Process(
            target=draw, args=(back_end, scene, vehicle, seed, memory, places, there), name="camera", daemon=True
        )
        resource_tracker.ensure_running()  # its own start lets Ctrl-C through again
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # Ctrl-C must not hit its imports
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        there.close()

    def wait(self) -> None:
        """Wait until the process is set up.

        Raises:
            RuntimeError: When it has failed.
        """
        while not self._set_up:
            self._receive()

    def capture(self, position_ned: np.ndarray, quaternion_b_in_i: np.ndarray, stamp_ns: int) -> RgbdFrame:
        """Take a picture and wait for it, see `sim.sensors.cameras.protocol.Camera`."""
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
        self._send((place, *pose, stamp_ns, self._take()))
        self._taken.append((place, stamp_ns))
        self._begun += 1

        def develop() -> RgbdFrame:
            while not self._drawn:
                self._receive()
            if self._drawn.popleft() != place:
                raise RuntimeError("pictures must be developed in the order of exposure")
            self._done += 1
            rgb, depth = self._places[place]
            if not self._lend:
                rgb, depth = rgb.copy(), depth.copy()
            return RgbdFrame(rgb=rgb, depth=depth, intrinsics=self.intrinsics, stamp_ns=stamp_ns)

        return develop

    def place(self, rgb: np.ndarray) -> int:
        """Where a lent picture lies, see `ibvs_qp.vision.flow_ahead.FlowLink`."""
        for place, (own, _) in enumerate(self._places):
            if own is rgb:
                return place
        raise RuntimeError("this picture was not lent by this camera")

    def following(self, place: int) -> tuple[int, int] | None:
        """Place of the picture taken after that one, and the time between both [ns]; None if there is none yet."""
        for (before, stamp), (behind, later) in itertools.pairwise(self._taken):
            if before == place:
                return behind, later - stamp
        return None

    def ask(self, task: FlowTask) -> None:
        """Have points followed; told with the next picture or when the answer is wanted: each message wakes a core."""
        self._tasks.append(task)

    def answer(self, number: int) -> FlowAnswer:
        """Wait for the answer to a task; those to earlier ones are dropped."""
        if self._tasks:
            self._send(None)
        while True:
            while not self._followed:
                self._receive()
            answer = self._followed.popleft()
            if answer.number == number:
                return answer

    def _send(self, order: Order | None) -> None:
        tasks, self._tasks = self._tasks, []
        try:
            self._pipe.send((tasks, order))
        except OSError:
            self._failed()

    def _receive(self) -> None:
        """Wait for one answer of the process and put it where it is looked for."""
        try:
            answer = self._pipe.recv()
        except (EOFError, OSError):
            self._failed()
        if isinstance(answer, FlowAnswer):
            self._followed.append(answer)
        elif answer == READY:
            self._set_up = True
        elif isinstance(answer, int):
            self._drawn.append(answer)
        else:
            self._failure = f"failed:\n{answer}"
            self._failed()

    def _failed(self) -> NoReturn:
        raise RuntimeError(f"the drawing process {self._failure}") from None

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
