"""Search for lines without a prediction: gradients at half resolution, votes around level and upright, refinement."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ibvs_qp.measurement import HORIZONTAL, VERTICAL
from ibvs_qp.vision.classify import LineIdentity, identify_lines
from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.config import VisionConfig
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.lines import refine_lines
from ibvs_qp.vision.picture import Picture, normalised_line
from ibvs_qp.vision.plane import PlaneEstimate
from ibvs_qp.vision.query import LineQuery
from ibvs_qp.vision.refined import RefinedLine
from ibvs_qp.vision.vote import VotedLine, vote_lines

#: Half width of the strip in which a voted line is refined [px at 640]: two half-resolution bins.
_REFINE_PX = 6.0
#: Refined lines nearer than this at both ends of the picture are one [px at 640].
_DUPLICATE_PX = 3.0
#: A voted line nearer than this to both ends of a known one is that one [px at 640].
_COVERED_PX = 8.0
#: Length that earns the full score, share of the picture's width.
_FULL_LENGTH = 0.4


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A detected line with its identity and score.

    Attributes:
        line: The fitted line.
        role: "horizontal" or "vertical", relative to gravity.
        identity: What it is.
        score: 0..1 by length, agreement along it, and identity.
    """

    line: RefinedLine
    role: str
    identity: LineIdentity
    score: float


def detect_lines(
    picture: Picture,
    depth: np.ndarray,
    plane: PlaneEstimate | None,
    grid: CoarseGrid,
    labels: np.ndarray,
    colors: SurfaceColors,
    config: VisionConfig,
    down: np.ndarray | None,
    directions: tuple[bool, ...] = (False, True),
    known: tuple[RefinedLine, ...] = (),
) -> list[Candidate]:
    """Find level and upright lines on or around the surface, best first.

    Args:
        picture: Colour and mask.
        depth: Depth [m], (H, W).
        plane: The surface, or None.
        grid: Coarse grid of the picture.
        labels: Colour labels on the grid, 0 where no surface, uint8 (rows, columns).
        colors: What board and paint look like.
        config: Settings.
        down: Gravity's direction in C, (3,), or None for upright cameras.
        directions: Which lines of the picture are searched: False for level, True for upright ones. The number of
            candidates is shared among both.
        known: Lines that need no search: what is voted along them is left out.

    Returns:
        Candidates of positive score, no two on the same edge.
    """
    tilt = 0.0 if down is None else math.atan2(-float(down[0]), float(down[1]))
    # level and upright swap places with every quarter turn; both are searched
    voted = vote_lines(picture, plane, grid, labels, config, math.remainder(tilt, 0.5 * math.pi), directions)
    voted = [entry for entry in voted if not any(_covered(entry, line, picture) for line in known)]
    voted.sort(key=lambda entry: -entry.rank)
    best = voted[: math.ceil(config.detect.candidates * len(directions) / 2)]
    width = _REFINE_PX * picture.scale
    queries = [_query(entry, picture) for entry in best]
    fits = refine_lines(picture, queries, half_width_px=width, config=config.line, colors=colors, contents=True)
    lines: list[RefinedLine] = []
    for fit in fits:
        if (
            fit is not None
            and fit.length_px >= config.detect.min_length * picture.mask.shape[1]
            and not any(_same(fit, other, picture) for other in lines)
        ):
            lines.append(fit)
    identities = identify_lines(lines, picture, depth, plane, grid, colors, config.line)
    found = [_candidate(line, identity, picture, tilt) for line, identity in zip(lines, identities, strict=True)]
    return sorted(found, key=lambda candidate: -candidate.score)


def role_of(theta: float, tilt: float) -> str:
    """Role of a line by the angle of its normal from gravity's direction in the picture."""
    return HORIZONTAL if abs(math.sin(theta - tilt)) >= abs(math.cos(theta - tilt)) else VERTICAL


def _query(entry: VotedLine, picture: Picture) -> LineQuery:
    """A voted line as something to look for."""
    view = picture.transposed if entry.upright else picture
    slope = (entry.right - entry.left) / (view.width - 1.0)
    rho, angle = normalised_line(-slope, 1.0, -entry.left, view.intrinsics)
    theta = 0.5 * math.pi - angle if entry.upright else angle
    return LineQuery(
        rho=rho,
        theta=theta,
        step=None,
        polarity=entry.polarity,
        span=None,
        extent=None,
        kind="",
        surface_side=0,
    )


def _candidate(line: RefinedLine, identity: LineIdentity, picture: Picture, tilt: float) -> Candidate:
    """A fitted line with its score."""
    length = min(line.length_px / (_FULL_LENGTH * picture.mask.shape[1]), 1.0)
    score = identity.quality * (0.4 + 0.6 * length) * line.inlier_share
    return Candidate(line=line, role=role_of(line.theta, tilt), identity=identity, score=score)


def _covered(entry: VotedLine, line: RefinedLine, picture: Picture) -> bool:
    """Whether a voted line is a known edge: near at both ends of its segment."""
    fx, fy, cx, cy = picture.intrinsics
    across = picture.height if entry.upright else picture.width
    slope = (entry.right - entry.left) / (across - 1.0)
    for x, y in line.segment.tolist():
        u, v = fx * x + cx, fy * y + cy
        along, level = (v, u) if entry.upright else (u, v)
        if abs(entry.left + slope * along - level) >= _COVERED_PX * picture.scale:
            return False
    return True


def _same(one: RefinedLine, two: RefinedLine, picture: Picture) -> bool:
    """Whether two fitted lines run along the same edge where they overlap."""
    if math.cos(one.theta - two.theta) ** 2 < 0.9:
        return False
    limit = _DUPLICATE_PX * picture.scale / picture.intrinsics[0]
    cos, sin = math.cos(two.theta), math.sin(two.theta)
    ends = one.segment.tolist()
    if any(abs(x * cos + y * sin - two.rho) >= limit for x, y in ends):
        return False
    low_one, high_one = sorted(y * cos - x * sin for x, y in ends)
    low_two, high_two = sorted(y * cos - x * sin for x, y in two.segment.tolist())
    return min(high_one, high_two) > max(low_one, low_two)
