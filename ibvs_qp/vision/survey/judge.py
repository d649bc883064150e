"""Lines around a surface: found, fitted, judged as ends of it."""

from __future__ import annotations

import numpy as np

from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.picture import Picture, denormalise
from ibvs_qp.vision.refined import RefinedLine
from ibvs_qp.vision.survey.border import judge_borders
from ibvs_qp.vision.survey.confidence import line_confidence
from ibvs_qp.vision.survey.config import SurveyConfig
from ibvs_qp.vision.survey.detection import DetectedLine
from ibvs_qp.vision.survey.find_surface import end_band
from ibvs_qp.vision.survey.guides import same_edge
from ibvs_qp.vision.survey.look import SurfaceLook
from ibvs_qp.vision.survey.outline_lines import FIT_BEYOND, fit_segments, outline_segments
from ibvs_qp.vision.survey.trim import trimmed

#: Shortest piece of a segment that is looked at where the surface ends before the segment does [px at 640].
_SHORTEST_PX = 40.0
#: Lines nearer than this are one [px at 640].
_SAME_PX = 2.5
#: Score from which a line is said to border the surface.
_BORDER = 0.2


def find_lines(
    picture: Picture, depth: np.ndarray, look: SurfaceLook, colors: SurfaceColors, config: SurveyConfig
) -> tuple[DetectedLine, ...]:
    """Judged lines around the surface, best first, each edge once."""
    segments = outline_segments(picture, look.grid, end_band(look, config.band_cells))
    if len(segments) == 0:
        return ()
    pieces = trimmed(segments, look, _SHORTEST_PX * picture.scale)
    beyond = np.repeat((FIT_BEYOND, 0.0), (len(segments), len(pieces)))
    segments = np.vstack((segments, pieces))
    pixels = segments.reshape(-1, 2, 2)
    rough = judge_borders(pixels, _normals(pixels), picture, depth, look)
    best = np.sort(np.argsort(-rough.score, kind="stable")[: config.fitted])
    fits = fit_segments(segments[best], picture, config.line, colors, beyond[best])
    lines = judge_lines([fit for fit in fits if fit is not None], picture, depth, look)
    kept: list[DetectedLine] = []
    for line in sorted(lines, key=lambda entry: -entry.score):
        if not any(same_edge(line, other, _SAME_PX * picture.scale) for other in kept):
            kept.append(line)
    return tuple(kept)


def judge_lines(fits: list[RefinedLine], picture: Picture, depth: np.ndarray, look: SurfaceLook) -> list[DetectedLine]:
    """Fitted lines with score and confidence as ends of the surface."""
    if not fits:
        return []
    pixels = np.array([denormalise(fit.segment, picture.intrinsics) for fit in fits])
    normals = _normals(pixels)
    theta = np.array([fit.theta for fit in fits])
    normals *= np.sign(np.vecdot(normals, np.column_stack((np.cos(theta), np.sin(theta)))))[:, None]
    borders = judge_borders(pixels, normals, picture, depth, look)
    return [
        DetectedLine(
            pixels=pixels[k],
            rho=fit.rho,
            theta=fit.theta,
            covariance=fit.covariance,
            score=float(borders.score[k]) * fit.inlier_share,
            confidence=line_confidence(borders, k, fit),
            borders_plane=bool(borders.score[k] > _BORDER),
            surface_side=int(borders.side[k]),
            fit=fit,
        )
        for k, fit in enumerate(fits)
    ]


def _normals(pixels: np.ndarray) -> np.ndarray:
    """Unit vectors across segments (n, 2, 2), (n, 2)."""
    run = pixels[:, 1] - pixels[:, 0]
    return np.column_stack((-run[:, 1], run[:, 0])) / np.hypot(*run.T)[:, None]
