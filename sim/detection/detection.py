"""Result of a detection by any pipeline: lines in pixels and normalised, four guides, the plane."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ibvs_qp.vision.surface.plane import PlaneEstimate

#: The four guides, by the side of the surface on which they lie.
GUIDE_SIDES = ("top", "bottom", "left", "right")


@dataclass(frozen=True, kw_only=True)
class DetectedLine:
    """One line of a picture.

    Attributes:
        pixels: Its visible end points [[u1, v1], [u2, v2]] in the picture as taken [px], (2, 2).
        rho: Distance from the image centre, normalised, lens distortion removed.
        theta: Angle of the normal [rad].
        covariance: Of (rho, theta), (2, 2).
        score: 0..1, how well it fits the request; ranks lines of one picture.
        confidence: 0..1, fraction of such lines that are right; 0.8 and more is sure.
        borders_plane: Whether the surface ends there.
        surface_side: +1 if the surface lies on the side the normal (cos, sin) points to, -1 on the other, 0 unknown.
        line_id: Identity of a track, kept from picture to picture of a followed sequence; lines without a track are
            numbered after those of their picture.
    """

    pixels: np.ndarray
    rho: float
    theta: float
    covariance: np.ndarray
    score: float = 0.0
    confidence: float = 0.0
    borders_plane: bool = False
    surface_side: int = 0
    line_id: int = 0

    @property
    def length_px(self) -> float:
        """Length of the visible segment [px]."""
        return float(np.hypot(*(self.pixels[1] - self.pixels[0])))


def no_guides() -> dict[str, DetectedLine | None]:
    """All four guides absent."""
    return dict.fromkeys(GUIDE_SIDES)


@dataclass(frozen=True, kw_only=True)
class Detection:
    """Result of one picture.

    Attributes:
        plane: The surface, or None.
        refused: Why there is no surface, or None.
        candidates: Lines on or around the surface, best first.
        guides: The surface's own top, bottom, left and right edge, None where none is in view.
        tracked: Whether the picture continued a sequence.
        time_ms: Wall-clock time of the detection [ms].
    """

    plane: PlaneEstimate | None = None
    refused: str | None = None
    candidates: tuple[DetectedLine, ...] = ()
    guides: dict[str, DetectedLine | None] = field(default_factory=no_guides)
    tracked: bool = False
    time_ms: float = 0.0
