"""Sub-pixel fits of lines around their predictions, all in one batch, with covariance and visible segment."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ibvs_qp.frames import align_line
from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.lines.line_fit import fit_profiles
from ibvs_qp.vision.lines.strips import ANY, BORDER, ENDS, LINE, PAINT_EDGE, QUERY, Pixels, Search
from ibvs_qp.vision.picture.picture import Picture, denormalise, normalise

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


@dataclass(frozen=True)
class RefinedLine:
    """A line fitted to the picture: a record of `LINE`, and the values beside the line if they were requested."""

    rho: float  # distance from the image centre, normalised
    theta: float  # angle of the normal, within pi/2 of the prediction's [rad]
    covariance: np.ndarray  # of (rho, theta), (2, 2)
    segment: np.ndarray  # visible end points, normalised, (2, 2), along growing u (level lines) or v (upright ones)
    ends: tuple[str, str]  # why the segment ends there: "picture", "mask", "span" or "end" (it really ends)
    inlier_share: float  # fraction of the visible profiles within the segment that agree
    rms_px: float  # residual of the agreeing profiles [px]
    length_px: float  # length of the segment [px]
    step: np.ndarray  # colour behind the line minus colour before it, along the normal, (3,)
    ends_px: np.ndarray  # the segment's end points [px], (2, 2)
    # colours at the agreeing profiles before and behind it, along the normal, (2, n, 3), and their places (n, 2) [px]
    sides: np.ndarray = field(default_factory=lambda: np.zeros((2, 0, 3), np.uint8))
    pixels: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))

    def aligned(self, theta: float) -> RefinedLine:
        """The same line with its normal within 90 degrees of an angle [rad]."""
        if math.cos(self.theta - theta) >= 0.0:
            return self
        rho, angle = align_line(self.rho, self.theta, theta)
        turned, sides = self.covariance * _REVERSED, self.sides[::-1]
        return dataclasses.replace(self, rho=rho, theta=angle, covariance=turned, step=-self.step, sides=sides)


class LineFits:
    """Fits lines to pictures of one camera, on board and paint of known colours."""

    def __init__(self, config: LineConfig, colors: SurfaceColors) -> None:
        self._config, self._colors = config, colors

    def query(
        self,
        rho: float,
        theta: float,
        *,
        step: np.ndarray | None = None,
        polarity: int = 0,
        span: tuple[float, float] | None = None,
        extent: tuple[float, float] | None = None,
        kind: str = "",
        surface_side: int = 0,
    ) -> tuple[object, ...]:
        """A predicted line as a record of `QUERY`.

        Args:
            rho: Predicted distance, normalised.
            theta: Predicted angle [rad].
            step: Colour step across the line, along the normal, (3,); None for a new line.
            polarity: +1 or -1 if a new line's colours rise or fall along the normal, 0 if unknown.
            span: Normalised range along x (level lines) or y (upright ones) to look at, None for the whole picture.
            extent: The same in which it was found last, or None: most of the visible part there must show it.
            kind: "board", "paint" or "": appearance of the two sides.
            surface_side: Side of the working surface along the normal, 0 if unknown.
        """
        demand = BORDER
        if not kind or surface_side == 0 or self._colors.board is None:
            demand = ANY
        elif kind == "paint":
            demand = PAINT_EDGE if self._colors.paint_distinct else ANY
        known, ranges = step is not None, (span or _ANYWHERE, extent or _ANYWHERE)
        return rho, theta, *ranges, known, step if known else _NO_STEP, polarity, demand, surface_side, kind == "board"

    def fit_lines(
        self, picture: Picture, queries: list[tuple[object, ...]], half_width_px: float, contents: bool = False
    ) -> list[RefinedLine | None]:
        """Fit the lines near their predictions, within a half width [px]; None where nothing supports one.

        Contents are the colours beside the lines and the places of their profiles.
        """
        if not queries:
            return []
        config, colors, scale = self._config, self._colors, picture.scale
        lines, kept = np.zeros(len(queries), LINE), len(queries) if contents else 0
        sides, places = np.empty((kept, 2, config.profiles, 3), np.uint8), np.empty((kept, config.profiles, 2))
        pixels = Pixels(
            picture.rgb,
            picture.mask,
            _NO_DEPTH if picture.plane is None else picture.depth.reshape(-1),
            _NO_LABELS if colors.board is None else colors.table(shade=picture.plane is not None),
            colors.levels,
            picture.intrinsics,
            picture.plane or (0.0, 0.0, 0.0),
        )
        search = Search(
            reach=max(2, round(half_width_px)),
            side=max(2, round(_SIDE_PX * scale)),
            contrast_min=float(config.contrast_min),
            gate=config.inlier_px * scale,
            bridge=config.bridge_px * scale,
            profiles=config.profiles,
            min_profiles=config.min_profiles,
            bias=config.bias_px * scale,
        )
        fit_profiles(pixels, np.array(queries, QUERY), search, lines, sides, places)
        found: list[RefinedLine | None] = []
        records: list[Any] = lines.tolist()
        ends_px = denormalise(lines["segment"], picture.intrinsics)
        for k, record in enumerate(records):
            alive, rho, theta, covariance, segment, (first, last), share, count, rms, length, step = record
            if not alive or abs(rho) > config.rho_max:
                found.append(None)
                continue
            beside = (sides[k, :, :count], places[k, :count]) if contents else ()
            ends = ENDS[first], ENDS[last]
            found.append(
                RefinedLine(rho, theta, covariance, segment, ends, share, rms, length, step, ends_px[k], *beside)
            )
        return found

    def fit_segments(
        self,
        picture: Picture,
        segments: np.ndarray,
        beyond: np.ndarray,
        contents: bool = False,
        half_width_px: float = _REFINE_PX,
    ) -> list[RefinedLine | None]:
        """Sub-pixel fits of segments (u1, v1, u2, v2) [px], (n, 4), None where nothing supports one.

        The brighter side, by the channel that changes most, lies to the left of the way. Each is fitted beyond its ends
        by a fraction of its length, (n,), in a strip of a half width [px at 640]; contents as in `fit_lines`.
        """
        fx, fy, cx, cy = picture.intrinsics
        x, y = normalise(segments.reshape(-1, 2, 2), picture.intrinsics).transpose(2, 1, 0)
        across, down = y[0] - y[1], x[1] - x[0]
        rho, theta = (across * x[0] + down * y[0]) / np.hypot(across, down), np.arctan2(down, across)
        queries = []
        for ends, share, *line in zip(*(each.tolist() for each in (segments, beyond, rho, theta)), strict=True):
            (u1, v1, u2, v2), upright = ends, abs(math.cos(line[1])) > abs(math.sin(line[1]))
            low, high = sorted(((v1 - cy) / fy, (v2 - cy) / fy) if upright else ((u1 - cx) / fx, (u2 - cx) / fx))
            span = low - share * (high - low), high + share * (high - low)
            queries.append(self.query(*line, polarity=_DARKER, span=span))
        width, batches = half_width_px * picture.scale, range(0, len(queries), _BATCH)
        fits = [self.fit_lines(picture, queries[start : start + _BATCH], width, contents) for start in batches]
        return [line for batch in fits for line in batch]
