"""The pipelines of `ibvs-qp detect`, by name."""

from __future__ import annotations

import importlib
from typing import Any

#: Module and class of every method; imported on use, for a quick help of the command.
METHODS = {"own": ("sim.detection.own", "OwnMethod"), "paper": ("sim.detection.own", "PaperMethod")}


def make_method(name: str) -> Any:
    """A new pipeline with its default settings.

    Returns:
        An object with `detect(frame, seed_pixel)`, which returns an `sim.detection.detection.Detection`. It may also
        have `every_line(frame)`, all lines of the whole picture, and `follow(frame, seed_pixel)` with `reset()`, which
        continues a motion sequence.

    Raises:
        KeyError: For a name that is not among `METHODS`.
    """
    module, kind = METHODS[name]
    return getattr(importlib.import_module(module), kind)()
