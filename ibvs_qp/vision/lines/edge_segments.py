"""Straight edges of a picture, found at half resolution and fitted at full resolution."""

from __future__ import annotations

import math

import cv2
import numpy as np

from ibvs_qp.vision.appearance.colors import SurfaceColors
from ibvs_qp.vision.config import REFERENCE_WIDTH, LineConfig
from ibvs_qp.vision.kernels.segments import SEGMENT, find_segments
from ibvs_qp.vision.lines.query import LineQuery
from ibvs_qp.vision.lines.refine_lines import refine_lines
from ibvs_qp.vision.lines.refined import RefinedLine
from ibvs_qp.vision.picture.grid import CoarseGrid
from ibvs_qp.vision.picture.mask import Intrinsics
from ibvs_qp.vision.picture.picture import Picture, normalise

#: Pictures of less than this scale are searched at full resolution.
_SMALL = 0.9
#: Weakest gradient of an edge, over two pixels [grey levels], shortest segment [px at 640], and most of them.
_GRADIENT, _SHORTEST_PX, _MOST = 6.0, 20.0, 60
#: Half width of the strip in which a segment is fitted [px at 640].
_REFINE_PX = 4.0
#: A segment is fitted beyond its ends by this share of its length: detectors stop short.
FIT_BEYOND = 0.15
#: Segments fitted in one batch: those of a batch share the number of profiles.
_BATCH = 8
#: Polarity of a segment along the normal of its line, which points to the right of the way from end to end.
_DARKER = -1


def half_resolution(rgb: np.ndarray) -> tuple[np.ndarray, int]:
    """Picture at half resolution (a small one as it is), uint8 (h, w, 3), and the factor back to its pixels."""
    height, width = rgb.shape[:2]
    if max(height, width) < _SMALL * REFERENCE_WIDTH:
        return rgb, 1
    even = rgb[: height // 2 * 2, : width // 2 * 2]  # the factor must be exact
    return cv2.resize(even, (width // 2, height // 2), interpolation=cv2.INTER_AREA), 2


def edge_segments(
    picture: Picture, grid: CoarseGrid, region: np.ndarray, tilt: float | None, within_deg: float
) -> np.ndarray:
    """Straight edges in marked samples, longest first.

    Args:
        picture: Colour and mask.
        grid: Where the samples lie.
        region: The marked ones, bool (rows, columns).
        tilt: Angle of gravity in the picture from down [rad], None if unknown.
        within_deg: With a tilt, edges this near to level and upright are looked for [deg].

    Returns:
        End points u1, v1, u2, v2 [px], the brighter side to the left of the way, (n, 4).
    """
    small, factor = half_resolution(picture.rgb)
    found = np.empty((_MOST, SEGMENT))
    count = find_segments(
        small,
        picture.mask,
        factor,
        np.ascontiguousarray(region).view(np.uint8),
        grid.stride,
        _GRADIENT,
        _SHORTEST_PX * picture.scale / factor,
        math.nan if tilt is None else tilt,
        float(within_deg),
        found,
    )
    ends = found[:count, :4] * factor + 0.5 * (factor - 1)  # pixel centres
    return ends[np.argsort(-np.hypot(ends[:, 2] - ends[:, 0], ends[:, 3] - ends[:, 1]), kind="stable")]


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
        beyond: Share of its length by which each is fitted beyond its ends, (n,); `FIT_BEYOND` unless given.
        contents: Whether the colours of both sides are wanted.
        half_width_px: Half width of the strips; 4 px at 640 unless given.

    Returns:
        One fit for every segment, None where nothing supports one.
    """
    shares = np.full(len(segments), FIT_BEYOND) if beyond is None else beyond
    fits: list[RefinedLine | None] = []
    lines = _normalised_lines(segments, picture.intrinsics)
    found = zip(segments.tolist(), *lines, shares.tolist(), strict=True)
    queries = [_query(*entry, picture) for entry in found]
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


def _query(ends: list[float], rho: float, theta: float, beyond: float, picture: Picture) -> LineQuery:
    fx, fy, cx, cy = picture.intrinsics
    u1, v1, u2, v2 = ends
    upright = abs(math.cos(theta)) > abs(math.sin(theta))
    low, high = sorted(((v1 - cy) / fy, (v2 - cy) / fy) if upright else ((u1 - cx) / fx, (u2 - cx) / fx))
    more = beyond * (high - low)
    return LineQuery(rho=rho, theta=theta, polarity=_DARKER, span=(low - more, high + more))


def _normalised_lines(segments: np.ndarray, intrinsics: Intrinsics) -> tuple[list[float], list[float]]:
    """Distances and angles of the lines through segments (n, 4) [px]."""
    x, y = normalise(segments.reshape(-1, 2, 2), intrinsics).transpose(2, 1, 0)
    across, down = y[0] - y[1], x[1] - x[0]
    rho = (across * x[0] + down * y[0]) / np.hypot(across, down)
    return rho.tolist(), np.arctan2(down, across).tolist()
