"""Faults of the rotors; the pilot receives only the limits that the drive reports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.settings import setting
from ibvs_qp.pilot import Pilot
from sim.faults.fault import Fault, Surroundings

#: Least distance between the lower and the upper limit of a working rotor [N].
LEAST_WINDOW_N = 1e-3


@dataclass(frozen=True, kw_only=True)
class RotorFault(Fault):
    """A fault of one rotor, or of all."""

    rotor: str = setting("", "its name; empty means every rotor")

    def hits(self, world: Surroundings) -> np.ndarray:
        """Which rotors, (n,) bool."""
        return np.array([self.rotor in ("", name) for name in world.plant.vehicle.geometry.names])

    def restore_limits(self, world: Surroundings) -> None:
        """The limits of the sound rotors."""
        lower, upper = world.plant.thrust_limits
        vehicle, hit = world.plant.vehicle, self.hits(world)
        world.plant.thrust_limits = np.where(hit, vehicle.thrust_min, lower), np.where(hit, vehicle.thrust_max, upper)


@dataclass(frozen=True, kw_only=True)
class Derate(RotorFault):
    """One rotor, or all, give at most a fraction of the full thrust; the drive may report it."""

    share: float = setting(0.5, "fraction of the nominal upper limit; 0 stops the rotor", low=0.0, high=1.0)
    reported: bool = setting(True, "whether the drive reports the new limits to the pilot")

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Lower the limits of the plant and, if reported, those of the pilot."""
        plant, hit = world.plant, self.hits(world)
        lower, upper = plant.thrust_limits
        upper = np.where(hit, self.share * plant.vehicle.thrust_max, upper)
        stopped = hit & (self.share <= 0.0)
        lower = np.where(stopped, 0.0, np.minimum(lower, upper - LEAST_WINDOW_N))
        plant.thrust_limits = lower, np.maximum(upper, 0.0)
        if self.reported:
            pilot.thrust_limits = plant.thrust_limits
        return f"{self.rotor or 'every rotor'} derated to {100.0 * self.share:g} % of full thrust"

    def end(self, world: Surroundings, pilot: Pilot) -> None:
        """Full thrust again."""
        self.restore_limits(world)
        if self.reported:
            pilot.thrust_limits = world.plant.thrust_limits


@dataclass(frozen=True, kw_only=True)
class RotorStuck(RotorFault):
    """One rotor, or all, give a fixed thrust for any command; nothing reports it."""

    thrust_n: float = setting(11.3, "its thrust", unit="N", low=0.0, high=100.0)

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Both limits of the plant at the thrust."""
        lower, upper = world.plant.thrust_limits
        hit = self.hits(world)
        world.plant.thrust_limits = np.where(hit, self.thrust_n, lower), np.where(hit, self.thrust_n, upper)
        return self.words

    def end(self, world: Surroundings, pilot: Pilot) -> None:
        """The rotor follows its command again."""
        self.restore_limits(world)


@dataclass(frozen=True, kw_only=True)
class ThrustLoss(RotorFault):
    """One rotor, or all, give only a fraction of the command: sagging battery, damaged blade."""

    share: float = setting(0.86, "thrust over the value before", low=0.01, high=2.0)

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Scale the thrusts of the plant."""
        world.plant.gain[self.hits(world)] *= self.share
        return self.words

    def end(self, world: Surroundings, pilot: Pilot) -> None:
        """Thrusts as before."""
        world.plant.gain[self.hits(world)] /= self.share
