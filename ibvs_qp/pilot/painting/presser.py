"""Press and hold, then slide: a strategy that studies contact without a paint job."""

from __future__ import annotations

import dataclasses
import math

from ibvs_qp.pilot.painting.command import ExpectedEdge, PainterInput, PaintingCommand
from ibvs_qp.pilot.painting.config import PaintingConfig
from ibvs_qp.pilot.painting.painter import Painter
from ibvs_qp.pilot.painting.speed import ramped


class Presser(Painter):
    """Approaches and aligns like the painter, presses for a time, slides along the edge for a time, and retreats.

    The hold begins with the touch, at any push.

    Args:
        config: The paint job; its push, margins, speed and acceleration are used.
        hold_s: Time from touch to the slide or the retreat [s].
        slide_s: Time of sliding to the left [s]; 0 for none.
        descend_s: After `abandon`: time of retreat and descent until the strategy ends [s].
    """

    _COMPLETED = "held, retreated"

    def __init__(self, config: PaintingConfig, hold_s: float, slide_s: float = 0.0, descend_s: float = 5.0) -> None:
        self._hold_s, self._slide_s, self._SLIDES = hold_s, slide_s, slide_s > 0.0
        super().__init__(dataclasses.replace(config, descend_s=descend_s))

    def reset(self) -> None:
        """As after construction."""
        super().reset()
        self._touched = math.inf

    def expected_edge(self) -> ExpectedEdge | None:
        """None: a slide has one path and paints no stroke beside it."""
        return None

    def abandon(self, inputs: PainterInput, reason: str) -> None:
        """Leave the wall for good; a press that studies this case ends as planned, so it is no failure."""
        self._leave_for_good(inputs, reason)

    def _time_out(self, inputs: PainterInput) -> None:
        if self.phase != "press" or math.isinf(self._touched):
            super()._time_out(inputs)

    def _begin_job(self, inputs: PainterInput, found: str) -> None:
        """A press begins at the margin from the edge beside it, or where the tip is."""
        if not self._tip.along.find_mark(self._tip.lines):
            self._tip.along.start_here()
        self._enter(inputs, "approach", found)

    def _press(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        self._hold_touch_point(inputs)
        if inputs.in_contact:
            self._touched = min(self._touched, inputs.time_s)
        if inputs.time_s - self._touched > self._hold_s:
            held = f"held for {self._hold_s:g} s"
            if self._SLIDES:
                self._begin_stroke(inputs, f"{held}, sliding")
            else:
                self._enter(inputs, "retreat", held)
        return self._on_the_wall(hold=True)

    def _paint(self, inputs: PainterInput, dt: float) -> PaintingCommand:
        self._pause_without_contact(inputs)
        target = 0.0 if self._paused else self.config.speed_m_s
        self._speed = ramped(self._speed, target, self.config.acceleration_m_s2 * dt)
        if inputs.time_s - self.entered > self._slide_s:
            self._enter(inputs, "retreat", f"slid for {self._slide_s:g} s")
        return self._on_the_wall(speed=(self._speed, 0.0))
