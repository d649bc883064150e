"""The true vehicle: the nominal one of the controller, changed by ``[plant]`` and by the errors of a seed."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.quaternion import from_rotation_vector
from sim.world.errors import WorldErrors
from sim.world.plant_scene import Vector
from sim.world.random_streams import Normals, stream
from sim.world.scene import Scene
from sim.world.slow_noise import random_direction


@dataclass(frozen=True, kw_only=True)
class TrueVehicle(VehicleParams):
    """Parameters of the plant: those with a nominal value, and those that the controller takes for zero or one.

    Attributes:
        com_offset_m: True centre of mass from the body origin, which is the assumed one, FRD [m].
        thrust_gain: True over commanded thrust, one number or one per rotor [-].
        focal_ratio: Reported over true focal length [-].
    """

    com_offset_m: Vector = (0.0, 0.0, 0.0)
    thrust_gain: float | tuple[float, ...] = 1.0
    focal_ratio: float = 1.0

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        super().__post_init__()
        gain, count = self.thrust_gain, self.geometry.count
        if isinstance(gain, tuple) and len(gain) != count:
            raise out_of_range("thrust_gain", gain, "", f"one number or {count} (one per rotor)")


def true_vehicle(scene: Scene, nominal: VehicleParams, seed: int = 0) -> TrueVehicle:
    """The vehicle that flies in a scene.

    Args:
        scene: Its section ``plant`` states the differences, ``errors`` the sizes of the drawn ones.
        nominal: Vehicle of the controller.
        seed: Draws signs and directions of the errors.

    Raises:
        ConfigError: When the plant's rotors are not as many as the nominal ones, or its values do not go together.
    """
    plant = scene.plant
    if plant.geometry is not None and plant.geometry.count != nominal.geometry.count:
        rotors, needed = plant.geometry.count, nominal.geometry.count
        raise out_of_range("plant.geometry", rotors, "rotors", f"the controller commands {needed}")
    values = {field.name: getattr(nominal, field.name) for field in dataclasses.fields(VehicleParams)}
    values |= {
        field.name: value for field in dataclasses.fields(plant) if (value := getattr(plant, field.name)) is not None
    }
    try:
        return _with_errors(TrueVehicle(**values), scene.errors, seed)
    except ConfigError as error:
        raise ConfigError(f"plant.{error}") from None


def _with_errors(vehicle: TrueVehicle, errors: WorldErrors, seed: int) -> TrueVehicle:
    """The vehicle with the errors of a seed; errors of size zero change no bit."""
    body, camera = errors.body, errors.camera
    signs = stream(seed, "centre of mass").choice((-1.0, 1.0), 3)
    return dataclasses.replace(
        vehicle,
        mass_kg=vehicle.mass_kg * (1.0 + body.mass),
        com_offset_m=_moved(vehicle.com_offset_m, signs * body.com_m),
        inertia_kg_m2=_moved((1.0 + body.inertia) * np.array(vehicle.inertia_kg_m2)),
        inertia_products_kg_m2=_moved((1.0 + body.inertia) * np.array(vehicle.inertia_products_kg_m2)),
        tip_position_m=_moved(vehicle.tip_position_m, body.tip_m),
        camera_position_m=_moved(vehicle.camera_position_m, camera.mount_m * _direction(seed, "camera mount")),
        camera_turn_deg=_moved(vehicle.camera_turn_deg, camera.mount_deg * _direction(seed, "camera turn")),
        focal_ratio=vehicle.focal_ratio * (1.0 + camera.focal * float(stream(seed, "focal length").standard_normal())),
    )


def _moved(place: Sequence[float] | np.ndarray, shift: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0)) -> Vector:
    x, y, z = (np.asarray(place, float) + shift).tolist()
    return x, y, z


def _direction(seed: int, purpose: str) -> np.ndarray:
    return random_direction(Normals(stream(seed, purpose)), 3)


def turn_quaternion(degrees: Sequence[float]) -> tuple[float, float, float, float]:
    """Quaternion (w, x, y, z) of a rotation vector [deg]."""
    return from_rotation_vector(np.radians(degrees))
