"""What to look for: a predicted line with what is known of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.lines.admissible import kind_of

_ANYWHERE, _NO_STEP = (-math.inf, math.inf), (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class LineQuery:
    """A predicted line.

    Attributes:
        rho: Predicted distance, normalised.
        theta: Predicted angle [rad].
        step: Colour step across the line, along the normal, (3,); None for a new line.
        polarity: +1 or -1 if a new line's colours rise or fall along the normal, 0 if unknown.
        span: Normalised range along x (level lines) or y (upright ones) to look at, or None for the whole picture.
        extent: The same kind of range in which it was seen last, or None: most of what is visible there must show it.
        kind: "board", "paint" or "": what the two sides must look like.
        surface_side: Side of the working surface along the normal.
    """

    rho: float
    theta: float
    step: np.ndarray | None = None
    polarity: int = 0
    span: tuple[float, float] | None = None
    extent: tuple[float, float] | None = None
    kind: str = ""
    surface_side: int = 0

    def row(self, colors: SurfaceColors) -> tuple[float, ...]:
        """The query as a row of `ibvs_qp.vision.kernels.line_tables`."""
        return (
            self.rho,
            self.theta,
            *(_ANYWHERE if self.span is None else self.span),
            *(_ANYWHERE if self.extent is None else self.extent),
            self.step is not None,
            *(_NO_STEP if self.step is None else self.step.tolist()),
            self.polarity,
            kind_of(self.kind, self.surface_side, colors),
            self.surface_side,
            self.kind == "board",
        )
