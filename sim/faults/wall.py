"""Changes of wall, contact and paint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.settings import setting
from ibvs_qp.pilot import Pilot
from sim.faults.fault import Fault, Surroundings
from sim.world.board import BoardGeometry

#: Multiples of it, without their whole part, are spread evenly and without order.
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)


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
        _set_wall(world, wall.stiffness_n_m * self.stiffness_ratio, friction)
        return self.words

    def end(self, world: Surroundings, pilot: Pilot) -> None:
        """The scene's contact again."""
        wall = world.plant.scene.wall
        _set_wall(world, wall.stiffness_n_m, wall.friction)


def _set_wall(world: Surroundings, stiffness: float, friction: float) -> None:
    """Another wall under the tip, which pushes as before."""
    world.plant.displace(world.plant.set_wall(stiffness, friction) * world.plant.normal)


@dataclass(frozen=True, kw_only=True)
class BoardMoved(Fault):
    """Board and wall jump away along the normal at the tip; the vehicle is moved, as the world's origin goes along."""

    away_m: float = setting(0.1, "distance", unit="m", low=0.0, high=10.0)

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Move it."""
        world.plant.displace(-self.away_m * world.plant.normal)
        return self.words


@dataclass(frozen=True, kw_only=True)
class EdgeBroken(Fault):
    """Paint has run over the outer edge of the strokes along a part of their length; lines are not found there.

    Strokes that are painted later have a whole edge.
    """

    length_m: float = setting(0.3, "length of the part", unit="m", low=0.01, high=20.0)
    at: float = setting(0.5, "its middle, as a fraction of the way along stroke 1", low=0.0, high=1.0)
    farthest_m: float = setting(0.015, "farthest that paint has run", unit="m", low=0.0, high=0.1)

    def strike(self, world: Surroundings, pilot: Pilot) -> str:
        """Let paint run over the edges that are there."""
        edges, radius = world.canvas.edges, 0.5 * world.canvas.scene.paint.brush_width_m
        first, last = BoardGeometry(world.canvas.scene).stroke_ends
        low, high = first + self.at * (last - first) + self.length_m * np.array((-0.5, 0.5))
        _, points = edges.exposed()
        broken = points[(points[:, 0] >= low) & (points[:, 0] <= high)]
        for number, (u, v) in enumerate(broken):
            run_m = self.farthest_m * (number * _GOLDEN % 1.0)
            world.canvas.stroke(None, edges.on_board(np.array((u, v - radius + run_m))))
        edges.open[:, (edges.middles >= low) & (edges.middles <= high)] = False
        return self.words
