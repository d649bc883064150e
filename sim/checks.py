"""Checks of what a user typed, made before anything costs time."""

from __future__ import annotations

import tomllib
from pathlib import Path

from ibvs_qp.errors import ConfigError, out_of_range


def check_seed(seed: int) -> None:
    """Refuse a negative seed.

    Raises:
        ConfigError: When the seed is below zero.
    """
    if seed < 0:
        raise out_of_range("--seed", seed, "", "allowed are 0, 1, 2, ...")


def check_preset(file: Path) -> None:
    """Refuse a preset that cannot be read or is no TOML; its keys are checked where they are used.

    Raises:
        ConfigError: When the file is missing or no TOML.
    """
    try:
        tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"cannot read preset {file}: {error.strerror or error}; give an existing file") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"preset {file} is not valid TOML: {error}") from None
