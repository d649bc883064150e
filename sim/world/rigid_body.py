"""Mass, centre and inertia of the true vehicle, split into the bare vehicle and the tool on its sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from sim.world.mujoco_frames import FLIP, quaternion_of_axes
from sim.world.true_vehicle import TrueVehicle


@dataclass(frozen=True)
class RigidBody:
    """Mass [kg], centre of mass [m] (3,) and inertia about it [kg m^2] (3, 3), all FRD from the body origin."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray


def _steiner(mass: float, offset: np.ndarray) -> np.ndarray:
    """Inertia of a point mass at an offset."""
    return mass * (float(offset @ offset) * np.eye(3) - np.outer(offset, offset))


def tool_body(vehicle: VehicleParams) -> RigidBody:
    """The tool: a slender rod from the force/torque sensor to the tip, centre of mass by the parameters."""
    rod = np.asarray(vehicle.tip_position_m) - np.asarray(vehicle.force_torque_position_m)
    return RigidBody(
        vehicle.tool_mass_kg, np.array(vehicle.tool_position_m), _steiner(vehicle.tool_mass_kg / 12.0, rod)
    )


def bare_body(vehicle: TrueVehicle) -> RigidBody:
    """The vehicle without its tool: mass, centre of mass and inertia of the whole minus the tool's.

    Raises:
        ConfigError: When the tool alone has more inertia than the whole vehicle.
    """
    tool, whole = tool_body(vehicle), np.array(vehicle.com_offset_m)
    mass = vehicle.mass_kg - tool.mass
    centre = (vehicle.mass_kg * whole - tool.mass * tool.centre) / mass
    inertia = vehicle.inertia - tool.inertia
    inertia -= _steiner(tool.mass, tool.centre - whole) + _steiner(mass, centre - whole)
    if np.linalg.eigvalsh(inertia)[0] <= 0.0:
        raise ConfigError(
            f"plant.inertia_kg_m2 = {vehicle.inertia_kg_m2} kg m^2 with the products {vehicle.inertia_products_kg_m2} "
            f"is refused: the tool of {tool.mass:g} kg at {vehicle.tool_position_m} m alone has more"
        )
    return RigidBody(mass, centre, inertia)


def principal_axes(body: RigidBody) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments (3,) and principal axes as quaternion (4,), front-left-up."""
    moments, axes = np.linalg.eigh(FLIP[:, None] * body.inertia * FLIP)
    return moments, quaternion_of_axes(axes * np.linalg.det(axes))
