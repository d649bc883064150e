"""One picture of any camera and a seed in, plane and guides out. Start reading here."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.checks import frame_problem
from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.picture import Picture, denormalise
from ibvs_qp.vision.plane import PlaneFitter
from ibvs_qp.vision.refined import RefinedLine
from ibvs_qp.vision.survey.border import judge_borders
from ibvs_qp.vision.survey.confidence import line_confidence
from ibvs_qp.vision.survey.config import SurveyConfig
from ibvs_qp.vision.survey.detection import DetectedLine, Detection
from ibvs_qp.vision.survey.find_surface import end_band, find_surface
from ibvs_qp.vision.survey.guides import choose_guides, same_edge
from ibvs_qp.vision.survey.look import SurfaceLook
from ibvs_qp.vision.survey.outline_lines import fit_segments, outline_segments
from ibvs_qp.vision.survey.whole_picture import every_line

#: Reason given where the caller names no place on the surface.
NO_SEED = "no seed pixel: which surface is meant is not known"
#: Lines nearer than this are one [px at 640].
_SAME_PX = 2.5
#: Score from which a line is said to border the surface.
_BORDER = 0.2


class SurveyPipeline:
    """Finds a surface and its edges in single pictures of any RGB-D camera.

    Unlike `Perception` it knows neither gravity nor vehicle, so it looks for lines of every angle around the surface
    and asks depth and colour on both sides of each whether the surface ends there.
    """

    def __init__(self, config: SurveyConfig | None = None) -> None:
        """Take the settings."""
        self.config = SurveyConfig() if config is None else config

    def detect(self, frame: RgbdFrame, seed_pixel: tuple[float, float] | None) -> Detection:
        """Find the surface through a seed and its guides.

        Args:
            frame: Colour and depth.
            seed_pixel: (u, v) of a place on the surface [px], or None if nobody knows one.

        Returns:
            Plane, candidates and guides, or the reason why there is none; never raises on a bad picture.
        """
        started = time.perf_counter()
        problem = frame_problem(frame) or (NO_SEED if seed_pixel is None else None)
        if problem is not None or seed_pixel is None:
            return Detection(refused=problem, time_ms=1e3 * (time.perf_counter() - started))
        shape = (frame.rgb.shape[0], frame.rgb.shape[1])
        mask = np.zeros(shape, np.uint8)
        grid = CoarseGrid(shape, frame.intrinsics, mask, self.config.plane.grid_columns)
        colors = SurfaceColors(None, None, self.config.line.color_gate)
        look = find_surface(frame, grid, PlaneFitter(self.config.plane), self.config.plane, seed_pixel, colors)
        if isinstance(look, str):
            return Detection(refused=look, time_ms=1e3 * (time.perf_counter() - started))
        picture = Picture.of(frame.rgb, mask, frame.intrinsics)
        lines = self._lines(picture, frame.depth, look, colors)
        lines = tuple(replace(line, line_id=number) for number, line in enumerate(lines, 1))
        return Detection(
            plane=look.plane,
            candidates=lines,
            guides=choose_guides(lines, self.config),
            time_ms=1e3 * (time.perf_counter() - started),
        )

    def every_line(self, frame: RgbdFrame) -> tuple[DetectedLine, ...]:
        """All straight lines of a picture, on a surface or not, longest first; none for a picture that is refused."""
        return () if frame_problem(frame) else every_line(frame, self.config.line)

    def _lines(
        self, picture: Picture, depth: np.ndarray, look: SurfaceLook, colors: SurfaceColors
    ) -> tuple[DetectedLine, ...]:
        """Judged lines around the surface, best first, each edge once."""
        segments = outline_segments(picture, look.grid, end_band(look, self.config.band_cells))
        if len(segments) == 0:
            return ()
        pixels = segments.reshape(-1, 2, 2)
        rough = judge_borders(pixels, _normals(pixels), picture, depth, look)
        best = np.argsort(-rough.score, kind="stable")[: self.config.fitted]
        fits = fit_segments(segments[np.sort(best)], picture, self.config.line, colors)
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
        )
        for k, fit in enumerate(fits)
    ]


def _normals(pixels: np.ndarray) -> np.ndarray:
    """Unit vectors across segments (n, 2, 2), (n, 2)."""
    run = pixels[:, 1] - pixels[:, 0]
    return np.column_stack((-run[:, 1], run[:, 0])) / np.hypot(*run.T)[:, None]
