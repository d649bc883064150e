"""The stream that takes pictures at the camera's rate, draws them in the background and delivers them late."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from ibvs_qp.measurement import RgbdFrame
from sim.sensors.cameras.protocol import Camera, DeferredCamera, Schedule
from sim.sensors.cameras.remote import RemoteCamera


class CameraStream:
    """A camera that captures at its rate and delivers late; stamps say when a picture was taken.

    A late picture is drawn by a worker thread in the meantime. Pose and paint are those of the capture and one
    thread draws all pictures in order, so they are the same to the bit with and without it.

    Args:
        camera: The back end; one that is no `DeferredCamera` draws at once.
        rate_hz: Frame rate [Hz].
        latency_s: Capture to delivery [s].
        threaded: Whether a worker thread may draw.
    """

    def __init__(self, camera: Camera, rate_hz: float, latency_s: float, threaded: bool = True) -> None:
        self.camera = camera
        self._schedule = Schedule(rate_hz, latency_s)
        # a camera with a process of its own draws at once and is waited for at delivery
        self._remote = camera if isinstance(camera, RemoteCamera) else None
        late = threaded and latency_s > 0.0 and self._remote is None
        self._expose = camera.expose if late and isinstance(camera, DeferredCamera) else None
        self._worker: ThreadPoolExecutor | None = None

    def tick(self, now_ns: int, position_ned: np.ndarray, quaternion_b_in_i: np.ndarray) -> RgbdFrame | None:
        """Advance to ``now_ns``: capture if due, and return the newest picture that has just become due.

        Args:
            now_ns: Present time.
            position_ned: World position of the body frame's origin [m], (3,).
            quaternion_b_in_i: Attitude (w, x, y, z), (4,).

        Raises:
            Exception: Whatever drawing a picture that is now due has raised.
        """
        if self._schedule.due(now_ns):
            self._schedule.push(now_ns, self._capture(position_ned, quaternion_b_in_i, now_ns))
        frame = None
        for item in self._schedule.arrived(now_ns):
            frame = item.result() if isinstance(item, Future) else item() if callable(item) else item
        assert frame is None or isinstance(frame, RgbdFrame)
        return frame

    def _capture(self, position_ned: np.ndarray, quaternion_b_in_i: np.ndarray, now_ns: int) -> object:
        if self._remote is not None:
            return self._remote.expose(position_ned, quaternion_b_in_i, now_ns)
        if self._expose is None:
            return self.camera.capture(position_ned, quaternion_b_in_i, now_ns)
        if self._worker is None:
            self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="camera")
        return self._worker.submit(self._expose(position_ned, quaternion_b_in_i, now_ns))

    def close(self) -> int:
        """End the worker thread or process; pictures not yet begun are dropped.

        Returns:
            Peak resident memory of the process [bytes], 0 without one.
        """
        if self._worker is not None:
            self._worker.shutdown(wait=True, cancel_futures=True)
            self._worker = None
        return 0 if self._remote is None else self._remote.close()
