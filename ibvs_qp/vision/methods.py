"""The pipelines that `ibvs-qp detect` offers, by name."""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable
from typing import Any, Protocol

from ibvs_qp.measurement import RgbdFrame


class FrameMethod(Protocol):
    """A pipeline for one picture.

    A method may also have `every_line(frame)`, all lines of the whole picture, and `follow(frame, seed_pixel)` with
    `reset()`, which continues a motion sequence; without them its candidates and its `detect` stand in.
    """

    def detect(self, frame: RgbdFrame, seed_pixel: tuple[float, float] | None) -> Any:
        """Result with plane, refused, candidates and guides, as `ibvs_qp.vision.survey.Detection` has them."""
        ...


#: Module and class of every method; one whose module is absent is not offered.
_METHODS = {
    "own": ("ibvs_qp.vision.survey", "SurveyPipeline"),
    "paper": ("ibvs_qp.vision.paper", "PaperPipeline"),
}


def available_methods() -> tuple[str, ...]:
    """Names of the methods whose module is there."""
    return tuple(name for name, (module, _) in _METHODS.items() if importlib.util.find_spec(module) is not None)


def make_method(name: str) -> FrameMethod:
    """A fresh pipeline with its default settings.

    Raises:
        KeyError: For a name that is not among `available_methods()`.
    """
    module, kind = _METHODS[name]
    factory: Callable[[], FrameMethod] = getattr(importlib.import_module(module), kind)
    return factory()
