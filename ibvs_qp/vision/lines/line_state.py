"""Lines at the interface of perception: expected ones come in; followed ones and the guides of the surface go out."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

#: The four guides, by the side of the surface on which they lie.
GUIDE_SIDES = ("top", "bottom", "left", "right")
#: Direction from a guide towards the surface, in the picture (right, down).
_INWARD = {"top": (0.0, 1.0), "bottom": (0.0, -1.0), "left": (1.0, 0.0), "right": (-1.0, 0.0)}
#: A line this near to level or upright may be a guide of that direction [deg].
_WITHIN_DEG = 40.0
#: Weakest score of a guide.
_LEAST_SCORE = 0.30
#: A challenger takes a guide's place when its score is better by this in two of three pictures.
_BETTER, _WINS, _WINDOW = 0.08, 2, 3


@dataclass(frozen=True, kw_only=True)
class LineHint:
    """A line that the caller expects; a track starts there, or is steered there, as soon as the picture shows it.

    Attributes:
        name: Caller's name, found again in `TrackState.hint`.
        rho: Expected distance, normalised.
        theta: Expected angle [rad].
        kind: "board", "paint" or "" for any.
        surface_side: Side of the (unpainted) surface along the normal, 0 for any.
        gate_px: Half width of the search [px at 640].
        span: Normalised range along x (level lines) or y (upright ones) in which it exists, or None.
    """

    name: str
    rho: float
    theta: float
    kind: str = ""
    surface_side: int = 0
    gate_px: float = 14.0
    span: tuple[float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class TrackState:
    """One tracked line at the time of capture.

    Attributes:
        track_id: Identity.
        role: "horizontal" or "vertical" relative to gravity.
        kind: "board", "paint" or "".
        surface_side: Side of the (unpainted) surface along the normal (cos, sin).
        rho: Distance, normalised.
        theta: Angle [rad].
        covariance: Of (rho, theta), (2, 2).
        segment: Visible end points, normalised, (2, 2).
        ends: Why it ends there: "picture", "mask", "span" or "end" (it really ends).
        weight: 0..1.
        confirmed: Whether it was detected often enough.
        seen: Whether it was detected in this picture.
        age: Frames since its start.
        inlier_share: Fraction of profiles that agree.
        rms_px: Residual [px].
        length_px: Length of the segment [px].
        score: 0..1, ranks the tracks of one picture; 1 for a hint.
        confidence: 0..1, fraction of such lines that are of this kind; it falls while the line is not seen.
        borders_plane: Whether the surface ends there by depth.
        hint: Name of the hint it answers, or "".
    """

    track_id: int
    role: str
    kind: str
    surface_side: int
    rho: float
    theta: float
    covariance: np.ndarray
    segment: np.ndarray
    ends: tuple[str, str]
    weight: float
    confirmed: bool
    seen: bool
    age: int
    inlier_share: float
    rms_px: float
    length_px: float
    score: float
    confidence: float
    borders_plane: bool
    hint: str


def no_guides() -> dict[str, TrackState | None]:
    """All four guides absent."""
    return dict.fromkeys(GUIDE_SIDES)


def guide_side(line: TrackState) -> str | None:
    """Which guide a line could be, by the direction in which the surface lies from it; None if it is too slanted."""
    if line.surface_side == 0:
        return None
    x, y = line.surface_side * math.cos(line.theta), line.surface_side * math.sin(line.theta)
    limit = math.cos(math.radians(_WITHIN_DEG))
    return next((side for side in GUIDE_SIDES if x * _INWARD[side][0] + y * _INWARD[side][1] > limit), None)


class GuideKeeper:
    """Chooses the guides picture by picture, so that they do not flicker."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the guides so far."""
        self._holders: dict[str, int] = {}
        self._wins: dict[str, deque[int]] = {side: deque(maxlen=_WINDOW) for side in GUIDE_SIDES}

    def choose(self, tracks: tuple[TrackState, ...]) -> dict[str, TrackState | None]:
        """The guide of every side, None where no line is good enough."""
        result = no_guides()
        able = [track for track in tracks if track.borders_plane and track.score >= _LEAST_SCORE]
        for side in GUIDE_SIDES:
            lines = [track for track in able if guide_side(track) == side]
            best = max(lines, key=lambda track: track.score, default=None)
            if best is None:
                continue
            holder = next((track for track in lines if track.track_id == self._holders.get(side)), None)
            result[side] = self._winner(side, best, holder)
            self._holders[side] = result[side].track_id  # type: ignore[union-attr]
        return result

    def _winner(self, side: str, best: TrackState, holder: TrackState | None) -> TrackState:
        """The best line, or the holder until a challenger was better often enough."""
        wins = self._wins[side]
        if holder is None or best.track_id == holder.track_id:
            wins.append(0)
            return best
        wins.append(best.track_id if best.score > holder.score + _BETTER else 0)
        return best if wins.count(best.track_id) >= _WINS else holder
