"""One line followed over time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ibvs_qp.vision.lines.line_state import TrackState
from ibvs_qp.vision.lines.refined import RefinedLine

#: Share of the new step in a track's running colour step.
_STEP_BLEND = 0.2
#: Share of the new value in its score and confidence.
_JUDGED_BLEND = 0.5
#: A line is searched beyond its ends by this share of its length or this much, normalised, whichever is more: it grows
#: into view that fast, and paint over a part of it does not cut it off for good.
_BEYOND, _AT_LEAST = 0.25, 0.15


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

    @property
    def settled(self) -> bool:
        """Whether it is followed in this picture and a detection could add nothing to what is known of it."""
        return self.confirmed and self.lost_s == 0.0 and (self.borders_plane or self.kind == "paint")

    @property
    def extent(self) -> tuple[float, float]:
        """Range along x (level lines) or y (upright ones) in which it was seen last, normalised."""
        axis = 1 if abs(math.cos(self.theta)) > abs(math.sin(self.theta)) else 0
        (first, last) = self.line.segment[:, axis].tolist()
        return (first, last) if first <= last else (last, first)

    @property
    def span(self) -> tuple[float, float]:
        """Range along x or y in which it is searched: somewhat beyond what was seen last, normalised."""
        first, last = self.extent
        more = max(_BEYOND * (last - first), _AT_LEAST)
        return first - more, last + more

    def judge(self, score: float, confidence: float, borders: bool) -> None:
        """Take what its two sides show in a picture."""
        self.score += _JUDGED_BLEND * (score - self.score)
        self.confidence += _JUDGED_BLEND * (confidence - self.confidence)
        self.borders_plane = self.borders_plane or borders

    def adopt(self, line: RefinedLine) -> None:
        """Take a fresh fit; its normal may point the other way."""
        if self.step.any():
            line = line.aligned(self.theta)
        self.line, self.rho, self.theta, self.covariance = line, line.rho, line.theta, line.covariance
        self.step = line.step if not self.step.any() else self.step + _STEP_BLEND * (line.step - self.step)

    def become(self, other: Track) -> None:
        """Be what another track on the same edge is; the identity and the line stay."""
        self.kind, self.borders_plane, self.confidence = other.kind, other.borders_plane, other.confidence
        self.surface_side = other.surface_side if math.cos(self.theta - other.theta) > 0.0 else -other.surface_side

    def state(self) -> TrackState:
        """Frozen copy for the outside."""
        return TrackState(
            track_id=self.track_id,
            role=self.role,
            kind=self.kind,
            surface_side=self.surface_side,
            rho=self.rho,
            theta=self.theta,
            covariance=self.covariance,
            segment=self.line.segment,
            ends=self.line.ends,
            weight=self.weight,
            confirmed=self.confirmed,
            seen=self.lost_s == 0.0,
            age=self.age,
            inlier_share=self.line.inlier_share,
            rms_px=self.line.rms_px,
            length_px=self.line.length_px,
            score=self.score,
            confidence=self.confidence * self.fading,
            borders_plane=self.borders_plane,
            hint=self.hint,
        )
