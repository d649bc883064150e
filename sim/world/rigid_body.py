"""Mass, centre and inertia of the true vehicle, split into the bare vehicle and the tool on its sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.vehicle import VehicleParams
from sim.world.mujoco_frames import FLIP, quaternion_of_axes
from sim.world.scene import Scene


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
    """The tool: a slender rod from the force/torque sensor to the tip, mass centred where the parameters say."""
    rod = np.asarray(vehicle.tip_position_m) - np.asarray(vehicle.force_torque_position_m)
    return RigidBody(
        vehicle.tool_mass_kg, np.array(vehicle.tool_position_m), _steiner(vehicle.tool_mass_kg / 12.0, rod)
    )


def bare_body(scene: Scene, vehicle: VehicleParams) -> RigidBody:
    """The vehicle without its tool: the scene's mass, centre of mass and inertia minus the tool's.

    Raises:
        ConfigError: When the tool alone has more mass or inertia than the whole vehicle.
    """
    truth, tool = scene.vehicle, tool_body(vehicle)
    whole = np.array(truth.com_offset_m)
    mass = truth.mass_kg - tool.mass
    if mass <= 0.0:
        raise ConfigError(f"vehicle.mass_kg = {truth.mass_kg:g} kg is refused: the tool alone weighs {tool.mass:g} kg")
    centre = (truth.mass_kg * whole - tool.mass * tool.centre) / mass
    inertia = np.diag(truth.inertia_kg_m2) - tool.inertia
    inertia -= _steiner(tool.mass, tool.centre - whole) + _steiner(mass, centre - whole)
    if np.linalg.eigvalsh(inertia)[0] <= 0.0:
        raise ConfigError(
            f"vehicle.inertia_kg_m2 = {truth.inertia_kg_m2} kg m^2 is refused: the tool of {tool.mass:g} kg at "
            f"{vehicle.tool_position_m} m alone has more"
        )
    return RigidBody(mass, centre, inertia)


def principal_axes(body: RigidBody) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments (3,) and principal axes as quaternion (4,), front-left-up."""
    moments, axes = np.linalg.eigh(FLIP[:, None] * body.inertia * FLIP)
    return moments, quaternion_of_axes(axes * np.linalg.det(axes))
