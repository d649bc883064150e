"""A line in view that carries the error of an estimated coordinate to the controller."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ibvs_qp.painting.pattern_lines import LOST_WEIGHT, PatternLine


class Carrier:
    """Turns the error of u or v into the target of a line.

    The controller moves the tip by lines. The target is where the line appears once the error is gone, so that the
    controller acts on the estimate: a painted edge may wave, and a change of line makes no step.

    Attributes:
        line: The line at this tick, None where no line is in view.
    """

    def __init__(self) -> None:
        self.line: PatternLine | None = None
        self._track = -1

    def update(self, lines: Iterable[PatternLine], tracks: Sequence[int]) -> bool:
        """Follow the first of the tracks that is in view; True if it is another one than before.

        Args:
            lines: All lines.
            tracks: Tracks that may be followed, best first.
        """
        seen = {line.track.track_id: line for line in lines if line.weight > LOST_WEIGHT}
        self.line = next((seen[track] for track in tracks if track in seen), None)
        before, self._track = self._track, -1 if self.line is None else self.line.track.track_id
        return self.line is not None and self._track != before

    def offset(self, error: float) -> float:
        """Target offset of the line [m] where the tip's coordinate is to grow by an error [m]."""
        assert self.line is not None
        return (self.line.place - error) * self.line.scale
