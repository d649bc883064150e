"""The push that physics allows: the attainable set along the push, the yardstick of every delivered push."""

from __future__ import annotations

import functools

import numpy as np

import allocation
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY

#: A sliding tip moves to the left.
_LEFT = np.array([0.0, -1.0, 0.0])


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
    return allocation.push_reach(
        vehicle.geometry,
        mass_kg * GRAVITY,
        np.array(vehicle.tip_position_m),
        np.array(lower_n),
        np.array(upper_n),
        friction=sliding_friction,
        travel=_LEFT if sliding_friction > 0.0 else None,
    ).push
