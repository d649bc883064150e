"""Shipped presets: vehicle, gains, weights and limits as tuned."""

from __future__ import annotations

import functools
from pathlib import Path

from ibvs_qp.config.errors import out_of_range
from ibvs_qp.pilot.config import PilotConfig

#: Folder of the shipped presets, and their files by name.
FOLDER = Path(__file__).parent
FILES = {file.stem: file for file in sorted(FOLDER.glob("*.toml"))}
#: Preset of each law; where their gains come from: docs/tuning.md.
_OF_LAW = {"qp": "tarot_t960_qp", "paper": "tarot_t960_paper"}


@functools.cache
def preset(name: str = "qp") -> PilotConfig:
    """A shipped preset; the controller's part of it is ``preset(name).controller``.

    Args:
        name: Law ("qp", "paper"), or a file of `FOLDER` without its ending, as "octorotor_qp".

    Returns:
        The configuration, immutable.

    Raises:
        ConfigError: When no preset has this name.
    """
    file = FILES.get(_OF_LAW.get(name, name))
    if file is None:
        raise out_of_range("preset", name, "", f"allowed are {', '.join([*_OF_LAW, *FILES])}")
    return PilotConfig.from_toml(file)
