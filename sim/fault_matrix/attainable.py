"""Which faults of rotors leave a hover: the attainable wrench set of the true vehicle in every world."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from allocation import WrenchFacets, least_hover_tilt
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.frames import GRAVITY
from sim.faults.fault import Fault
from sim.faults.rotors import RotorFault
from sim.faults.scenario import Scenario
from sim.world.errors import RotorErrors
from sim.world.scene import Scene
from sim.world.true_vehicle import TrueVehicle, true_vehicle


@dataclass(frozen=True, kw_only=True)
class Hover:
    """Least tilt of a hover after a fault [deg], over all rotors that it may hit; inf without one."""

    row: str
    world: str
    turning: float  # the vehicle may turn about its vertical axis
    heading: float  # it must not


def hovers(rows: Sequence[Scenario], scenes: dict[str, Scene], nominal: VehicleParams) -> list[Hover]:
    """The hover that is left by every row with a fault of rotors.

    Args:
        rows: Rows of the matrix.
        scenes: Scene of every world, by name.
        nominal: Vehicle of the controller.
    """
    facets, names, found = WrenchFacets(nominal.geometry), nominal.geometry.names, []
    for row in rows:
        if not all(isinstance(fault, RotorFault) for fault in row.faults):
            continue
        place = next(iter(row.places))
        hit = {row.flown(place, seed, names) for seed in range(len(names))}
        for world, scene in scenes.items():
            vehicle = true_vehicle(scene, nominal)
            tilts = [_tilts(facets, vehicle, scene.errors.rotors, faults) for faults in hit]
            turning, heading = (max(values) for values in zip(*tilts, strict=True))
            found.append(Hover(row=row.name, world=world, turning=turning, heading=heading))
    return found


def _tilts(
    facets: WrenchFacets, vehicle: TrueVehicle, errors: RotorErrors, faults: Sequence[Fault]
) -> tuple[float, float]:
    """Least tilt of a hover that may turn, and of one that keeps its heading [deg]."""
    lower, upper = limits_after(vehicle, 1.0 + errors.gain, faults)
    weight = vehicle.mass_kg * GRAVITY
    turning, heading = (
        least_hover_tilt(facets, weight, lower, upper, centre=vehicle.com_offset_m, hold_yaw=held)
        for held in (False, True)
    )
    return turning, heading


def limits_after(vehicle: TrueVehicle, gain: float, faults: Sequence[Fault]) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest true thrust of every rotor under faults [N], (n,) each.

    Args:
        vehicle: The true vehicle.
        gain: Mean of true over commanded thrust in its world; the spread over rotors averages out in the lift.
        faults: Faults of rotors.
    """
    lower, upper = (np.array(side, float) for side in (vehicle.thrust_min, vehicle.thrust_max))
    rotors = SimpleNamespace(
        vehicle=vehicle, thrust_limits=(lower, upper), gain=gain * np.broadcast_to(vehicle.thrust_gain, lower.shape)
    )
    for fault in faults:
        fault.strike(cast(Any, SimpleNamespace(plant=rotors)), cast(Any, SimpleNamespace()))
    low, high = rotors.thrust_limits
    # The plant scales a command and then limits it.
    return np.clip(rotors.gain * lower, low, high), np.clip(rotors.gain * upper, low, high)


def in_words(tilt: float) -> str:
    """A tilt for the table."""
    return "none" if math.isinf(tilt) else f"{tilt:.1f}"
