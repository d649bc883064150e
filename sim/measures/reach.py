"""The push that physics allows: a linear program over the rotors' limits, the yardstick of every delivered push."""

from __future__ import annotations

import functools

import numpy as np

from allocation import WrenchSet
from ibvs_qp.frames import GRAVITY
from ibvs_qp.vehicle import VehicleParams


@functools.lru_cache(maxsize=256)
def push_reach(
    mass_kg: float, lower_n: tuple[float, ...], upper_n: tuple[float, ...], sliding_friction: float = 0.0
) -> float:
    """Largest push in level flight that the rotors can hold at full lift without turning the vehicle [N].

    Args:
        mass_kg: True mass.
        lower_n: Lower thrust limits of the rotors.
        upper_n: Upper thrust limits of the rotors.
        sliding_friction: Coulomb coefficient of a tip that slides to the left; 0 for a tip at rest.
    """
    vehicle = VehicleParams()
    rotors = WrenchSet(vehicle.geometry, np.array(lower_n), np.array(upper_n))
    force = np.array([1.0, -sliding_friction, 0.0])  # forwards, and along the travel against friction
    moment = np.cross(np.array(vehicle.tip_position_m), force)
    hover = np.array([0.0, 0.0, -mass_kg * GRAVITY, 0.0, 0.0, 0.0])
    return rotors.reach(hover, np.concatenate((force, moment))).distance
