"""Sub-pixel fits of lines around their predictions, all in one batch, with covariance and visible segment."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ibvs_qp.frames import align_line
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.lines.line_fit import fit_lines
from ibvs_qp.vision.lines.strips import ANY, BORDER, ENDS, LINE, PAINT_EDGE, QUERY, Pixels, Search
from ibvs_qp.vision.picture.picture import Picture, normalise

#: Distance from the edge at which its two sides are looked at [px at 640]: beyond blur, within a 10 mm margin.
_SIDE_PX = 4.0
#: Half width of the strip in which a segment is fitted [px at 640].
_REFINE_PX = 4.0
#: A segment is fitted beyond its ends by this fraction of its length: detectors stop short.
FIT_BEYOND = 0.15
#: Segments fitted in one batch: those of a batch share the number of profiles.
_BATCH = 8
#: Polarity of a segment along the normal of its line, which points to the right of the way from end to end.
_DARKER = -1
_ANYWHERE, _NO_STEP = (-math.inf, math.inf), np.zeros(3)
_NO_LABELS, _NO_DEPTH = np.empty(0, np.uint8), np.empty(0, np.float32)
#: Signs of the covariance of (rho, theta) where rho changes its sign.
_REVERSED = np.array([[1.0, -1.0], [-1.0, 1.0]])


@dataclass(frozen=True, kw_only=True)
class LineQuery:
    """A predicted line."""

    rho: float  # predicted distance, normalised
    theta: float  # predicted angle [rad]
    step: np.ndarray | None = None  # colour step across the line, along the normal, (3,); None for a new line
    polarity: int = 0  # +1 or -1 if a new line's colours rise or fall along the normal, 0 if unknown
    # normalised range along x (level lines) or y (upright ones) to look at, or None for the whole picture
    span: tuple[float, float] | None = None
    # the same kind of range in which it was seen last, or None: most of the visible part there must show it
    extent: tuple[float, float] | None = None
    kind: str = ""  # "board", "paint" or "": appearance of the two sides
    surface_side: int = 0  # side of the working surface along the normal

    def record(self, colors: SurfaceColors) -> tuple[object, ...]:
        """The query as a record of `QUERY`."""
        demand = BORDER
        if not self.kind or self.surface_side == 0 or colors.board is None:
            demand = ANY
        elif self.kind == "paint":
            demand = PAINT_EDGE if colors.paint_distinct else ANY
        return (
            self.rho,
            self.theta,
            self.span or _ANYWHERE,
            self.extent or _ANYWHERE,
            self.step is not None,
            _NO_STEP if self.step is None else self.step,
            self.polarity,
            demand,
            self.surface_side,
            self.kind == "board",
        )


@dataclass(frozen=True, kw_only=True)
class RefinedLine:
    """A line fitted to the picture."""

    rho: float  # distance from the image centre, normalised
    theta: float  # angle of the normal, within pi/2 of the prediction's [rad]
    covariance: np.ndarray  # of (rho, theta), (2, 2)
    segment: np.ndarray  # visible end points, normalised, (2, 2), along growing u (level lines) or v (upright ones)
    ends: tuple[str, str]  # why the segment ends there: "picture", "mask", "span" or "end" (it really ends)
    inlier_share: float  # fraction of the visible profiles within the segment that agree
    rms_px: float  # residual of the agreeing profiles [px]
    length_px: float  # length of the segment [px]
    step: np.ndarray  # colour behind the line minus colour before it, along the normal, (3,)
    # colours at the agreeing profiles before and behind the line, along the normal, (2, n, 3); empty unless asked for
    sides: np.ndarray
    pixels: np.ndarray  # places of the agreeing profiles, (n, 2) [px]; empty unless asked for

    def aligned(self, theta: float) -> RefinedLine:
        """The same line with its normal within 90 degrees of an angle [rad]."""
        if math.cos(self.theta - theta) >= 0.0:
            return self
        rho, angle = align_line(self.rho, self.theta, theta)
        return dataclasses.replace(
            self,
            rho=rho,
            theta=angle,
            covariance=self.covariance * _REVERSED,
            step=-self.step,
            sides=self.sides[::-1],
        )


def refine_lines(
    picture: Picture,
    queries: list[LineQuery],
    *,
    half_width_px: float,
    config: LineConfig,
    colors: SurfaceColors,
    contents: bool = False,
) -> list[RefinedLine | None]:
    """Fit the lines near their predictions.

    Args:
        picture: Colour, mask and depth.
        queries: Predicted lines.
        half_width_px: Half width of the search strips [px].
        config: Settings.
        colors: Colours of board and paint.
        contents: Whether the results shall carry the colours of their sides and the places of their profiles.

    Returns:
        For every query its line, or None when nothing there supports it.
    """
    if not queries:
        return []
    lines, kept = np.empty(len(queries), LINE), len(queries) if contents else 0
    sides, places = np.empty((kept, 2, config.profiles, 3), np.uint8), np.empty((kept, config.profiles, 2))
    pixels = Pixels(
        picture.rgb,
        picture.mask,
        _NO_DEPTH if picture.depth is None or picture.plane is None else picture.depth.reshape(-1),
        _NO_LABELS if colors.board is None else colors.table(),
        colors.levels,
        picture.intrinsics,
        picture.plane or (0.0, 0.0, 0.0),
    )
    search = Search(
        reach=max(2, round(half_width_px)),
        side=max(2, round(_SIDE_PX * picture.scale)),
        contrast_min=float(config.contrast_min),
        gate=config.inlier_px * picture.scale,
        bridge=config.bridge_px * picture.scale,
        profiles=config.profiles,
        min_profiles=config.min_profiles,
        bias=config.bias_px * picture.scale,
    )
    fit_lines(pixels, np.array([query.record(colors) for query in queries], QUERY), search, lines, sides, places)
    found: list[RefinedLine | None] = []
    records: list[Any] = lines.tolist()
    for k, record in enumerate(records):
        alive, rho, theta, covariance, segment, (first, last), share, count, rms, length, step = record
        if not alive or abs(rho) > config.rho_max:
            found.append(None)
            continue
        line = RefinedLine(
            rho=rho,
            theta=theta,
            covariance=covariance,
            segment=segment,
            ends=(ENDS[first], ENDS[last]),
            inlier_share=share,
            rms_px=rms,
            length_px=length,
            step=step,
            sides=sides[k, :, :count] if contents else sides.reshape(2, 0, 3),
            pixels=places[k, :count] if contents else places.reshape(0, 2),
        )
        found.append(line)
    return found


def fit_segments(
    segments: np.ndarray,
    picture: Picture,
    config: LineConfig,
    colors: SurfaceColors,
    beyond: np.ndarray | None = None,
    contents: bool = False,
    half_width_px: float | None = None,
) -> list[RefinedLine | None]:
    """Sub-pixel fits of segments.

    Args:
        segments: End points (u1, v1, u2, v2) [px], the brighter side to the left of the way, (n, 4); the brighter one
            by the channel that changes most.
        picture: Colour and camera.
        config: Settings of the fit.
        colors: Of the surface.
        beyond: Fraction of its length by which each is fitted beyond its ends, (n,); `FIT_BEYOND` unless given.
        contents: Whether the colours of both sides are returned.
        half_width_px: Half width of the strips; 4 px at 640 unless given.

    Returns:
        One fit for every segment, None where nothing supports one.
    """
    shares = np.full(len(segments), FIT_BEYOND) if beyond is None else beyond
    fx, fy, cx, cy = picture.intrinsics
    x, y = normalise(segments.reshape(-1, 2, 2), picture.intrinsics).transpose(2, 1, 0)
    across, down = y[0] - y[1], x[1] - x[0]
    rho, theta = (across * x[0] + down * y[0]) / np.hypot(across, down), np.arctan2(down, across)
    queries = []
    for ends, share, *line in zip(*(each.tolist() for each in (segments, shares, rho, theta)), strict=True):
        (u1, v1, u2, v2), upright = ends, abs(math.cos(line[1])) > abs(math.sin(line[1]))
        low, high = sorted(((v1 - cy) / fy, (v2 - cy) / fy) if upright else ((u1 - cx) / fx, (u2 - cx) / fx))
        span = low - share * (high - low), high + share * (high - low)
        queries.append(LineQuery(rho=line[0], theta=line[1], polarity=_DARKER, span=span))
    fits: list[RefinedLine | None] = []
    for start in range(0, len(queries), _BATCH):
        fits += refine_lines(
            picture,
            queries[start : start + _BATCH],
            half_width_px=half_width_px or _REFINE_PX * picture.scale,
            config=config,
            colors=colors,
            contents=contents,
        )
    return fits
