"""Options that several commands share: help texts, checks before anything costs time, resuming after Ctrl-C."""

from __future__ import annotations

import dataclasses
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import tyro

from ibvs_qp.config.errors import ConfigError, out_of_range
from ibvs_qp.config.files import UnreadableFile, open_regular, read_toml
from sim.commands.exit_codes import EXIT_INTERRUPTED
from sim.world.worlds import DEFAULT_WORLD

_WORLD = "World: errors of vehicle and sensors, as ideal, datasheet, harsh, field, or a TOML file; default: "
#: World of the flights of a command without a scene file.
World = Annotated[str, tyro.conf.arg(metavar="NAME", help=f"{_WORLD}{DEFAULT_WORLD}.", help_behavior_hint="")]
#: World of a flight that may have a scene file; None takes the errors that the file sets, else the default world.
SceneWorld = Annotated[
    str | None,
    tyro.conf.arg(
        metavar="NAME",
        help=f"{_WORLD}the scene file's errors, if it has none {DEFAULT_WORLD}.",
        help_behavior_hint="",
    ),
]
#: Largest seed [-]: that of a sweep; every seed that follows from it fits the 64 bits of a table.
LARGEST_SEED = 2**31 - 1
#: Most parallel processes [-]: one per core of the largest computers; each takes 0.2 GB.
MOST_JOBS = 1024
#: Help of a switch: no default is printed.
flag = tyro.conf.arg(help_behavior_hint="")


def optional(metavar: str) -> Any:
    """Help of an option whose description states the default."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


def check_seed(seed: int) -> None:
    """Raise ConfigError for a seed outside 0 to `LARGEST_SEED`."""
    check_count("--seed", seed, 0, LARGEST_SEED)


def check_count(option: str, value: int | None, low: int, high: int) -> None:
    """Raise ConfigError for a count outside its range; None means the command's default."""
    if value is not None and not low <= value <= high:
        raise out_of_range(option, value, "", f"allowed is {low} to {high}")


def check_jobs(jobs: int | None) -> None:
    """Raise ConfigError for a number of parallel processes outside 1 to `MOST_JOBS`."""
    check_count("--jobs", jobs, 1, MOST_JOBS)


def check_readable(option: str, file: Path | None, largest: int = sys.maxsize) -> None:
    """Raise ConfigError if a file is given and cannot be read, or has more bytes."""
    if file is None:
        return
    try:
        open_regular(file, largest).close()
    except UnreadableFile as error:
        raise ConfigError(f"{error}; give an existing file with {option}") from None


def scene_file(file: Path | None, option: str = "--scene") -> Path | None:
    """A scene file, or the shipped one of that name.

    Raises:
        ConfigError: When it is missing or a preset.
    """
    return _shipped_or_given(file, option, "scene")


def preset_file(file: Path | None, option: str = "--preset", *, other_formats: bool = False) -> Path | None:
    """A preset file, or the shipped one of that name; its values are checked on use.

    Args:
        file: As given.
        option: Name of the option, for messages.
        other_formats: Whether the file need not be TOML.

    Raises:
        ConfigError: When it is missing or a scene.
    """
    return _shipped_or_given(file, option, "preset", other_formats)


def _shipped_or_given(file: Path | None, option: str, kind: str, other_formats: bool = False) -> Path | None:
    from ibvs_qp.pilot import presets
    from sim import scenes

    if file is None:
        return None
    shipped = {"preset": presets.FILES, "scene": scenes.FILES}
    given = file
    if not file.exists():
        file = next((files[str(file)] for files in shipped.values() if str(file) in files), file)
    try:
        open_regular(file, sys.maxsize).close()
    except UnreadableFile as error:
        names = ", ".join(shipped[kind])
        raise ConfigError(f"{error}; give an existing file with {option}, or one of {names}") from None
    if not other_formats and (other := _kind(file)) not in (kind, None):
        raise ConfigError(f"{option} {given}: this is a {other}, not a {kind}")
    return file


def _kind(file: Path) -> str | None:
    """Whether a TOML file is a scene or a preset, by its sections; None if they do not show it."""
    from ibvs_qp.pilot import PilotConfig
    from sim.world.scene import Scene

    preset, scene = ({field.name for field in dataclasses.fields(kind)} for kind in (PilotConfig, Scene))
    found = set(read_toml(file))
    kinds = [name for name, own in (("preset", preset - scene), ("scene", scene - preset)) if found & own]
    return kinds[0] if len(kinds) == 1 else None


def check_mujoco() -> None:
    """Raise ConfigError if MUJOCO_GL keeps MuJoCo from loading; pictures here never depend on it."""
    backend = os.environ.get("MUJOCO_GL")
    if not backend:
        return
    try:
        import mujoco  # noqa: F401
    except Exception as error:  # a missing library surfaces as AttributeError
        raise ConfigError(
            f"MUJOCO_GL = {backend} keeps MuJoCo from loading ({error}); unset it, it is not needed"
        ) from None


def usable_cores() -> int:
    """Number of processor cores that this process may use."""
    import joblib

    return joblib.cpu_count()


def command_line(words: Sequence[str]) -> str:
    """The command as typed, for the record."""
    return shlex.join(["ibvs-qp", *words])


def interrupted(words: Sequence[str], folder: Path, kept: str) -> int:
    """Print how to resume after Ctrl-C: the same command with the same folder.

    Args:
        words: Arguments after ``ibvs-qp``.
        folder: Folder of the results.
        kept: Present contents of the disk.

    Returns:
        The exit code.
    """
    given = any(word.split("=")[0] == "--out" for word in words)
    again = command_line([*words, *([] if given else ["--out", str(folder)])])
    print(f"ibvs-qp: interrupted; {kept}; go on with: {again}", file=sys.stderr)
    return EXIT_INTERRUPTED
