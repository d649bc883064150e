"""A setting as files that the command line flies: preset and scene."""

from __future__ import annotations

import shlex
from pathlib import Path

from ibvs_qp.config.contact_margin import require_margin
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.config.settings import dump_toml
from ibvs_qp.pilot import PilotConfig
from sim.notebook.tuning.snippet import Setting
from sim.world.scene import load_scene

#: Ending of the scene's file beside the preset's.
SCENE_ENDING = ".scene.toml"


def scene_file(preset: Path) -> Path:
    """Where the scene of a preset is written: friction, slope, gusts and the push are the scene's."""
    return preset.with_name(preset.stem + SCENE_ENDING)


def save_setting(setting: Setting, preset: str | Path) -> tuple[Path, Path]:
    """Write a setting as a preset and a scene.

    Args:
        setting: What is set.
        preset: File of the preset; the scene goes beside it.

    Returns:
        Both files.

    Raises:
        ConfigError: When the file cannot be written, or the contact would ring with this preset.
    """
    file = Path(preset).expanduser()
    if file.suffix != ".toml":
        raise ConfigError(f"{file} is refused: the name of a preset ends in .toml")
    scene, controller = scene_file(file), setting.pilot.controller
    require_margin(controller, controller.brush)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(setting.pilot.to_toml(), encoding="utf-8")
        scene.write_text(dump_toml(setting.scene), encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"cannot write {file}: {error.strerror or error}") from None
    return file, scene


def load_setting(preset: str | Path, seed: int = 0) -> Setting:
    """Read what `save_setting` wrote.

    Raises:
        ConfigError: When a file is missing or refused.
    """
    file = Path(preset)
    return Setting(pilot=PilotConfig.from_toml(file), scene=load_scene(scene_file(file)), seed=seed)


def command_line(setting: Setting, preset: Path) -> str:
    """The command that flies a saved setting through the whole job."""
    scene = scene_file(preset)
    return f"ibvs-qp paint --preset {_quoted(preset)} --scene {_quoted(scene)} --seed {setting.seed}"


def saved_text(setting: Setting, preset: str) -> str:
    """Save a setting and say how it is flown, or why it was not saved, as markdown."""
    try:
        file, scene = save_setting(setting, preset)
    except ConfigError as error:
        return f"**Not saved:** {error}"
    return f"Saved `{file}` and `{scene}`. Fly the whole job with\n\n```sh\n{command_line(setting, file)}\n```"


def _quoted(file: Path) -> str:
    return shlex.quote(str(file))
