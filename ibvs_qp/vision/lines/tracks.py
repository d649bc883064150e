"""Lines with an identity: predicted, searched in a narrow strip, confirmed, faded out, merged."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.flow.motion import CameraMotion
from ibvs_qp.vision.lines.candidates import Candidate, LineSearch, demote_nested, goes_on, role_of
from ibvs_qp.vision.lines.refine import LineFits, RefinedLine
from ibvs_qp.vision.picture.picture import Picture
from ibvs_qp.vision.surface.plane import SurfaceRegion

#: Fraction of the new step in a track's running colour step.
_STEP_BLEND = 0.2
#: Fraction of the new value in its score and confidence.
_SCORE_BLEND = 0.5
#: A line is searched beyond its ends by this fraction of its length or this much, normalised, whichever is more: it
#: grows into view that fast, and paint over a part of it does not cut it off for good.
_BEYOND, _AT_LEAST = 0.25, 0.15

#: Uncertainty added per frame on prediction alone: rho and theta, standard deviations.
_DRIFT = np.diag([2e-3**2, 2e-3**2])
#: Confidence of a line that the caller expected and that is found there.
_EXPECTED_CONFIDENCE = 0.8
#: A detected line this many times as long as the track that follows its edge replaces its line.
_LONGER = 1.2
#: A line this near to the picture's border shows its outer side no more [px at 640]: the 4 px at which its sides are
#: looked at, and the error of a prediction. A fit there takes the inner shoulder of the edge, 3 px aside, or the next
#: edge inwards.
_BORDER_PX = 7.0
#: Squared cosine of the angle below which two lines cannot be one.
_PARALLEL = 0.9


@dataclass(frozen=True, kw_only=True)
class LineHint:
    """A line that the caller expects; a track starts there, or is steered there, as soon as the picture shows it."""

    name: str  # caller's name, found again in `TrackState.hint`
    rho: float  # expected distance, normalised
    theta: float  # expected angle [rad]
    kind: str = ""  # "board", "paint" or "" for any
    surface_side: int = 0  # side of the (unpainted) surface along the normal, 0 for any
    gate_px: float = 14.0  # half width of the search [px at 640]
    # normalised range along x (level lines) or y (upright ones) in which it exists, or None
    span: tuple[float, float] | None = None


@dataclass
class TrackState:
    """One line followed over time, at the time of a capture; the given-out ones are copies."""

    track_id: int  # identity
    line: RefinedLine  # its last fit
    role: str  # "horizontal" or "vertical" relative to gravity
    kind: str  # "board", "paint" or ""
    surface_side: int  # side of the (unpainted) surface along the normal (cos, sin)
    score: float  # 0..1, ranks the tracks of one picture; 1 for a hint
    certainty: float  # 0..1, fraction of such lines that are of this kind
    borders_plane: bool  # whether the surface ends there by depth
    hint: str = ""  # name of the hint it answers, or ""
    weight: float = 0.0  # 0..1
    age: int = 1  # frames since its start
    hits: list[bool] = field(default_factory=lambda: [True])  # whether it was found, in the last pictures
    confirmed: bool = False  # whether it was detected often enough
    lost_s: float = 0.0  # time for which it has not been found [s]
    fading: float = 1.0  # 0..1, by which the certainty falls in that time; whole again when it is found
    rho: float = 0.0  # distance, normalised
    theta: float = 0.0  # angle [rad]
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((2, 2)))  # of (rho, theta), (2, 2)
    step: np.ndarray = field(default_factory=lambda: np.zeros(3))  # running colour step along the normal, (3,)

    @classmethod
    def of(cls, identity: int, found: Candidate, hint: str = "", **more: Any) -> TrackState:
        """A new track of a detected line."""
        side, ends = found.surface_side, found.borders_plane
        line, role, kind, score, certainty = found.line, found.role, found.kind, found.score, found.confidence
        track = cls(identity, line, role, kind, side, score, certainty, ends, hint, **more)
        track.adopt(found.line)
        return track

    @property
    def confidence(self) -> float:
        """0..1, fraction of such lines that are of this kind; it falls while the line is not seen."""
        return self.certainty * self.fading

    @property
    def seen(self) -> bool:
        """Whether it was detected in this picture."""
        return self.lost_s == 0.0

    @property
    def segment(self) -> np.ndarray:
        """Visible end points, normalised, (2, 2)."""
        return self.line.segment

    @property
    def settled(self) -> bool:
        """Whether it is followed in this picture and a detection could add no knowledge of it."""
        return self.confirmed and self.seen and (self.borders_plane or self.kind == "paint")

    @property
    def extent(self) -> tuple[float, float]:
        """Range along x (level lines) or y (upright ones) in which it was seen last, normalised."""
        axis = 1 if abs(math.cos(self.theta)) > abs(math.sin(self.theta)) else 0
        (first, last) = self.line.segment[:, axis].tolist()
        return (first, last) if first <= last else (last, first)

    @property
    def span(self) -> tuple[float, float]:
        """Range along x or y in which it is searched: somewhat beyond the range of the last detection, normalised."""
        first, last = self.extent
        more = max(_BEYOND * (last - first), _AT_LEAST)
        return first - more, last + more

    def blend(self, found: Candidate) -> None:
        """Blend in the appearance of its two sides in a picture."""
        self.score += _SCORE_BLEND * (found.score - self.score)
        self.certainty += _SCORE_BLEND * (found.confidence - self.certainty)

    def adopt(self, line: RefinedLine) -> None:
        """Take a fresh fit; its normal may point the other way."""
        if self.step.any():
            line = line.aligned(self.theta)
        self.line, self.rho, self.theta, self.covariance = line, line.rho, line.theta, line.covariance
        self.step = line.step if not self.step.any() else self.step + _STEP_BLEND * (line.step - self.step)

    def become(self, other: TrackState) -> None:
        """Take over the kind of another track on the same edge; the identity and the line stay."""
        self.kind, self.borders_plane, self.certainty = other.kind, other.borders_plane, other.certainty
        self.surface_side = other.surface_side if math.cos(self.theta - other.theta) > 0.0 else -other.surface_side


def _leaves(track: TrackState, picture: Picture) -> bool:
    """Whether the visible part of a line lies along the picture's border, or beyond it."""
    (height, width), (fx, fy, cx, cy), least = picture.mask.shape, picture.intrinsics, _BORDER_PX * picture.scale
    cos, sin = math.cos(track.theta), math.sin(track.theta)
    level = abs(sin) >= abs(cos)
    across, along, focal, center, size = (sin, cos, fy, cy, height) if level else (cos, sin, fx, cx, width)
    ends = [(track.rho - end * along) / across * focal + center for end in track.extent]
    return max(ends) < least or min(ends) > size - 1 - least


