"""Checks of what a user typed, made before anything costs time."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path

from ibvs_qp.config.errors import ConfigError, out_of_range


def check_seed(seed: int) -> None:
    """Refuse a negative seed.

    Raises:
        ConfigError: When the seed is below zero.
    """
    if seed < 0:
        raise out_of_range("--seed", seed, "", "allowed are 0, 1, 2, ...")


def check_readable(option: str, file: Path | None) -> None:
    """Refuse a file that cannot be read.

    Args:
        option: Name of the option, for the message.
        file: The file, or None if the option was not given.

    Raises:
        ConfigError: When it is given and cannot be read.
    """
    if file is None:
        return
    try:
        file.open("rb").close()
    except OSError as error:
        reason = error.strerror or str(error)
        raise ConfigError(f"cannot read {file}: {reason}; give an existing file with {option}") from None


def check_preset(file: Path | None) -> None:
    """Refuse a preset that is no TOML; its keys are checked where they are used.

    Raises:
        ConfigError: When the file is given and no TOML.
    """
    if file is None:
        return
    try:
        tomllib.loads(file.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{file} is not valid TOML: {error}") from None


def check_mujoco() -> None:
    """Refuse a MUJOCO_GL that keeps MuJoCo from loading; pictures here never depend on it.

    Raises:
        ConfigError: When the variable is set and MuJoCo cannot be imported.
    """
    wanted = os.environ.get("MUJOCO_GL")
    if not wanted:
        return
    try:
        import mujoco  # noqa: F401
    except Exception as error:  # a missing library surfaces as AttributeError
        raise ConfigError(
            f"MUJOCO_GL = {wanted} keeps MuJoCo from loading ({error}); unset it, it is not needed"
        ) from None
