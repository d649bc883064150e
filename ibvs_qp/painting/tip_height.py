"""Height of the true tip below the believed one, seen in the fresh paint beside the brush."""

from __future__ import annotations

from ibvs_qp.measurement import HORIZONTAL
from ibvs_qp.painting.command import PainterInput
from ibvs_qp.painting.config import PaintingConfig
from ibvs_qp.painting.line_choice import CERTAIN_WEIGHT

#: Standard deviation of the tip's height in the picture, by mount and arm, and of a painted edge in one look [m].
TIP_STD, EDGE_STD = 5e-3, 3e-3
#: An edge farther from its expected place than this many of the former belongs to something else [-].
TIP_SIGMAS = 3.0
#: Time between two looks that count as independent: the path swings within a second [s].
LOOK_TIME = 1.0


class TipHeight:
    r"""Error of the believed tip, by camera mount, arm and attitude in the picture.

    The brush leaves edges half its width above and below the true tip. If that lies :math:`\delta` below the believed
    tip, both edges appear :math:`\delta` lower than they should. The mean over row 1 is weighed against the prior.

    Attributes:
        error: :math:`\delta` [m], 0 until paint was seen.
    """

    def __init__(self, config: PaintingConfig) -> None:
        self._half = 0.5 * config.brush_width_m
        self.error = 0.0
        self._sum = self._looks = 0.0

    def look(self, inputs: PainterInput, dt: float) -> None:
        """Look at the fresh paint for a tick of dt [s]."""
        for line in inputs.lines.values():
            if line.role != HORIZONTAL or line.kind != "paint" or line.weight < CERTAIN_WEIGHT or not line.surface_side:
                continue
            seen = line.offset - line.surface_side * self._half  # the bare surface is above the upper edge
            if abs(seen) < TIP_SIGMAS * TIP_STD:
                looks = dt / LOOK_TIME
                self._sum, self._looks = self._sum + looks * seen, self._looks + looks
        known, prior = self._looks / EDGE_STD**2, 1.0 / TIP_STD**2
        self.error = self._sum / EDGE_STD**2 / (known + prior)
