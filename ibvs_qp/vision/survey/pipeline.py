"""One picture of any camera and a seed in, plane and guides out. Start reading here."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.checks import frame_problem
from ibvs_qp.vision.colors import SurfaceColors
from ibvs_qp.vision.grid import CoarseGrid
from ibvs_qp.vision.picture import Picture
from ibvs_qp.vision.plane import PlaneFitter
from ibvs_qp.vision.survey.config import SurveyConfig
from ibvs_qp.vision.survey.detection import DetectedLine, Detection
from ibvs_qp.vision.survey.ego_motion import surface_motion
from ibvs_qp.vision.survey.find_surface import find_surface, follow_surface
from ibvs_qp.vision.survey.follow import LineFollower
from ibvs_qp.vision.survey.guides import choose_guides
from ibvs_qp.vision.survey.judge import find_lines, judge_lines
from ibvs_qp.vision.survey.look import SurfaceLook
from ibvs_qp.vision.survey.outline_lines import half_resolution
from ibvs_qp.vision.survey.whole_picture import every_line

#: Reason given where the caller names no place on the surface.
NO_SEED = "no seed pixel: which surface is meant is not known"

Seed = tuple[float, float]


@dataclass(frozen=True)
class _Before:
    """What the next picture of a sequence needs of this one."""

    key: tuple
    grey: np.ndarray
    look: SurfaceLook


class SurveyPipeline:
    """Finds a surface and its edges in pictures of any RGB-D camera, alone or in a motion sequence.

    Unlike `Perception` it knows neither gravity nor gyro nor vehicle: it looks for lines of every angle around the
    surface, asks depth and colour on both sides of each whether the surface ends there, and tells its own motion from
    points of the surface.
    """

    def __init__(self, config: SurveyConfig | None = None) -> None:
        """Take the settings."""
        self.config = SurveyConfig() if config is None else config
        self.reset()

    def reset(self) -> None:
        """Forget the sequence: the next picture stands alone."""
        self._before: _Before | None = None
        self._lines = LineFollower(self.config)
        self._since_detection = 0

    def detect(self, frame: RgbdFrame, seed_pixel: Seed | None) -> Detection:
        """Find the surface through a seed and its guides in a picture that stands alone.

        Args:
            frame: Colour and depth.
            seed_pixel: (u, v) of a place on the surface [px], or None if unknown.

        Returns:
            Plane, candidates and guides, or the reason why there is none; never raises on a bad picture.
        """
        started = time.perf_counter()
        found = self._surface(frame, seed_pixel)
        if isinstance(found, str):
            return Detection(refused=found, time_ms=_since(started))
        picture, look = found
        lines = find_lines(picture, frame.depth, look, self._colors(), self.config)
        lines = tuple(replace(line, line_id=number) for number, line in enumerate(lines, 1))
        return Detection(
            plane=look.plane, candidates=lines, guides=choose_guides(lines, self.config), time_ms=_since(started)
        )

    def follow(self, frame: RgbdFrame, seed_pixel: Seed | None) -> Detection:
        """The same for the next picture of a motion sequence: lines keep their identity, guides do not flicker.

        Args:
            frame: Colour and depth.
            seed_pixel: As for `detect`; without one nothing is reported, and the sequence starts anew.

        Returns:
            As `detect`; `tracked` tells whether the picture continued a sequence.
        """
        started = time.perf_counter()
        problem = frame_problem(frame) or (NO_SEED if seed_pixel is None else None)
        if problem is not None or seed_pixel is None:
            self.reset()
            return Detection(refused=problem, time_ms=_since(started))
        picture, grid = self._layout(frame)
        grey, factor = half_resolution(picture)
        key = (frame.rgb.shape, tuple(frame.intrinsics))
        before = self._before if self._before is not None and self._before.key == key else None
        if before is None:
            self.reset()
        motion = None if before is None else surface_motion(before.grey, grey, factor, before.look, frame.intrinsics)
        look: SurfaceLook | str = "not followed"
        if before is not None:
            look = follow_surface(frame, grid, PlaneFitter(self.config.plane), self.config.plane, before.look, motion)
        if isinstance(look, str):
            look = self._search(frame, grid, seed_pixel)
        if isinstance(look, str):
            self.reset()
            return Detection(refused=look, time_ms=_since(started))
        colors = self._colors()
        if before is not None:
            queries = self._lines.queries(motion, before.look.plane.inverse_depth, picture)
            fits = self._lines.refit(picture, queries, motion is not None, colors)
            judged = iter(judge_lines([fit for fit in fits if fit is not None], picture, frame.depth, look))
            self._lines.update([None if fit is None else next(judged) for fit in fits], picture)
        self._since_detection += 1
        if before is None or self._lines.contested or self._since_detection >= self.config.detect_period:
            self._since_detection = 0
            self._lines.offer(find_lines(picture, frame.depth, look, colors, self.config), picture)
        self._before = _Before(key, grey, look)
        guides = self._lines.guides()
        lines = tuple(sorted((entry.line for entry in self._lines.lines), key=lambda line: -line.score))
        return Detection(
            plane=look.plane, candidates=lines, guides=guides, tracked=before is not None, time_ms=_since(started)
        )

    def every_line(self, frame: RgbdFrame) -> tuple[DetectedLine, ...]:
        """All straight lines of a picture, on a surface or not, longest first; none for a picture that is refused."""
        return () if frame_problem(frame) else every_line(frame, self.config.line)

    def _surface(self, frame: RgbdFrame, seed_pixel: Seed | None) -> tuple[Picture, SurfaceLook] | str:
        problem = frame_problem(frame)
        if problem is not None or seed_pixel is None:
            return problem or NO_SEED
        picture, grid = self._layout(frame)
        look = self._search(frame, grid, seed_pixel)
        return look if isinstance(look, str) else (picture, look)

    def _search(self, frame: RgbdFrame, grid: CoarseGrid, seed_pixel: Seed) -> SurfaceLook | str:
        return find_surface(frame, grid, PlaneFitter(self.config.plane), self.config.plane, seed_pixel, self._colors())

    def _layout(self, frame: RgbdFrame) -> tuple[Picture, CoarseGrid]:
        shape = (frame.rgb.shape[0], frame.rgb.shape[1])
        mask = np.zeros(shape, np.uint8)
        grid = CoarseGrid(shape, frame.intrinsics, mask, self.config.plane.grid_columns)
        return Picture.of(frame.rgb, mask, frame.intrinsics), grid

    def _colors(self) -> SurfaceColors:
        return SurfaceColors(None, None, self.config.line.color_gate)


def _since(started: float) -> float:
    return 1e3 * (time.perf_counter() - started)
