"""The scene files that come with the package."""

from __future__ import annotations

from pathlib import Path

from ibvs_qp.config.errors import ConfigError

_FOLDER = Path(__file__).parent


def scene_names() -> tuple[str, ...]:
    """Names of the shipped scenes."""
    return tuple(sorted(file.stem for file in _FOLDER.glob("*.toml")))


def scene_path(name: str) -> Path:
    """File of a shipped scene, for `sim.world.scene.load_scene`.

    Args:
        name: Its name, with or without ``.toml``.

    Raises:
        ConfigError: When there is no such scene.
    """
    file = _FOLDER / f"{name.removesuffix('.toml')}.toml"
    if not file.is_file():
        raise ConfigError(f"unknown scene {name!r}; shipped scenes: {', '.join(scene_names())}")
    return file
