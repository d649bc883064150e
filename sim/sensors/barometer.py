"""Barometer with a vertical-speed filter: rate of climb with rate, noise, slow error and delay."""

from __future__ import annotations

from collections import deque
from typing import Any

from sim.sensors.sample_clock import NS, SampleClock
from sim.world.plant import Plant
from sim.world.random_streams import Normals, stream
from sim.world.readout import PLACES
from sim.world.scene import BarometerScene
from sim.world.slow_noise import SlowNoise

_SINK = PLACES["sink"].start


class Barometer:
    """Delivers the rate of climb, not the height: that drifts by metres with the weather, and the ground is unknown.

    Args:
        scene: Rate, noise and delay.
        seed: Seed of the flight.
    """

    def __init__(self, scene: BarometerScene, seed: int) -> None:
        self._clock, self._latency_ns = SampleClock(scene.rate_hz), round(scene.latency_s * NS)
        self._sigma, self._noise = scene.sigma_m_s, Normals(stream(seed, "barometer"))
        self._wander = SlowNoise(scene.wander_m_s, scene.wander_time_s, 1.0 / scene.rate_hz, self._noise, 1)
        self._line: deque[dict[str, Any]] = deque()
        self.reading: dict[str, Any] = {}

    def sample(self, plant: Plant) -> None:
        """Take a sample if one is due, and deliver those whose delay is over."""
        now, line = plant.time_ns, self._line
        if self._clock.due(now):
            error = self._wander.next().item() + self._sigma * self._noise.take(1)[0]
            line.append({"height_rate": error - plant.truth.item(_SINK), "height_rate_stamp_ns": now})
        while line and line[0]["height_rate_stamp_ns"] + self._latency_ns <= now:
            self.reading = line.popleft()
