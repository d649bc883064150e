"""Force/torque sensor: the truth with rate, noise, bias and delay."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np

from ibvs_qp.config.vehicle import VehicleParams
from sim.sensors.sample_clock import NS, SampleClock
from sim.sensors.wrench_errors import WrenchErrors
from sim.world.errors import ForceTorqueErrors
from sim.world.plant import Plant
from sim.world.random_streams import Normals, stream
from sim.world.readout import PLACES
from sim.world.scene import ForceTorqueScene
from sim.world.slow_noise import random_direction

_WRENCH = PLACES["ft_wrench"]


class ForceTorque:
    """Force/torque sensor with noise, a force bias of constant size and random direction, and a delivery delay.

    The first sample of a flight is delivered without delay, so that every frame has one.

    Args:
        scene: Rate, noise, bias and delay of the scene.
        errors: Further errors of the world.
        vehicle: Where sensor and tool are.
        seed: Seed of the flight.
    """

    def __init__(self, scene: ForceTorqueScene, errors: ForceTorqueErrors, vehicle: VehicleParams, seed: int) -> None:
        self._clock = SampleClock(scene.rate_hz)
        self._latency_ns = round(scene.latency_s * NS)
        self._sigma = np.array([scene.sigma_n] * 3 + [scene.sigma_nm] * 3)
        self._noise = Normals(stream(seed, "force_torque"))
        self.bias = np.append(scene.bias_n * random_direction(self._noise, 3), np.zeros(3))
        self._errors = WrenchErrors(errors, vehicle, seed) if errors != ForceTorqueErrors() else None
        self._line: deque[tuple[int, np.ndarray]] = deque()
        self.reading: dict[str, Any] = {}

    def sample(self, plant: Plant) -> None:
        """Take a sample if one is due, and deliver those whose delay is over."""
        now, line, clock = plant.time_ns, self._line, self._clock
        if now >= clock.next_ns and clock.due(now):
            wrench = plant.truth[_WRENCH] + self.bias + self._sigma * self._noise.take(6)
            line.append((now, wrench if self._errors is None else self._errors.applied(wrench, plant.truth, now)))
        while line and (line[0][0] + self._latency_ns <= now or not self.reading):
            stamp_ns, wrench = line.popleft()
            self.reading = {"wrench": wrench, "wrench_stamp_ns": stamp_ns}
