"""Lines of a surface through a motion sequence: predicted, fitted again, judged, kept or given up."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace

import numpy as np

from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.lines import refine_lines
from ibvs_qp.vision.motion import CameraMotion
from ibvs_qp.vision.picture import Picture, denormalise, normalise
from ibvs_qp.vision.query import LineQuery
from ibvs_qp.vision.refined import RefinedLine
from ibvs_qp.vision.survey.config import SurveyConfig
from ibvs_qp.vision.survey.detection import GUIDE_SIDES, DetectedLine, no_guides
from ibvs_qp.vision.survey.guides import guide_side, same_edge

#: Half width of the search strip with and without a known motion of the camera [px at 640].
_STRIP_PX, _BLIND_PX = 8.0, 14.0
#: A line is searched beyond its ends by this share of its length.
_BEYOND = 0.25
#: Frames for which a line lives on prediction alone: 0.3 s at 30 Hz.
_HOLD = 9
#: A challenger takes a guide's place when its score is better by this in two of three pictures.
_BETTER, _WINS, _WINDOW = 0.08, 2, 3
#: Share of the new value in a line's running score and confidence.
_BLEND = 0.5
#: Most lines followed.
_CAPACITY = 12


@dataclass
class FollowedLine:
    """One line with its identity.

    Attributes:
        line: As seen or predicted in the last picture.
        step: Colour step along the normal, (3,).
        lost: Pictures since it was seen.
    """

    line: DetectedLine
    step: np.ndarray
    lost: int = 0


@dataclass
class LineFollower:
    """All followed lines of one surface and the guides among them."""

    config: SurveyConfig
    lines: list[FollowedLine] = field(default_factory=list)
    holders: dict[str, int] = field(default_factory=dict)
    wins: dict[str, deque[int]] = field(default_factory=lambda: {side: deque(maxlen=_WINDOW) for side in GUIDE_SIDES})
    next_id: int = 1

    def queries(self, motion: CameraMotion | None, plane: np.ndarray, picture: Picture) -> list[LineQuery]:
        """Move all lines into this picture and say where to look for them."""
        result = []
        for followed in self.lines:
            if motion is not None:
                followed.line = _moved(followed.line, motion, plane, picture)
            line = followed.line
            ends = normalise(line.pixels, picture.intrinsics)
            axis = 1 if abs(np.cos(line.theta)) > abs(np.sin(line.theta)) else 0
            low, high = np.sort(ends[:, axis]).tolist()
            more = _BEYOND * (high - low)
            result.append(LineQuery(rho=line.rho, theta=line.theta, step=followed.step, span=(low - more, high + more)))
        return result

    def refit(
        self, picture: Picture, queries: list[LineQuery], known_motion: bool, colors: SurfaceColors
    ) -> list[RefinedLine | None]:
        """Healthy fits of all lines around their predictions."""
        width = (_STRIP_PX if known_motion else _BLIND_PX) * picture.scale
        fits: list[RefinedLine | None] = []
        for query in queries:  # one by one: short lines must not thin out the profiles of long ones
            fits += refine_lines(picture, [query], half_width_px=width, config=self.config.line, colors=colors)
        track = self.config.track
        limit = track.rms_max_px * max(picture.scale, 0.5)
        return [
            fit if fit is not None and fit.inlier_share >= track.inlier_share_min and fit.rms_px <= limit else None
            for fit in fits
        ]

    def update(self, judged: list[DetectedLine | None], picture: Picture) -> None:
        """Take the judged lines of this picture, in the order of the followed ones; None for those not seen."""
        for followed, line in zip(self.lines, judged, strict=True):
            if line is None or line.fit is None:
                followed.lost += 1
                share = max(0.0, 1.0 - followed.lost / _HOLD)
                followed.line = replace(followed.line, confidence=followed.line.confidence * share)
                continue
            before = followed.line
            followed.lost = 0
            followed.step = followed.step + _BLEND * (line.fit.step - followed.step)
            followed.line = replace(
                line,
                line_id=before.line_id,
                score=before.score + _BLEND * (line.score - before.score),
                confidence=before.confidence + _BLEND * (line.confidence - before.confidence),
            )
        kept: list[FollowedLine] = []
        limit = self.config.track.duplicate_px * picture.scale
        for followed in sorted(self.lines, key=lambda entry: (entry.lost > 0, entry.line.line_id)):
            if followed.lost <= _HOLD and not any(same_edge(followed.line, other.line, limit) for other in kept):
                kept.append(followed)
        self.lines = kept

    def offer(self, lines: tuple[DetectedLine, ...], picture: Picture) -> None:
        """Follow detected lines that nothing follows yet, best first."""
        limit = self.config.track.duplicate_px * picture.scale
        for line in lines:
            if not line.borders_plane or line.fit is None or len(self.lines) >= _CAPACITY:
                continue
            if any(same_edge(line, other.line, limit) or same_edge(other.line, line, limit) for other in self.lines):
                continue
            self.lines.append(FollowedLine(replace(line, line_id=self.next_id), line.fit.step))
            self.next_id += 1

    def guides(self) -> dict[str, DetectedLine | None]:
        """The guide of every side: it changes hands only when another line was better in two of three pictures."""
        result = no_guides()
        for side in GUIDE_SIDES:
            able = [entry.line for entry in self.lines if guide_side(entry.line, self.config) == side]
            able = [line for line in able if line.borders_plane and line.score >= self.config.guide_score_min]
            best = max(able, key=lambda line: line.score, default=None)
            holder = next((line for line in able if line.line_id == self.holders.get(side)), None)
            wins = self.wins[side]
            if best is not None and holder is not None and best.line_id != holder.line_id:
                wins.append(best.line_id if best.score > holder.score + _BETTER else 0)
                if wins.count(best.line_id) < _WINS:
                    best = holder
            else:
                wins.append(0)
            if best is not None:
                self.holders[side] = best.line_id
                result[side] = best
        return result

    @property
    def contested(self) -> bool:
        """Whether a guide was lost or challenged, so that another detection is worth its time."""
        seen = {entry.line.line_id for entry in self.lines if entry.lost == 0}
        return any(holder not in seen for holder in self.holders.values()) or any(
            any(wins) for wins in self.wins.values()
        )


def _moved(line: DetectedLine, motion: CameraMotion, plane: np.ndarray, picture: Picture) -> DetectedLine:
    """A line of the surface as it looks after the camera has moved."""
    rho, theta = motion.line(line.rho, line.theta, plane)
    ends = normalise(line.pixels, picture.intrinsics)
    rays = np.column_stack((ends, np.ones(2)))
    points = rays / np.maximum(rays @ plane, 1e-3)[:, None]
    now = (points - motion.translation) @ motion.rotation
    moved = now[:, :2] / np.maximum(now[:, 2:], 1e-3)
    return replace(line, rho=rho, theta=theta, pixels=denormalise(moved, picture.intrinsics))
