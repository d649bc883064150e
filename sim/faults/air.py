"""Disturbances from outside: wind, and a push at the vehicle."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import setting
from ibvs_qp.pilot import Pilot
from sim.faults.fault import Fault, Surroundings

Vector = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class WindStep(Fault):
    """The mean wind changes to a value, at once or as a front that passes the vehicle."""

    mean_m_s: Vector = setting((0.0, 3.0, 0.0), "new mean wind, world NED", unit="m/s", low=-30.0, high=30.0)
    rise_s: float = setting(
        0.0, "time of the change: of a front, size of the vehicle over its speed", unit="s", low=0.0, high=60.0
    )

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Change the wind."""
        world.plant.wind.step_to(self.mean_m_s, self.rise_s)
        return f"wind steps to {self.mean_m_s} m/s (north, east, down)"

    def end(self, world: Surroundings, pilot: Pilot) -> None:
        """The wind of scene and seed again: a gust."""
        world.plant.wind.back(self.rise_s)


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
