"""Straight lines near the end of the surface, found at half resolution and fitted at full resolution."""

from __future__ import annotations

import math

import cv2
import numpy as np

from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.config import LineConfig
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.lines import refine_lines
from ibvs_qp.vision.picture import Picture, normalised_line
from ibvs_qp.vision.query import LineQuery
from ibvs_qp.vision.refined import RefinedLine
from ibvs_qp.vision.survey.segments import find_segments

#: Half width of the strip in which a segment is fitted [px at 640].
_REFINE_PX = 4.0
#: A segment is fitted beyond its ends by this share of its length: detectors stop short.
FIT_BEYOND = 0.15
#: Segments fitted in one batch: those of a batch share the number of profiles.
_BATCH = 8
#: Distance at which the change of brightness across a segment is read [px].
_ACROSS_PX = 2.0


def half_resolution(picture: Picture) -> tuple[np.ndarray, float]:
    """Brightness at half resolution (full for small pictures), uint8, and the factor back to the picture's pixels."""
    grey = cv2.cvtColor(picture.rgb, cv2.COLOR_RGB2GRAY)
    if picture.scale < 0.9:
        return grey, 1.0
    height, width = grey.shape
    return cv2.resize(grey, (width // 2, height // 2), interpolation=cv2.INTER_AREA), 2.0


def outline_segments(picture: Picture, grid: CoarseGrid, band: np.ndarray) -> np.ndarray:
    """Segments that run along marked samples, bool (rows, columns), for at least half their length, (n, 4) [px]."""
    small, factor = half_resolution(picture)
    shift = 0.5 * (factor - 1.0)  # pixel centres
    share = np.linspace(0.05, 0.95, 12)[:, None, None]

    def along_band(pieces: np.ndarray) -> np.ndarray:
        places = factor * (pieces[:, :2] + share * (pieces[:, 2:] - pieces[:, :2])) + shift
        cells = np.rint((places - grid.offset) / grid.stride).astype(np.intp)
        rows = np.minimum(np.maximum(cells[..., 1], 0), grid.shape[0] - 1)
        columns = np.minimum(np.maximum(cells[..., 0], 0), grid.shape[1] - 1)
        return band[rows, columns].mean(axis=0) >= 0.5

    return find_segments(small, picture.scale / factor, along_band) * factor + shift


def fit_segments(
    segments: np.ndarray,
    picture: Picture,
    config: LineConfig,
    colors: SurfaceColors,
    beyond: np.ndarray | None = None,
) -> list[RefinedLine | None]:
    """Sub-pixel fits of segments.

    Args:
        segments: End points (u1, v1, u2, v2) [px], (n, 4).
        picture: Colour and camera.
        config: Settings of the fit.
        colors: Of the surface.
        beyond: Share of its length by which each is fitted beyond its ends, (n,); `FIT_BEYOND` unless given.

    Returns:
        One fit for every segment, None where nothing supports one.
    """
    shares = np.full(len(segments), FIT_BEYOND) if beyond is None else beyond
    fits: list[RefinedLine | None] = []
    queries = [_query(segment, picture, share) for segment, share in zip(segments, shares.tolist(), strict=True)]
    for start in range(0, len(queries), _BATCH):
        fits += refine_lines(
            picture,
            queries[start : start + _BATCH],
            half_width_px=_REFINE_PX * picture.scale,
            config=config,
            colors=colors,
        )
    return fits


def _query(segment: np.ndarray, picture: Picture, beyond: float) -> LineQuery:
    u1, v1, u2, v2 = segment.tolist()
    fx, fy, cx, cy = picture.intrinsics
    rho, theta = normalised_line(v1 - v2, u2 - u1, u1 * v2 - u2 * v1, picture.intrinsics)
    upright = abs(math.cos(theta)) > abs(math.sin(theta))
    low, high = sorted(((v1 - cy) / fy, (v2 - cy) / fy) if upright else ((u1 - cx) / fx, (u2 - cx) / fx))
    more = beyond * (high - low)
    return LineQuery(rho=rho, theta=theta, polarity=_polarity(segment, theta, picture), span=(low - more, high + more))


def _polarity(segment: np.ndarray, theta: float, picture: Picture) -> int:
    """+1 or -1 if the picture gets brighter or darker along the normal."""
    height, width = picture.mask.shape
    share = np.linspace(0.1, 0.9, 17)[:, None]
    places = segment[:2] + share * (segment[2:] - segment[:2])
    normal = _ACROSS_PX * picture.scale * np.array([math.cos(theta), math.sin(theta)])
    change = 0
    for sign in (-1, 1):
        at = np.round(places + sign * normal).astype(np.intp)
        u, v = np.clip(at[:, 0], 0, width - 1), np.clip(at[:, 1], 0, height - 1)
        change = change + sign * picture.rgb[v, u].astype(int).sum()
    return 1 if change >= 0 else -1
