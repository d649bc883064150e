"""A camera that captures at its rate and delivers late, as a real one does."""

from __future__ import annotations

import dataclasses

import numpy as np

from ibvs_qp.measurement import RgbdFrame
from sim.sensors.cameras.exposure import Dropouts
from sim.sensors.cameras.protocol import Camera, Schedule
from sim.sensors.cameras.timing import DeliveryErrors


class CameraStream:
    """Pictures at a fixed rate with a fixed latency; stamps give the time of capture, except for their errors.

    Args:
        camera: The back end; it draws at the time of capture.
        rate_hz: Frame rate [Hz].
        latency_s: Capture to delivery [s].
        dropouts: Which pictures are lost, or None for none; a lost one is never drawn.
        errors: Later deliveries and wrong stamps, or None.
    """

    def __init__(
        self,
        camera: Camera,
        rate_hz: float,
        latency_s: float,
        dropouts: Dropouts | None = None,
        errors: DeliveryErrors | None = None,
    ) -> None:
        self.camera, self._dropouts = camera, dropouts
        self._schedule: Schedule[RgbdFrame] = Schedule(rate_hz, latency_s, errors)

    def rests(self, now_ns: int) -> bool:
        """Whether neither a capture nor a delivery is due now, so that `tick` may be skipped."""
        return self._schedule.rests(now_ns)

    def tick(
        self, now_ns: int, position_ned: np.ndarray, quaternion_b_in_i: np.ndarray, twist: np.ndarray | None = None
    ) -> RgbdFrame | None:
        """Advance to ``now_ns``: capture if due, and return the newest picture that has just become due.

        Args:
            now_ns: Present time.
            position_ned: World position of the body frame's origin [m], (3,).
            quaternion_b_in_i: Attitude (w, x, y, z), (4,).
            twist: Velocity of the body's origin [m/s] and angular velocity [rad/s] in B, (6,); None at rest.
        """
        if self._schedule.due(now_ns) and not (self._dropouts is not None and self._dropouts.lost()):
            picture = self.camera.capture(position_ned, quaternion_b_in_i, now_ns, twist)
            stamped = dataclasses.replace(picture, stamp_ns=self._schedule.stamp(now_ns))
            self._schedule.push(now_ns, stamped)
        return self._schedule.pop(now_ns)
