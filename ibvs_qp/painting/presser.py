"""Press and hold, then slide if wanted: the strategy for studying contact without painting a whole job."""

from __future__ import annotations

import dataclasses
import math

from ibvs_qp.painting.job import PaintingConfig, Scenery, Wish
from ibvs_qp.painting.painter import Painter


class Presser(Painter):
    """Approaches and aligns like the painter, presses for a time, slides for a time along the edge, and retreats.

    The push is never waited for: holding begins with the touch, whatever the push then does.

    Args:
        config: The paint job; its push, margins, speed and acceleration are used.
        hold_s: Time from touch to the slide or the retreat [s].
        slide_s: Time of sliding to the left [s]; 0 leaves the tip where it is.
        descend_s: After `abandon`: time of retreat and descent until the strategy ends [s].
    """

    def __init__(self, config: PaintingConfig, hold_s: float, slide_s: float = 0.0, descend_s: float = 5.0) -> None:
        self._hold_s, self._slide_s, self._slides = hold_s, slide_s, slide_s > 0.0
        super().__init__(dataclasses.replace(config, descend_s=descend_s))

    def reset(self) -> None:
        """Back to the start."""
        super().reset()
        self._touched = math.nan

    def abandon(self, seen: Scenery, reason: str) -> None:
        """Give up the wall for good; what a press studies is how, so that the flight ends as planned."""
        self._give_up(seen, reason)

    def _time_out(self, seen: Scenery) -> None:
        if self.phase == "press" and not math.isnan(self._touched):
            return  # a hold lasts as long as it was asked to
        super()._time_out(seen)

    def _press(self, seen: Scenery, dt: float) -> Wish:
        self._keep_guide(seen)
        self._hold_where_it_touched(seen)
        if math.isnan(self._touched) and seen.in_contact:
            self._touched = seen.time_s
        if seen.time_s - self._touched > self._hold_s:
            if self._slide_s > 0.0:
                self.row, self._speed = 1, 0.0
                self._enter(seen, "paint", f"held for {self._hold_s:g} s, sliding")
            else:
                self._enter(seen, "retreat", f"held for {self._hold_s:g} s")
        return self._wish(seen, contact=True, hold=True, mark=True)

    def _paint(self, seen: Scenery, dt: float) -> Wish:
        self._keep_guide(seen)
        self._check_contact(seen)
        step = self.config.acceleration_m_s2 * dt
        wanted = 0.0 if self._paused else self.config.speed_m_s
        self._speed += min(max(wanted - self._speed, -2.0 * step), step)
        if seen.time_s - self.entered > self._slide_s:
            self._enter(seen, "retreat", f"slid for {self._slide_s:g} s")
        return self._wish(seen, contact=True, along=-self._speed)

    def _retreat(self, seen: Scenery, dt: float) -> Wish:
        if not self._given_up and seen.distance > self.config.retreat_m - 0.02 and not seen.in_contact:
            self._end(seen, "held, retreated" if not self.failed else self.reason)
        return super()._retreat(seen, dt)
