"""Result of the paper's pipeline for one picture, in the types of the own detection."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.vision.lines.candidates import Candidate
from ibvs_qp.vision.lines.refine import RefinedLine
from ibvs_qp.vision.paper.box import SurfaceBox
from ibvs_qp.vision.picture.layout import Intrinsics
from ibvs_qp.vision.picture.picture import normalise
from ibvs_qp.vision.surface.plane import PlaneEstimate

#: The published pipeline rates no line: every line has this confidence [-].
CONFIDENCE = 0.5
#: Length that earns the full score, fraction of the picture's width; as in the own detection.
_FULL_LENGTH = 0.4
_NO_STEP = np.zeros(3)


@dataclass(frozen=True, kw_only=True)
class PaperDetection:
    """Result of one picture.

    Attributes:
        plane: The surface, or None.
        refused: Why the surface is missing, or None.
        candidates: Every level and upright segment, longest first.
        horizontal: The topmost level one, or None.
        vertical: The first upright one, or None.
        box: The bounding box, or None.
        time_ms: Wall-clock time per stage [ms].
    """

    plane: PlaneEstimate | None = None
    refused: str | None = None
    candidates: tuple[Candidate, ...] = ()
    horizontal: Candidate | None = None
    vertical: Candidate | None = None
    box: SurfaceBox | None = None
    time_ms: dict[str, float] = field(default_factory=dict)

    @property
    def guides(self) -> dict[str, Candidate | None]:
        """Top, bottom, left and right: "topmost" names no bottom, an upright line is a side of the box's middle."""
        guides: dict[str, Candidate | None] = dict.fromkeys(("top", "bottom", "left", "right"))
        guides["top"] = self.horizontal
        if self.vertical is not None:
            # the surface lies along the normal's side: right of a left edge
            rightwards = self.vertical.surface_side * math.cos(self.vertical.line.theta) > 0.0
            guides["left" if rightwards else "right"] = self.vertical
        return guides

    @property
    def time_total_ms(self) -> float:
        """Wall-clock time of the whole picture [ms]."""
        return sum(self.time_ms.values())


def candidate(
    ends: np.ndarray, upright: bool, box: SurfaceBox, intrinsics: Intrinsics, width: int, sigma_px: float, margin: float
) -> Candidate:
    """A segment with (rho, theta), covariance and score.

    Args:
        ends: (2, 2) [px].
        upright: Whether it is an upright one.
        box: Shows on which side the surface lies.
        intrinsics: (fx, fy, cx, cy) [px].
        width: Of the picture [px].
        sigma_px: Error of an end [px].
        margin: A segment this near to a side of the box borders the surface [px].
    """
    (u0, v0), (u1, v1) = ends.tolist() if _forward(ends, upright) else ends[::-1].tolist()
    run, rise = u1 - u0, v1 - v0
    length = math.hypot(run, rise)
    # normal to the right of an upright line, down from a level one
    p, q = (rise / length, -run / length) if upright else (-rise / length, run / length)
    rho, theta = normalised_line(p, q, -p * u0 - q * v0, intrinsics)
    segment = normalise(np.array([[u0, v0], [u1, v1]]), intrinsics)
    middle_u, middle_v = box.center
    side = 1 if p * (middle_u - u0) + q * (middle_v - v0) >= 0.0 else -1
    near, far = (box.left, box.right) if upright else (box.top, box.bottom)
    place = 0.5 * (u0 + u1) if upright else 0.5 * (v0 + v1)
    line = RefinedLine(
        rho=rho,
        theta=theta,
        covariance=_covariance(segment, rho, theta, sigma_px / intrinsics[0]),
        segment=segment,
        ends=("end", "end"),
        inlier_share=1.0,
        rms_px=sigma_px,
        length_px=length,
        step=_NO_STEP,
        ends_px=ends,
    )
    return Candidate(
        line=line,
        role=VERTICAL if upright else HORIZONTAL,
        kind="",
        surface_side=side,
        borders_plane=min(abs(place - near), abs(place - far)) <= margin,
        score=min(1.0, length / (_FULL_LENGTH * width)),
        confidence=CONFIDENCE,
    )


def _forward(ends: np.ndarray, upright: bool) -> bool:
    """Whether the ends come in growing u (level) or v (upright)."""
    along = 1 if upright else 0
    return bool(ends[1, along] >= ends[0, along])


def _covariance(segment: np.ndarray, rho: float, theta: float, sigma: float) -> np.ndarray:
    """Of (rho, theta), both ends off by ``sigma`` across the line: a turn about the middle moves rho as well."""
    along = segment @ np.array([-math.sin(theta), math.cos(theta)])
    length = max(abs(float(along[1] - along[0])), 1e-6)
    lever = float(along.mean())
    turn = 2.0 * sigma**2 / length**2
    # rho = offset of the middle - lever * (turn), to first order
    return np.array([[0.5 * sigma**2 + lever**2 * turn, -lever * turn], [-lever * turn, turn]])


def plane_of(box: SurfaceBox, shape: tuple[int, int], columns: int) -> PlaneEstimate:
    """The box as a surface: a plane with the mean normal at the measured distance.

    Args:
        box: The surface.
        shape: (height, width) of the picture [px].
        columns: Columns of the coarse grid on which the surface is shown.
    """
    inverse_depth = box.normal / box.distance_m
    stride = max(1, round(shape[1] / columns))
    v, u = np.arange(stride // 2, shape[0], stride), np.arange(stride // 2, shape[1], stride)
    component = ((v >= box.top) & (v <= box.bottom))[:, None] & ((u >= box.left) & (u <= box.right))[None, :]
    along = np.outer(inverse_depth, inverse_depth)
    tilt = (np.eye(3) - np.outer(box.normal, box.normal)) * (box.normal_sigma / box.distance_m) ** 2
    return PlaneEstimate(
        inverse_depth=inverse_depth,
        covariance=tilt + along * (box.distance_sigma_m / box.distance_m) ** 2,
        normal=-box.normal,
        distance_m=box.distance_m,
        inlier_share=box.inlier_share,
        residual_sigma=box.residual_sigma,
        component=component,
    )


def normalised_line(p: float, q: float, r: float, intrinsics: Intrinsics) -> tuple[float, float]:
    """(rho, theta) of the pixel line p u + q v + r = 0."""
    fx, fy, cx, cy = intrinsics
    a, b, c = p * fx, q * fy, p * cx + q * cy + r
    length = math.hypot(a, b)
    return -c / length, math.atan2(b, a)
