"""Lines with an identity: predicted, searched in a narrow strip, confirmed, faded out, merged."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.flow.motion import CameraMotion
from ibvs_qp.vision.lines.candidates import Candidate, classify_lines, role_of
from ibvs_qp.vision.lines.line_state import LineHint, TrackState
from ibvs_qp.vision.lines.refine import LineQuery, RefinedLine, refine_lines
from ibvs_qp.vision.picture.picture import Picture, denormalise
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


@dataclass
class Track:
    """One line followed over time; its confidence fades while it is not seen, and is whole again when it is."""

    track_id: int
    line: RefinedLine
    role: str
    kind: str
    surface_side: int
    score: float
    confidence: float
    borders_plane: bool
    hint: str = ""
    weight: float = 0.0
    age: int = 1
    hits: list[bool] = field(default_factory=lambda: [True])
    confirmed: bool = False
    lost_s: float = 0.0
    fading: float = 1.0
    rho: float = 0.0
    theta: float = 0.0
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((2, 2)))
    step: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @classmethod
    def of(cls, identity: int, found: Candidate, hint: str = "", **more: Any) -> Track:
        """A new track of a detected line."""
        track = cls(
            track_id=identity,
            line=found.line,
            role=found.role,
            kind=found.kind,
            surface_side=found.surface_side,
            score=found.score,
            confidence=found.confidence,
            borders_plane=found.borders_plane,
            hint=hint,
            **more,
        )
        track.adopt(found.line)
        return track

    @property
    def settled(self) -> bool:
        """Whether it is followed in this picture and a detection could add no knowledge of it."""
        return self.confirmed and self.lost_s == 0.0 and (self.borders_plane or self.kind == "paint")

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
        self.confidence += _SCORE_BLEND * (found.confidence - self.confidence)
        self.borders_plane = self.borders_plane or found.borders_plane

    def adopt(self, line: RefinedLine) -> None:
        """Take a fresh fit; its normal may point the other way."""
        if self.step.any():
            line = line.aligned(self.theta)
        self.line, self.rho, self.theta, self.covariance = line, line.rho, line.theta, line.covariance
        self.step = line.step if not self.step.any() else self.step + _STEP_BLEND * (line.step - self.step)

    def become(self, other: Track) -> None:
        """Take over the kind of another track on the same edge; the identity and the line stay."""
        self.kind, self.borders_plane, self.confidence = other.kind, other.borders_plane, other.confidence
        self.surface_side = other.surface_side if math.cos(self.theta - other.theta) > 0.0 else -other.surface_side

    def state(self) -> TrackState:
        """Frozen copy for the outside."""
        line = self.line
        return TrackState(
            track_id=self.track_id,
            role=self.role,
            kind=self.kind,
            surface_side=self.surface_side,
            rho=self.rho,
            theta=self.theta,
            covariance=self.covariance,
            segment=line.segment,
            ends=line.ends,
            weight=self.weight,
            confirmed=self.confirmed,
            seen=self.lost_s == 0.0,
            age=self.age,
            inlier_share=line.inlier_share,
            rms_px=line.rms_px,
            length_px=line.length_px,
            score=self.score,
            confidence=self.confidence * self.fading,
            borders_plane=self.borders_plane,
            hint=self.hint,
        )


def _leaves(track: Track, picture: Picture) -> bool:
    """Whether the visible part of a line lies along the picture's border, or beyond it."""
    (height, width), (fx, fy, cx, cy), least = picture.mask.shape, picture.intrinsics, _BORDER_PX * picture.scale
    cos, sin = math.cos(track.theta), math.sin(track.theta)
    level = abs(sin) >= abs(cos)
    across, along, focal, center, size = (sin, cos, fy, cy, height) if level else (cos, sin, fx, cx, width)
    ends = [(track.rho - end * along) / across * focal + center for end in track.extent]
    return max(ends) < least or min(ends) > size - 1 - least


