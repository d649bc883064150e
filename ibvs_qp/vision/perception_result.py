"""What perception hands out: features for the controller, and everything a strategy or a picture needs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ibvs_qp.measurement import FeatureFrame
from ibvs_qp.vision.lines.candidates import Candidate
from ibvs_qp.vision.lines.line_state import TrackState, no_guides
from ibvs_qp.vision.surface.plane import PlaneEstimate


@dataclass(frozen=True, kw_only=True)
class PerceptionResult:
    """Result of one picture.

    Attributes:
        features: Lines, plane and velocity for an estimator or a controller.
        plane: The surface, or None.
        tracks: All tracks, tentative ones included.
        guides: Track of the surface's own top, bottom, left and right edge, None where none is seen.
        candidates: Lines found by a detection in this picture (empty where none ran).
        refused: Why there is no plane or nothing at all, or None.
        velocity_refused: Why there is no velocity, or None.
        mask: Vehicle's mask of this picture, uint8 (H, W), or None.
        intrinsics: (fx, fy, cx, cy) of this picture [px], or None.
        time_ms: Wall-clock time per stage [ms].
    """

    features: FeatureFrame
    plane: PlaneEstimate | None = None
    tracks: tuple[TrackState, ...] = ()
    guides: dict[str, TrackState | None] = field(default_factory=no_guides)
    candidates: tuple[Candidate, ...] = ()
    refused: str | None = None
    velocity_refused: str | None = None
    mask: np.ndarray | None = None
    intrinsics: tuple[float, float, float, float] | None = None
    time_ms: dict[str, float] = field(default_factory=dict)
