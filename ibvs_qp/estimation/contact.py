"""Contact estimator: wall distance, push, touch and stiffness combined into one `ContactState` per tick."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ibvs_qp.config import LONGEST_TICK, ContactSettings, ControllerConfig
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.estimation.push import PushFilter
from ibvs_qp.estimation.stiffness import StiffnessEstimator
from ibvs_qp.estimation.touch import TouchDetector
from ibvs_qp.estimation.wall_distance import WallDistance

#: Without a plane for this long [ns], a push means that the tip touches, whatever the drifting distance says.
BLIND_NS = 300_000_000
#: The push noise is learned beyond this multiple of `contact_distance_m`.
FREE_DISTANCES = 2.0


class ContactEstimator:
    """Estimates wall normal, tip distance and rate, push, contact and lambda from sensors alone.

    Attributes:
        state: Result of the last update.

    Args:
        config: Geometry and `contact` settings.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self._settings, self._tick_s, self._tip_ahead = config.contact, config.tick_s, config.vehicle.tip_position_m[0]
        self._wall = WallDistance(config)
        self._push = PushFilter(config.contact)
        self._touch = TouchDetector(config)
        self._stiffness = StiffnessEstimator(config.contact)
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first measurement."""
        for part in (self._wall, self._push, self._touch, self._stiffness):
            part.reset()
        self._stamp = -1
        self.state = self._collect(-1)

    @property
    def touch_threshold(self) -> float:
        """Filtered push that counts as touch [N]."""
        return self._touch.threshold(self._push.push_noise)

    def doubt(self) -> None:
        """Ticks are missing for an unknown time."""
        self._wall.doubt()

    @property
    def plane_ns(self) -> int:
        """Capture time of the last accepted plane, -1 before the first."""
        return self._wall.accepted_ns

    def update(
        self,
        *,
        stamp_ns: int,
        angular_velocity: Sequence[float],
        specific_force: Sequence[float] | None,
        down: Sequence[float],
        contact_wrench: np.ndarray,
        wrench_stamp_ns: int,
        plane: Sequence[float] | None,
        plane_stamp_ns: int,
    ) -> ContactState:
        """Update with the sensors of one tick; wrench and plane count once, when their stamps are new.

        Args:
            stamp_ns: Time of the tick.
            angular_velocity: Omega in B [rad/s], (3,).
            specific_force: Accelerometer in B [m/s^2], (3,), or None.
            down: Unit vector of gravity in B, (3,).
            contact_wrench: Tared wrench ON the vehicle at the centre of mass, FRD [N, N m], (6,).
            wrench_stamp_ns: Time at which it was measured.
            plane: (A, B, C, D) of the wall in C, or None.
            plane_stamp_ns: Time at which it was measured.
        """
        wall, push, touch = self._wall, self._push, self._touch
        dt = self._tick_s if self._stamp < 0 else min(max((stamp_ns - self._stamp) * 1e-9, 0.0), LONGEST_TICK)
        self._stamp = stamp_ns
        wall.predict(stamp_ns, dt, angular_velocity, specific_force, down)
        if plane is not None:
            stationary = touch.time_since_touch(plane_stamp_ns) > self._settings.estimation.stationary_after_s
            wall.correct(plane, plane_stamp_ns, stationary)
        free = not touch.in_contact and wall.distance > FREE_DISTANCES * self._settings.contact_distance_m
        interval = push.add(contact_wrench, wrench_stamp_ns, wall.normal, free)
        if interval is not None:
            touch.add_sample(push.push, push.push_noise)
            if touch.pressed and wall.known and stamp_ns - wall.accepted_ns > BLIND_NS:
                wall.touch()
            if touch.in_contact:
                self._stiffness.add(push.push, -wall.distance, interval)
        if touch.update(stamp_ns, push.push, wall.distance):
            self._stiffness.start()
        self.state = self._collect(stamp_ns)
        return self.state

    def _collect(self, stamp_ns: int) -> ContactState:
        wall, push, touch = self._wall, self._push, self._touch
        depth, ramp = wall.depth, touch.ramp(stamp_ns)
        return ContactState(
            normal=wall.normal,
            known=wall.known,
            distance=wall.distance,
            rate=wall.rate,
            acceleration=wall.acceleration,
            rate_noise=wall.rate_noise,
            acceleration_noise=math.sqrt(wall.vibration.variance),
            bias=wall.bias,
            speed=wall.speed,
            depth=depth,
            push=push.push,
            push_noise=push.push_noise,
            across_noise=push.moment_noise / self._tip_ahead,
            in_contact=touch.in_contact,
            time_since_touch=touch.time_since_touch(stamp_ns),
            ramp=ramp,
            contact_weight=ramp * depth_weight(self._settings, depth),
            stiffness=self._stiffness.value,
            stiffness_known=self._stiffness.known,
        )


def depth_weight(settings: ContactSettings, depth: float) -> float:
    r"""Lambda without its ramp: :math:`\tfrac12(1+\cos(\pi (d-d_{min})/(d_{max}-d_{min})))`, 1 below and 0 above."""
    ratio = (depth - settings.depth_min_m) / (settings.depth_max_m - settings.depth_min_m)
    if ratio >= 1.0:
        return 0.0
    return 1.0 if ratio <= 0.0 else 0.5 * (1.0 + math.cos(math.pi * ratio))
