"""Disturbances from outside: wind, and a push at the vehicle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.settings import setting
from ibvs_qp.pilot import Pilot
from sim.faults.fault import Fault, Surroundings

Vector = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class WindStep(Fault):
    """The mean wind jumps to a value."""

    mean_m_s: Vector = setting((0.0, 3.0, 0.0), "new mean wind, world NED", unit="m/s", low=-30.0, high=30.0)

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Change the wind."""
        world.plant.wind.mean = np.array(self.mean_m_s)
        return f"wind steps to {self.mean_m_s} m/s (north, east, down)"

    def end(self, world: Surroundings, pilot: Pilot) -> None:
        """The scene's wind again: a gust."""
        world.plant.wind.mean = np.array(world.plant.scene.wind.mean_m_s)


@dataclass(frozen=True, kw_only=True)
class SidePush(Fault):
    """A force at the centre of mass."""

    force_n: Vector = setting((0.0, 10.0, 0.0), "the force, world NED", unit="N", low=-100.0, high=100.0)

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Push."""
        world.plant.outer_force = self.force_n
        return self.words

    def end(self, world: Surroundings, pilot: Pilot) -> None:
        """Let go."""
        world.plant.outer_force = None
