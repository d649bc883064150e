r"""Air that the wall shapes: rotors near wall and ground gain or lose thrust, and fly in their own wake.

The relative change of a rotor's thrust at a clearance c of its tip circle from a surface is

.. math:: s\, e^{-(c / R - 0.3)}, \quad c \ge 0.3 R,

R being the rotor's radius and s the change at 0.3 R: of either sign near the wall, a gain above the ground. Front
rotors change more than rear ones: that is the pitching moment. Recirculation is a noise of every rotor with the same
law of the wall's clearance. (The law and its length R are assumed, after measurements near ceilings and walls that fall
below a percent at two radii.)
"""

from __future__ import annotations

import numpy as np

from sim.world.board import BoardGeometry
from sim.world.errors import AirErrors
from sim.world.random_streams import Normals, stream
from sim.world.slow_noise import SlowNoise
from sim.world.true_vehicle import TrueVehicle

#: Clearance at which the sizes hold, and nearest one [rotor radii].
REFERENCE_RADII = 0.3
#: Correlation time of recirculating air [s]: a loop of 1 m at 3 m/s.
RECIRCULATION_TIME_S = 0.3


class WallAir:
    """True over undisturbed thrust of every rotor.

    Args:
        errors: Sizes.
        board: Wall and ground.
        vehicle: Rotors.
        tick_s: Time between calls of `factors` [s].
        seed: Seed of the flight.
    """

    def __init__(self, errors: AirErrors, board: BoardGeometry, vehicle: TrueVehicle, tick_s: float, seed: int) -> None:
        generator = stream(seed, "errors.air.rotors")
        sizes = errors.wall_thrust, errors.ground_thrust
        self._wall, self._ground = (generator.uniform((-1.0, 0.0), 1.0) * sizes).tolist()
        self._board, self._radius = board, vehicle.propeller_radius_m
        self._hubs = vehicle.geometry.positions
        normals, count = Normals(generator), vehicle.geometry.count
        self._noise = SlowNoise(errors.recirculation, RECIRCULATION_TIME_S, tick_s, normals, count)

    def factors(self, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        """Factors of the next tick, (n,).

        Args:
            position: Body origin in the world [m], (3,).
            rotation: B to the world, (3, 3).
        """
        hubs = position + self._hubs @ rotation.T
        to_wall = -self._board.surface.chart(hubs)[:, 0] - self._radius
        to_ground = self._board.ground - hubs @ self._board.down
        near_wall, near_ground = (self._nearness(clearance) for clearance in (to_wall, to_ground))
        return 1.0 + near_wall * (self._wall + self._noise.next()) + near_ground * self._ground

    def _nearness(self, clearance: np.ndarray) -> np.ndarray:
        return np.exp(-np.maximum(clearance / self._radius - REFERENCE_RADII, 0.0))
