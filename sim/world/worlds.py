"""Worlds by name: the scene of a flight with the errors of its world, and the name of a scene's errors."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from ibvs_qp.config.files import read_toml
from sim.world.errors import WorldErrors, world_errors, world_names
from sim.world.scene import Scene, load_scene

#: World of flights that name none.
DEFAULT_WORLD = "datasheet"
#: World of a neglected vehicle.
HARSH = "harsh"
#: Tilt that a job permits to a push at the reach [deg]: a wind of 5 m/s takes 4.5 N along the wall.
TRIM_DEG = {"field": 2.0}
#: Name of errors that no shipped profile has; in a scene file they are those of the scene.
OWN, OF_THE_SCENE = "own", "of the scene"


def scene_in_world(file: Path | None, world: str | None = None) -> tuple[Scene, str]:
    """The scene to fly and the name of its world: the named one, else the file's `errors`, else the default world.

    Args:
        file: Scene file; None is the default scene.
        world: Name of a shipped profile, or a TOML file; None where none is named.

    Raises:
        ConfigError: When the file is refused, or there is no such world.
    """
    scene = Scene() if file is None else load_scene(file)
    if world is None and file is not None and "errors" in read_toml(file):
        name = world_name(scene.errors)
        return scene, OF_THE_SCENE if name == OWN else name
    world = world or DEFAULT_WORLD
    return in_world(scene, world), world


def in_world(scene: Scene, world: str) -> Scene:
    """The scene with the errors of a world instead of its own, and with the tilt that jobs in it permit.

    Args:
        scene: The scene.
        world: Name of a shipped profile, or a TOML file.

    Raises:
        ConfigError: When there is no such world.
    """
    trim_deg = max(scene.paint.trim_deg, TRIM_DEG.get(world, 0.0))
    paint = dataclasses.replace(scene.paint, trim_deg=trim_deg)
    return dataclasses.replace(scene, paint=paint, errors=world_errors(world))


def world_name(errors: WorldErrors) -> str:
    """Name of the shipped profile with these errors, or "own"."""
    return next((name for name in world_names() if world_errors(name) == errors), OWN)
