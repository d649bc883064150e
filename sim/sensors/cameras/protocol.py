"""Interface of a camera back end, and the schedule of capture and delivery."""

from __future__ import annotations

import math
from collections import deque
from typing import Generic, Protocol, TypeVar

import numpy as np

from ibvs_qp.measurement import RgbdFrame
from sim.sensors.cameras.timing import DeliveryErrors
from sim.world.scene import CameraScene

NS_PER_S = 1_000_000_000
#: Output of a sensor.
Item = TypeVar("Item")


def camera_intrinsics(camera: CameraScene) -> tuple[float, float, float, float]:
    """Square-pixel intrinsics (fx, fy, cx, cy) [px] with pixel centres at integers: f = (H / 2) / tan(fov / 2)."""
    focal = 0.5 * camera.height / math.tan(0.5 * math.radians(camera.vertical_fov_deg))
    return focal, focal, 0.5 * (camera.width - 1), 0.5 * (camera.height - 1)


class Camera(Protocol):
    """An RGB-D camera on the vehicle.

    Attributes:
        intrinsics: (fx, fy, cx, cy) [px], pixel centres at integers.
    """

    intrinsics: tuple[float, float, float, float]

    def capture(
        self,
        position_ned: np.ndarray,
        quaternion_b_in_i: np.ndarray,
        stamp_ns: int,
        twist: np.ndarray | None = None,
    ) -> RgbdFrame:
        """Take a picture.

        Args:
            position_ned: World position of the body frame's origin [m], (3,).
            quaternion_b_in_i: Attitude (w, x, y, z), (4,).
            stamp_ns: Time of capture; of the middle row if the rows are exposed in sequence.
            twist: Velocity of the body's origin [m/s] and angular velocity [rad/s] in B, (6,); None at rest.
        """
        ...


class Schedule(Generic[Item]):
    """When to capture and when to deliver: a fixed rate and a fixed latency in integer nanoseconds.

    Args:
        rate_hz: Captures per second.
        latency_s: Capture to delivery [s].
        errors: Later deliveries and wrong stamps, or None.
    """

    def __init__(self, rate_hz: float, latency_s: float, errors: DeliveryErrors | None = None) -> None:
        self._errors = errors
        self._rate_hz, self._latency_ns = rate_hz, round(latency_s * NS_PER_S)
        self._start_ns: int | None = None
        self._next_ns = -1
        self._queue: deque[tuple[int, Item]] = deque()

    def due(self, now_ns: int) -> bool:
        """Whether a capture is due now; counts it. The first call starts the clock and captures."""
        if self._start_ns is None:
            self._start_ns = self._next_ns = now_ns
        if now_ns < self._next_ns:
            return False
        # Captures that a slow caller missed are lost, as in a camera; pictures do not pile up.
        captures = math.floor((now_ns - self._start_ns) * self._rate_hz / NS_PER_S + 1e-6) + 1
        self._next_ns = self._start_ns + round(captures * NS_PER_S / self._rate_hz)
        return True

    def rests(self, now_ns: int) -> bool:
        """Whether neither a capture nor a delivery is due now; counts nothing."""
        return now_ns < self._next_ns and not (self._queue and self._queue[0][0] <= now_ns)

    def stamp(self, captured_ns: int) -> int:
        """Stamp that an item captured at ``captured_ns`` carries; call it once per item."""
        return captured_ns if self._errors is None else self._errors.stamp_ns(captured_ns)

    def push(self, captured_ns: int, item: Item) -> None:
        """Queue an item captured at ``captured_ns``; items arrive in their order."""
        delay_ns = 0 if self._errors is None else self._errors.delay_ns()
        self._queue.append((captured_ns + self._latency_ns + delay_ns, item))

    def pop(self, now_ns: int) -> Item | None:
        """The newest item that has arrived since the last call, or None."""
        newest = None
        while self._queue and self._queue[0][0] <= now_ns:
            newest = self._queue.popleft()[1]
        return newest
