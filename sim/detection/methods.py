"""The pipelines that `ibvs-qp detect` offers, by name."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from ibvs_qp.measurement import RgbdFrame


class FrameMethod(Protocol):
    """A pipeline for one picture.

    A method may also have `every_line(frame)`, all lines of the whole picture, and `follow(frame, seed_pixel)` with
    `reset()`, which continues a motion sequence; without them its candidates and its `detect` stand in.
    """

    def detect(self, frame: RgbdFrame, seed_pixel: tuple[float, float] | None) -> Any:
        """Result with plane, refused, candidates and guides, as `ibvs_qp.vision.survey.Detection` has them."""
        ...


#: Module and class of every method; loaded on use, so that the help of the command stays quick.
METHODS = {"own": ("ibvs_qp.vision.survey", "SurveyPipeline"), "paper": ("sim.detection.paper", "PaperMethod")}


def make_method(name: str) -> FrameMethod:
    """A fresh pipeline with its default settings.

    Raises:
        KeyError: For a name that is not among `METHODS`.
    """
    module, kind = METHODS[name]
    factory: Callable[[], FrameMethod] = getattr(importlib.import_module(module), kind)
    return factory()
