"""Puts the parts of one picture's result together."""

from __future__ import annotations

import numpy as np

from ibvs_qp.measurement import FeatureFrame, LineFeature, RgbdFrame
from ibvs_qp.vision.flow.solve_velocity import FlowVelocity
from ibvs_qp.vision.lines.candidates import Candidate
from ibvs_qp.vision.lines.guides import GuideKeeper
from ibvs_qp.vision.lines.line_state import no_guides
from ibvs_qp.vision.lines.track import Track
from ibvs_qp.vision.perception_result import PerceptionResult
from ibvs_qp.vision.surface.estimate import PlaneEstimate


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
