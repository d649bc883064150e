"""A vehicle of a file in the pilot's configuration, and its camera in a scene."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import NamedTuple

from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.gains import gain_factors
from ibvs_qp.config.settings import Derived
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.pilot import PilotConfig
from ibvs_qp.pilot.contact_picture import hint_span
from ibvs_qp.pilot.vehicle_check import check_vehicle
from sim.world.scene import Scene

#: Origin of settings that follow from the vehicle.
_SOURCES = {
    "contact.depth_min_m": "tip and camera",
    "contact.depth_max_m": "tip and camera",
    "limits.yaw_deg": "propellers and tip",
    "limits.view_up": "camera",
    "limits.view_down": "camera",
    "limits.view_left": "camera",
    "limits.view_right": "camera",
}


class DerivedSetting(NamedTuple):
    """A setting that depends on vehicle, camera or brush."""

    name: str
    value: str
    source: str


def with_vehicle(config: PilotConfig, vehicle: VehicleParams) -> PilotConfig:
    """The configuration of another vehicle; derived settings follow, stated ones remain."""
    return dataclasses.replace(config, controller=dataclasses.replace(config.controller, vehicle=vehicle))


def with_camera(scene: Scene, vehicle: VehicleParams) -> Scene:
    """The scene with picture size and field of view of a vehicle's camera, unless that is the Tarot T960's.

    The simulated camera has square pixels and its principal point in the middle.
    """
    usual, size, focal = VehicleParams(), vehicle.camera_size_px, vehicle.camera_intrinsics_px
    if (size, focal) == (usual.camera_size_px, usual.camera_intrinsics_px):
        return scene
    field = 2.0 * math.degrees(math.atan(0.5 * size[1] / focal[1]))
    camera = dataclasses.replace(scene.camera, width=size[0], height=size[1], vertical_fov_deg=field)
    return dataclasses.replace(scene, camera=camera)


def require_vehicle(config: PilotConfig, place: str) -> tuple[str, ...]:
    """Refuse a vehicle that cannot paint the job of a configuration.

    Args:
        config: Vehicle, camera and paint job.
        place: Option or file that messages name.

    Returns:
        Warnings.

    Raises:
        ConfigError: Naming all problems, in one line.
    """
    check = check_vehicle(config, config.painting.push_n)
    if check.problems:
        raise ConfigError(f"{place}: {'; '.join(check.problems)}")
    return check.warnings


def derived_settings(config: PilotConfig) -> Iterator[DerivedSetting]:
    """Settings that depend on vehicle, camera and brush, with their origin."""
    controller, vehicle = config.controller, config.controller.vehicle
    for name, source in _SOURCES.items():
        section, field = name.split(".")
        yield _setting(name, getattr(controller, section), field, source)
    yield _setting("vision.brush_width_m", config.vision, "brush_width_m", "painting.brush_width_m")
    brush = controller.brush
    yield DerivedSetting(
        "brush range", f"{brush.stiffness_min_n_m:g} to {brush.stiffness_max_n_m:g} N/m", "brush and wall"
    )
    directions = {"left": (HORIZONTAL, -1), "right": (HORIZONTAL, 1), "above": (VERTICAL, -1), "below": (VERTICAL, 1)}
    for name, (role, ahead) in directions.items():
        low, high = hint_span(vehicle, config.vision.brush_width_m, role, ahead)
        words = f"{low:.2f} to {high:.2f}" if low < high else "none"
        yield DerivedSetting(f"fresh edge, {name}", words, "tip, brush and camera")
    yield DerivedSetting("mask of the vehicle", "drawn", "arm, brush and propellers")
    gains = controller.gains
    stated = [field.name for field in dataclasses.fields(gains) if type(getattr(gains, field.name)) is not Derived]
    if stated:
        yield DerivedSetting("gains", f"{len(stated)} stated", "preset")
    if len(stated) < len(dataclasses.fields(gains)):
        mass, pace = gain_factors(vehicle)
        yield DerivedSetting("gains, impedance", f"x {mass:.2f}", "mass over the Tarot's")
        yield DerivedSetting("gains, per second", f"x {pace:.2f}", "motor lag over the Tarot's")


def _setting(name: str, owner: object, field: str, source: str) -> DerivedSetting:
    unit = next(entry.metadata["unit"] for entry in dataclasses.fields(owner) if entry.name == field)  # type: ignore[arg-type]
    value = getattr(owner, field)
    return DerivedSetting(name, f"{value:.3g} {unit}".rstrip(), source if type(value) is Derived else "stated")
