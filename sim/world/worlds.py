"""Worlds by name: a scene with the errors of a profile, and the name of a scene's errors."""

from __future__ import annotations

import dataclasses

from sim.world.errors import WorldErrors, world_errors, world_names
from sim.world.scene import Scene

#: World of `paint` without a scene file, and of experiments and comparisons without `--world`.
DEFAULT_WORLD, EXPERIMENT_WORLD = "datasheet", "ideal"
#: World of a neglected vehicle.
HARSH = "harsh"
#: Name of errors that no shipped profile has.
OWN = "own"


def in_world(scene: Scene, world: str) -> Scene:
    """The scene with the errors of a world instead of its own.

    Args:
        scene: The scene.
        world: Name of a shipped profile, or a TOML file.

    Raises:
        ConfigError: When there is no such world.
    """
    return dataclasses.replace(scene, errors=world_errors(world))


def world_name(errors: WorldErrors) -> str:
    """Name of the shipped profile with these errors, or "own"."""
    return next((name for name in world_names() if world_errors(name) == errors), OWN)
