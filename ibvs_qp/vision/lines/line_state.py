"""Lines at the interface of perception: expected ones come in, followed ones go out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


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
