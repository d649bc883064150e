"""What is said between who asks for flow and the process that works it out (`ibvs_qp.vision.flow_ahead`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ibvs_qp.vision.config import FlowConfig
from ibvs_qp.vision.flow_solve import FlowVelocity
from ibvs_qp.vision.mask import Intrinsics


@dataclass(frozen=True)
class Lens:
    """What stays from picture to picture: arguments of `SparseFlow.update`."""

    config: FlowConfig
    excluded: np.ndarray
    intrinsics: Intrinsics
    camera_position: np.ndarray


@dataclass(frozen=True)
class Step:
    """One picture to follow into.

    Attributes:
        place: Where the picture lies in the memory of the process.
        stamp_ns: Capture time.
        rotation: Turn of the body since the picture before [rad], (3).
    """

    place: int
    stamp_ns: int
    rotation: list[float]


@dataclass(frozen=True)
class FlowTask:
    """What the process shall do, in this order.

    Attributes:
        number: Found again in the answer.
        lens: What has changed of the lens; forgets everything.
        surface: Of the picture followed into last, for `SparseFlow.settle`; None for none or no surface.
        busy: Likewise; None when that picture is not settled now.
        step: What to follow into, or None.
        reset: Whether to forget everything before the step.
        again: Whether the step takes the place of the one before, whose picture never came.
    """

    number: int
    lens: Lens | None
    surface: tuple[list[float], float] | None
    busy: bool | None
    step: Step | None
    reset: bool
    again: bool


@dataclass(frozen=True)
class FlowAnswer:
    """Result of a step, and the time that it took [ms]."""

    number: int
    result: FlowVelocity | str
    spent_ms: float


class FlowLink(Protocol):
    """The way to the process."""

    def place(self, rgb: np.ndarray) -> int:
        """Where a picture that it has handed out lies."""
        ...

    def following(self, place: int) -> tuple[int, int] | None:
        """Place of the picture taken after that one, and the time between both [ns]; None if there is none yet."""
        ...

    def ask(self, task: FlowTask) -> None:
        """Send a task."""
        ...

    def answer(self, number: int) -> FlowAnswer:
        """Wait for the answer to a task; those to earlier ones are dropped."""
        ...
