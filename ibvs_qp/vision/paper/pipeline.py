"""The paper's vision, one picture at a time: normal image, bounding box, Canny and Hough, slope threshold, choice.

The named baseline of the own perception: the paper's logic without changes, its arithmetic vectorised and its
buffers allocated once per picture size.
"""

from __future__ import annotations

import cv2
import numpy as np

from ibvs_qp.measurement import RgbdFrame
from ibvs_qp.vision.checks import StageClock, frame_problem
from ibvs_qp.vision.paper.box import BoxSearch, SurfaceBox
from ibvs_qp.vision.paper.choose import first, topmost
from ibvs_qp.vision.paper.config import PaperConfig
from ibvs_qp.vision.paper.normals import NormalImage
from ibvs_qp.vision.paper.result import PaperDetection, candidate, plane_of
from ibvs_qp.vision.paper.segments import SegmentFinder

#: Columns of the coarse grid on which the surface is shown, as in the own perception.
_GRID_COLUMNS = 80


class PaperPipeline:
    """Lines and surface of single pictures; nothing is remembered but buffers.

    Args:
        config: Settings; the default is the paper's.
        mask: The vehicle's own parts, uint8 (H, W), non-zero where it hides the view, or None for a bare camera.
            The paper does not mention them; without the mask the arm's outline is a line like any other.
    """

    def __init__(self, config: PaperConfig | None = None, mask: np.ndarray | None = None) -> None:
        self.config = config or PaperConfig()
        self._mask = mask
        self._key: tuple | None = None

    def detect(self, frame: RgbdFrame, seed_pixel: tuple[float, float], *others: tuple[float, float]) -> PaperDetection:
        """See one picture; never raises on data, a picture that cannot be used is refused with a reason.

        Args:
            frame: Colour, depth and intrinsics.
            seed_pixel: (u, v) of a place on the surface [px].
            *others: Places tried in turn where there is no surface at the ones before.

        Returns:
            Surface, candidates, the two chosen lines and times.
        """
        problem = frame_problem(frame)
        if problem is not None:
            return PaperDetection(refused=problem)
        clock = StageClock()
        self._allocate(frame)
        self._normals.update(frame.depth)
        clock.lap("normals")
        box: SurfaceBox | str = ""
        for seed in (seed_pixel, *others):
            box = self._search.search(seed)
            if not isinstance(box, str):
                break
        clock.lap("box")
        return (
            PaperDetection(refused=box, time_ms=clock.times) if isinstance(box, str) else self._lines(frame, box, clock)
        )

    def _lines(self, frame: RgbdFrame, box: SurfaceBox, clock: StageClock) -> PaperDetection:
        config, (height, width) = self.config, frame.depth.shape
        scale = width / 640.0
        margin = config.margin_px * scale
        around = (box.left - margin, box.top - margin, box.right + margin, box.bottom + margin)
        segments = self._finder.find(frame.rgb, around)
        clock.lap("canny_hough")
        sigma = config.end_sigma_px * scale
        lines = [
            [candidate(ends, upright, box, frame.intrinsics, width, sigma, 2.0 * margin) for ends in group]
            for upright, group in ((False, segments.level), (True, segments.upright))
        ]
        level, upright = topmost(segments.level, scale), first(segments.upright, scale)
        plane = plane_of(box, (height, width), _GRID_COLUMNS)
        clock.lap("select")
        return PaperDetection(
            plane=plane,
            candidates=tuple(sorted(lines[0] + lines[1], key=lambda entry: -entry.line.length_px)),
            horizontal=None if level is None else lines[0][level],
            vertical=None if upright is None else lines[1][upright],
            box=box,
            time_ms=clock.times,
        )

    def _allocate(self, frame: RgbdFrame) -> None:
        """Make the buffers for pictures of this size and camera."""
        shape = (frame.depth.shape[0], frame.depth.shape[1])
        key = (shape, tuple(frame.intrinsics))
        if key == self._key:
            return
        mask = self._mask if self._mask is not None and self._mask.shape == shape else None
        self._normals = NormalImage(shape, frame.intrinsics, self.config)
        self._search = BoxSearch(self._normals, self._visible(mask), self.config)
        self._finder = SegmentFinder(shape, mask, self.config)
        self._key = key

    def _visible(self, mask: np.ndarray | None) -> np.ndarray:
        """Normals that no part of the vehicle has touched, the filter's window included."""
        normals = self._normals
        if mask is None:
            return np.ones(normals.shape, bool)
        window = np.ones((normals.support, normals.support), np.uint8)
        hidden = cv2.dilate(np.ascontiguousarray(mask[:: normals.stride, :: normals.stride]), window)
        return np.ascontiguousarray(hidden == 0)
