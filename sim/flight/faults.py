"""Faults during a flight: timed events that change the plant; the pilot receives only the reported limits."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from ibvs_qp.pilot import Pilot
from sim.flight.surroundings import World

#: Least distance between the lower and the upper limit of a working rotor [N].
LEAST_WINDOW_N = 1e-3


@dataclass(frozen=True, kw_only=True)
class Fault(ABC):
    """A fault that occurs once."""

    after: str = "touch"  # event that starts the delay: "start", "touch", or the name of a phase of the strategy
    delay_s: float = 3.0  # time from then on [s]

    @abstractmethod
    def strike(self, world: World, pilot: Pilot) -> str:
        """Apply the fault; returns its description."""


@dataclass(frozen=True, kw_only=True)
class Derate(Fault):
    """One rotor, or all, give only a fraction of the full thrust from now on; the drive reports it."""

    share: float = 0.5  # fraction of the nominal upper limit; 0 stops the rotor
    rotor: str = ""  # its name; empty derates all
    reported: bool = True  # whether the drive reports the new limits to the pilot

    def strike(self, world: World, pilot: Pilot) -> str:
        """Lower the limits of the plant and, if reported, those of the pilot."""
        plant, vehicle = world.plant, world.plant.vehicle
        names = vehicle.geometry.names
        hit = np.array([self.rotor in ("", name) for name in names])
        lower, upper = plant.thrust_limits
        upper = np.where(hit, self.share * vehicle.thrust_max, upper)
        stopped = hit & (self.share <= 0.0)
        lower = np.where(stopped, 0.0, np.minimum(lower, upper - LEAST_WINDOW_N))
        plant.thrust_limits = lower, np.maximum(upper, 0.0)
        if self.reported:
            pilot.thrust_limits = plant.thrust_limits
        return f"{self.rotor or 'every rotor'} derated to {100.0 * self.share:g} % of full thrust"


@dataclass(frozen=True, kw_only=True)
class WindStep(Fault):
    """The mean wind jumps to a value."""

    mean_m_s: tuple[float, float, float] = (0.0, 3.0, 0.0)  # new mean wind, world NED [m/s]

    def strike(self, world: World, pilot: Pilot) -> str:
        """Change the wind."""
        world.plant.wind.mean = np.array(self.mean_m_s)
        return f"wind steps to {self.mean_m_s} m/s (north, east, down)"


@dataclass
class FaultSchedule:
    """Applies each fault once, at its time."""

    faults: tuple[Fault, ...]
    begun: dict[str, float] = dataclasses.field(default_factory=dict)
    struck: set[int] = dataclasses.field(default_factory=set)

    def tick(self, world: World, pilot: Pilot) -> list[str]:
        """Apply due faults; returns their descriptions."""
        if len(self.struck) == len(self.faults):
            return []
        now = world.plant.time_ns * 1e-9
        self.begun.setdefault("start", now)
        self.begun.setdefault(pilot.painter.phase, now)
        if pilot.setpoints.contact.in_contact:
            self.begun.setdefault("touch", now)
        happened = []
        for index, fault in enumerate(self.faults):
            if index not in self.struck and now >= self.begun.get(fault.after, math.inf) + fault.delay_s:
                self.struck.add(index)
                happened.append(fault.strike(world, pilot))
        return happened