def _continues(longer: TrackState, track: TrackState) -> bool:
    """Whether a track is a longer line on the edge of another; one that leans off the edge fits its sides worse.

    The score of an edge of paint is its length, and that of a hint 1: neither is a mean along the line.
    """
    if longer.kind != track.kind or longer.line.length_px <= _LONGER * track.line.length_px:
        return False
    rated = track.kind == "board" and not track.hint
    return not rated or goes_on(longer.score, longer.line, track.score, track.line)


class LineTracker:
    """All tracks of one camera."""

    def __init__(self, config: VisionConfig, colors: SurfaceColors) -> None:
        self._config, self._colors, self._fits = config, colors, LineFits(config.line, colors)
        self._search = LineSearch(config.detect, colors, self._fits)
        self.reset()

    def reset(self) -> None:
        """Forget all tracks; identities start at 1 again."""
        self.tracks: list[TrackState] = []
        self._next_id = 1

    def lose(self) -> None:
        """Drop all tracks; identities go on."""
        self.tracks = []

    def refine_tracks(
        self, picture: Picture, motion: CameraMotion, plane: np.ndarray | None, interval_s: float, strip_px: float
    ) -> None:
        """Predict every track into this picture and refine it there, within half a strip's width [px at 640]."""
        for track in self.tracks:
            track.rho, track.theta = motion.line(track.rho, track.theta, plane)
            track.role = role_of(track.theta, picture.tilt or 0.0)
            track.age += 1
        for track, line in zip(self.tracks, self._refined(picture, strip_px), strict=True):
            self._update(track, line, interval_s)
        self._drop()

    def follow_hints(self, hints: tuple[LineHint, ...], picture: Picture) -> None:
        """Name the tracks that answer a hint and look where an expected line has no track yet."""
        for track in self.tracks:
            track.hint = ""
        for hint in hints:
            match = min(self.tracks, key=lambda track: self._distance_px(track, hint, picture), default=None)
            if match is not None and self._distance_px(match, hint, picture) <= hint.gate_px:
                match.hint = hint.name
                continue
            query = self._fits.query(
                hint.rho, hint.theta, span=hint.span, kind=hint.kind, surface_side=hint.surface_side
            )
            [line] = self._fits.fit_lines(picture, [query], hint.gate_px * picture.scale)
            least = self._config.detect.min_length * picture.mask.shape[1]
            if line is None or line.length_px < least or not self._healthy(line, picture):
                continue
            expected = Candidate(
                line=line,
                role=role_of(line.theta, picture.tilt or 0.0),
                kind=hint.kind,
                surface_side=hint.surface_side,
                borders_plane=False,
                score=1.0,
                confidence=_EXPECTED_CONFIDENCE,
            )
            self._start(expected, hint.name)
        self._merge(picture)

    def find_lines(self, picture: Picture, surface: SurfaceRegion, calm: bool) -> list[Candidate]:
        """Search for lines: border scores of the tracks are renewed, new tracks start where nothing follows a line.

        Where all is calm, lines of settled tracks need no search.
        """
        seen = [track for track in self.tracks if track.seen and track.kind == "board"]
        scored = self._search.classify_lines([track.line for track in seen], picture, surface)
        for track, line in zip(seen, scored, strict=True):
            track.borders_plane = track.borders_plane or line.borders_plane
        known = tuple(track.line for track in self.tracks if calm and track.settled)
        found = demote_nested(scored + self._search.find_candidates(picture, surface, known), picture)
        followed, fresh = found[: len(seen)], found[len(seen) :]
        for track, line in zip(seen, followed, strict=True):
            track.blend(line)
        candidates = sorted(fresh, key=lambda entry: -entry.score)
        for candidate in candidates:
            if candidate.kind and candidate.score >= self._config.detect.min_score:
                self._offer(candidate, picture)
        return candidates

    def _offer(self, candidate: Candidate, picture: Picture) -> None:
        """Start a track from a detected line that nothing follows yet; refresh the other."""
        fresh = TrackState.of(0, candidate)
        if _leaves(fresh, picture):
            return
        same = next((track for track in self.tracks if self._same(track, fresh, picture)), None)
        if same is None:
            self._start(candidate)
        elif _continues(fresh, same):
            same.adopt(candidate.line)

    def _start(self, candidate: Candidate, hint: str = "") -> None:
        if len(self.tracks) < self._config.track.capacity:
            self.tracks.append(TrackState.of(self._next_id, candidate, hint))
            self._next_id += 1

    def _refined(self, picture: Picture, strip_px: float) -> list[RefinedLine | None]:
        """Healthy fits of all tracks around their predictions."""
        queries = [
            self._fits.query(
                track.rho,
                track.theta,
                step=track.step,
                span=track.span,
                extent=track.extent,
                kind=track.kind,
                surface_side=track.surface_side,
            )
            for track in self.tracks
        ]
        return [
            line if line is not None and self._healthy(line, picture) and not _leaves(track, picture) else None
            for track, line in zip(
                self.tracks, self._fits.fit_lines(picture, queries, strip_px * picture.scale), strict=True
            )
        ]

    def _healthy(self, line: RefinedLine, picture: Picture) -> bool:
        track = self._config.track
        return line.inlier_share >= track.inlier_share_min and line.rms_px <= track.rms_max_px * max(picture.scale, 0.5)

    def _update(self, track: TrackState, line: RefinedLine | None, interval_s: float) -> None:
        config = self._config.track
        track.hits = [*track.hits, line is not None][-config.confirm_window :]
        if line is None:
            track.lost_s += interval_s
            track.weight = max(0.0, track.weight - interval_s / max(config.hold_s, 1e-3))
            track.fading = max(0.0, 1.0 - track.lost_s / max(config.hold_s, 1e-3))
            track.covariance = track.covariance + _DRIFT
            return
        track.adopt(line)
        track.lost_s, track.fading = 0.0, 1.0
        track.confirmed = track.confirmed or sum(track.hits) >= config.confirm_hits
        if track.confirmed:
            track.weight = min(1.0, track.weight + config.rise)

    def _drop(self) -> None:
        config = self._config.track
        self.tracks = [
            track
            for track in self.tracks
            if (
                track.lost_s < config.hold_s
                if track.confirmed
                else sum(track.hits) + config.confirm_window - len(track.hits) >= config.confirm_hits
            )
        ]

    def _merge(self, picture: Picture) -> None:
        """Of two tracks on one edge the older stays; without distinct colours it takes the expected kind."""
        kept: list[TrackState] = []
        for track in self.tracks:
            twin = next((other for other in kept if self._same(other, track, picture)), None)
            if twin is None:
                kept.append(track)
                continue
            if _continues(track, twin):
                twin.adopt(track.line)
            if track.hint and not twin.hint:
                twin.hint = track.hint
                if not self._colors.paint_distinct:
                    twin.become(track)
        self.tracks = kept

    def _same(self, one: TrackState, two: TrackState, picture: Picture) -> bool:
        """Whether two tracks follow one edge: near at the middle of both segments, overlapping, same colour step."""
        agreement = math.cos(one.theta - two.theta)
        if agreement * agreement < _PARALLEL or float(one.step @ two.step) * agreement <= 0.0:
            return False
        limit = self._config.track.duplicate_px * picture.scale / picture.intrinsics[0]
        cos, sin = math.cos(one.theta), math.sin(one.theta)
        ends = two.line.segment.tolist()
        if any(abs(x * cos + y * sin - one.rho) > limit for x, y in ends):
            return False
        low_one, high_one = sorted(y * cos - x * sin for x, y in one.line.segment.tolist())
        low_two, high_two = sorted(y * cos - x * sin for x, y in ends)
        return min(high_one, high_two) > max(low_one, low_two)

    def _distance_px(self, track: TrackState, hint: LineHint, picture: Picture) -> float:
        """Distance of a track from a hint at the middle of its segment [px at 640]; infinite for another thing."""
        if hint.kind and track.kind != hint.kind:
            return math.inf
        agreement = math.cos(track.theta - hint.theta)
        if agreement**2 < _PARALLEL:
            return math.inf
        if hint.surface_side and track.surface_side * math.copysign(1.0, agreement) != hint.surface_side:
            return math.inf
        points = track.line.segment
        if hint.span is not None:
            axis = 0 if abs(math.sin(hint.theta)) > abs(math.cos(hint.theta)) else 1
            low, high = sorted((points[0, axis], points[1, axis]))
            if high < hint.span[0] or low > hint.span[1]:
                return math.inf
        middle = points.mean(axis=0)
        distance = abs(middle[0] * math.cos(hint.theta) + middle[1] * math.sin(hint.theta) - hint.rho)
        return distance * picture.intrinsics[0] / picture.scale