class LineTracker:
    """All tracks of one camera."""

    def __init__(self, config: VisionConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Forget all tracks; identities start at 1 again."""
        self.tracks: list[Track] = []
        self._next_id = 1

    def lose(self) -> None:
        """Drop all tracks; identities go on."""
        self.tracks = []

    def advance(
        self,
        picture: Picture,
        motion: CameraMotion,
        plane: np.ndarray | None,
        interval_s: float,
        colors: SurfaceColors,
        tilt: float,
        strip_px: float,
    ) -> None:
        """Predict every track into this picture and refine it there, within half a strip's width [px at 640]."""
        for track in self.tracks:
            track.rho, track.theta = motion.line(track.rho, track.theta, plane)
            track.role = role_of(track.theta, tilt)
            track.age += 1
        for track, line in zip(self.tracks, self._refined(picture, colors, strip_px), strict=True):
            self._update(track, line, interval_s)
        self._drop()

    def hints(self, hints: tuple[LineHint, ...], picture: Picture, colors: SurfaceColors, tilt: float) -> None:
        """Name the tracks that answer a hint and look where an expected line has no track yet."""
        for track in self.tracks:
            track.hint = ""
        for hint in hints:
            match = min(self.tracks, key=lambda track: self._distance_px(track, hint, picture), default=None)
            if match is not None and self._distance_px(match, hint, picture) <= hint.gate_px:
                match.hint = hint.name
                continue
            query = LineQuery(
                rho=hint.rho, theta=hint.theta, span=hint.span, kind=hint.kind, surface_side=hint.surface_side
            )
            [line] = refine_lines(
                picture,
                [query],
                half_width_px=hint.gate_px * picture.scale,
                config=self._config.line,
                colors=colors,
            )
            least = self._config.detect.min_length * picture.mask.shape[1]
            if line is None or line.length_px < least or not self._healthy(line, picture):
                continue
            expected = Candidate(
                line=line,
                pixels=denormalise(line.segment, picture.intrinsics),
                role=role_of(line.theta, tilt),
                kind=hint.kind,
                surface_side=hint.surface_side,
                borders_plane=False,
                score=1.0,
                confidence=_EXPECTED_CONFIDENCE,
            )
            self._start(expected, hint.name)
        self._merge(picture, colors)

    def offer(self, candidates: list[Candidate], picture: Picture) -> None:
        """Start tracks from detected lines that nothing follows yet; refresh the others."""
        for candidate in candidates:
            if not candidate.kind or candidate.score < self._config.detect.min_score:
                continue
            fresh = Track.of(0, candidate)
            if _leaves(fresh, picture):
                continue
            same = next((track for track in self.tracks if self._same(track, fresh, picture)), None)
            if same is None:
                self._start(candidate)
            elif same.kind == candidate.kind and candidate.line.length_px > _LONGER * same.line.length_px:
                same.adopt(candidate.line)

    def rescore(self, picture: Picture, surface: SurfaceRegion, colors: SurfaceColors, tilt: float | None) -> None:
        """Update the border scores of the lines detected in this picture."""
        seen = [track for track in self.tracks if track.lost_s == 0.0 and track.kind == "board"]
        lines = [track.line for track in seen]
        for track, found in zip(seen, classify_lines(lines, picture, surface, colors, tilt), strict=True):
            track.blend(found)

    def _start(self, candidate: Candidate, hint: str = "") -> None:
        if len(self.tracks) >= self._config.track.capacity:
            return
        self.tracks.append(Track.of(self._next_id, candidate, hint))
        self._next_id += 1

    def _refined(self, picture: Picture, colors: SurfaceColors, strip_px: float) -> list[RefinedLine | None]:
        """Healthy fits of all tracks around their predictions."""
        queries = [
            LineQuery(
                rho=track.rho,
                theta=track.theta,
                step=track.step,
                span=track.span,
                extent=track.extent,
                kind=track.kind,
                surface_side=track.surface_side,
            )
            for track in self.tracks
        ]
        config = self._config.line
        width = strip_px * picture.scale
        found = refine_lines(picture, queries, half_width_px=width, config=config, colors=colors)
        return [
            line if line is not None and self._healthy(line, picture) and not _leaves(track, picture) else None
            for track, line in zip(self.tracks, found, strict=True)
        ]

    def _healthy(self, line: RefinedLine, picture: Picture) -> bool:
        track = self._config.track
        return line.inlier_share >= track.inlier_share_min and line.rms_px <= track.rms_max_px * max(picture.scale, 0.5)

    def _update(self, track: Track, line: RefinedLine | None, interval_s: float) -> None:
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

    def _merge(self, picture: Picture, colors: SurfaceColors) -> None:
        """Of two tracks on one edge the older stays; without distinct colours it takes the expected kind."""
        kept: list[Track] = []
        for track in self.tracks:
            twin = next((other for other in kept if self._same(other, track, picture)), None)
            if twin is None:
                kept.append(track)
                continue
            if track.kind == twin.kind and track.line.length_px > _LONGER * twin.line.length_px:
                twin.adopt(track.line)
            if track.hint and not twin.hint:
                twin.hint = track.hint
                if not colors.paint_distinct:
                    twin.become(track)
        self.tracks = kept

    def _same(self, one: Track, two: Track, picture: Picture) -> bool:
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

    def _distance_px(self, track: Track, hint: LineHint, picture: Picture) -> float:
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
