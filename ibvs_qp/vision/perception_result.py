"""Result of perception: features for the controller, and everything a strategy or an overlay needs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ibvs_qp.measurement import FeatureFrame, LineFeature, RgbdFrame
from ibvs_qp.vision.flow.velocity import FlowVelocity
from ibvs_qp.vision.lines.candidates import Candidate
from ibvs_qp.vision.lines.guides import GuideKeeper, no_guides
from ibvs_qp.vision.lines.line_state import TrackState
from ibvs_qp.vision.lines.tracks import Track
from ibvs_qp.vision.surface.plane import PlaneEstimate


@dataclass(frozen=True, kw_only=True)
class PerceptionResult:
    """Result of one picture.

    Attributes:
        features: Lines, plane and velocity for an estimator or a controller.
        plane: The surface, or None.
        tracks: All tracks, tentative ones included.
        guides: Track of the surface's own top, bottom, left and right edge, None where none is in view.
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


def make_result(
    frame: RgbdFrame,
    followed: list[Track],
    plane: PlaneEstimate | None,
    flow: FlowVelocity | str,
    candidates: tuple[Candidate, ...],
    refused: str | None,
    mask: np.ndarray,
    times: dict[str, float],
    guides: GuideKeeper | None = None,
    least_confidence: float = 0.0,
    curvature: np.ndarray | None = None,
) -> PerceptionResult:
    """Result of one picture; only confirmed and certain tracks of positive weight become features."""
    tracks = tuple(track.state() for track in followed)
    certain = {
        track.track_id for track in followed if track.confidence >= least_confidence
    }  # seen or not: weight fades
    lines = tuple(
        LineFeature(
            rho=track.rho,
            theta=track.theta,
            covariance=track.covariance,
            role=track.role,
            weight=track.weight,
            stamp_ns=frame.stamp_ns,
            track_id=track.track_id,
            segment=track.segment,
            surface_side=track.surface_side,
            kind=track.kind,
        )
        for track in tracks
        if track.confirmed and track.weight > 0.0 and track.track_id in certain
    )
    moving = flow if isinstance(flow, FlowVelocity) else None
    features = FeatureFrame(
        lines=lines,
        plane=None if plane is None else plane.abcd,
        stamp_ns=frame.stamp_ns,
        velocity=None if moving is None else moving.velocity,
        velocity_covariance=None if moving is None else moving.covariance,
        velocity_stamp_ns=0 if moving is None else moving.stamp_ns,
        curvature=curvature,
    )
    return PerceptionResult(
        features=features,
        plane=plane,
        tracks=tracks,
        guides=no_guides() if guides is None else guides.choose(tracks),
        candidates=candidates,
        refused=refused,
        velocity_refused=None if moving is not None else str(flow),
        mask=mask,
        intrinsics=frame.intrinsics,
        time_ms=times,
    )
