"""Lines with an identity: predicted, searched in a narrow strip, confirmed, faded out, merged."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.flow.camera_motion import CameraMotion
from ibvs_qp.vision.lines.candidates import Candidate, judge_lines, role_of
from ibvs_qp.vision.lines.line_state import LineHint
from ibvs_qp.vision.lines.query import LineQuery
from ibvs_qp.vision.lines.refine_lines import refine_lines
from ibvs_qp.vision.lines.refined import RefinedLine
from ibvs_qp.vision.lines.track import Track
from ibvs_qp.vision.picture.picture import Picture, denormalise
from ibvs_qp.vision.surface.region import SurfaceRegion

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


def _track_of(identity: int, candidate: Candidate, hint: str = "") -> Track:
    """A new track of a detected line."""
    track = Track(
        identity,
        candidate.line,
        candidate.role,
        candidate.kind,
        candidate.surface_side,
        candidate.score,
        candidate.confidence,
        candidate.borders_plane,
        hint,
    )
    track.adopt(candidate.line)
    return track


def _leaves(track: Track, picture: Picture) -> bool:
    """Whether all that was seen of a line lies along the picture's border, or beyond it."""
    (first, last), (cos, sin) = track.extent, (math.cos(track.theta), math.sin(track.theta))
    height, width = picture.mask.shape
    if abs(sin) >= abs(cos):
        places, size = [(x, (track.rho - x * cos) / sin) for x in (first, last)], height
    else:
        places, size = [((track.rho - y * sin) / cos, y) for y in (first, last)], width
    axis, least = (1 if abs(sin) >= abs(cos) else 0), _BORDER_PX * picture.scale
    across = denormalise(np.array(places), picture.intrinsics)[:, axis]
    return bool((across < least).all() or (across > size - 1 - least).all())


class LineTracker:
    """All tracks of one camera."""

    def __init__(self, config: VisionConfig) -> None:
        """Take the settings; no tracks yet."""
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
        """Start tracks from detected lines that nothing follows yet; refresh what is known of the others."""
        for candidate in candidates:
            if not candidate.kind or candidate.score < self._config.detect.min_score:
                continue
            fresh = _track_of(0, candidate)
            if _leaves(fresh, picture):
                continue
            same = next((track for track in self.tracks if self._same(track, fresh, picture)), None)
            if same is None:
                self._start(candidate)
            elif same.kind == candidate.kind and candidate.line.length_px > _LONGER * same.line.length_px:
                same.adopt(candidate.line)

    def judge(
        self, picture: Picture, depth: np.ndarray, surface: SurfaceRegion, colors: SurfaceColors, tilt: float | None
    ) -> None:
        """Score anew what the lines seen in this picture border."""
        seen = [track for track in self.tracks if track.lost_s == 0.0 and track.kind == "board"]
        lines = [track.line for track in seen]
        for track, found in zip(seen, judge_lines(lines, picture, depth, surface, colors, tilt), strict=True):
            track.judge(found.score, found.confidence, found.borders_plane)

    def _start(self, candidate: Candidate, hint: str = "") -> None:
        if len(self.tracks) >= self._config.track.capacity:
            return
        self.tracks.append(_track_of(self._next_id, candidate, hint))
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
        """Of two tracks on one edge the older stays; it is what a caller expects there if no colour tells."""
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
