"""Changes of the wall and of the contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.settings import setting
from ibvs_qp.pilot import Pilot
from sim.faults.fault import Fault, Surroundings
from sim.world.contact import contact_stiffness, set_contact


@dataclass(frozen=True, kw_only=True)
class OtherWall(Fault):
    """The contact has another stiffness or friction, as where the tip reaches another part of the wall.

    The force goes on as it is: a stiffer wall is dented less.
    """

    stiffness_ratio: float = setting(1.0, "stiffness over that of the scene", low=0.01, high=100.0)
    friction: float | None = setting(None, "Coulomb friction; without, that of the scene", low=0.0, high=2.0)

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Change the contact of the plant."""
        wall = world.plant.scene.wall
        friction = wall.friction if self.friction is None else self.friction
        self._set(world, wall.stiffness_n_m * self.stiffness_ratio, friction)
        return self.words

    def end(self, world: Surroundings, pilot: Pilot) -> None:
        """The scene's contact again."""
        wall = world.plant.scene.wall
        self._set(world, wall.stiffness_n_m, wall.friction)

    def _set(self, world: Surroundings, stiffness: float, friction: float) -> None:
        plant, damping = world.plant, world.plant.scene.wall.damping_n_s_m
        before = contact_stiffness(plant.model)
        set_contact(plant.model, stiffness=stiffness, damping=damping, friction=friction)
        dent = max(float(plant.tip[0]), 0.0)
        plant.displace(np.array([dent * (before / stiffness - 1.0), 0.0, 0.0]))


@dataclass(frozen=True, kw_only=True)
class BoardMoved(Fault):
    """Board and wall jump away; the world's origin goes with the board, so it is the vehicle that is moved."""

    away_m: float = setting(0.1, "distance", unit="m", low=0.0, high=10.0)

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Move it."""
        world.plant.displace(np.array([-self.away_m, 0.0, 0.0]))
        return self.words
