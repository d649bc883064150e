"""The four guides of a surface: of the lines around it, the one that ends it on each side."""

from __future__ import annotations

import math

import numpy as np

from ibvs_qp.vision.survey.config import SurveyConfig
from ibvs_qp.vision.survey.detection import GUIDE_SIDES, DetectedLine, no_guides

#: Direction from a guide towards the surface, in the picture (right, down).
_INWARD = {"top": (0.0, 1.0), "bottom": (0.0, -1.0), "left": (1.0, 0.0), "right": (-1.0, 0.0)}


def guide_side(line: DetectedLine, config: SurveyConfig) -> str | None:
    """Which guide a line could be, by the direction in which the surface lies from it; None if it is too slanted."""
    if line.surface_side == 0:
        return None
    x, y = line.surface_side * math.cos(line.theta), line.surface_side * math.sin(line.theta)
    limit = math.cos(math.radians(config.role_deg))
    return next((side for side in GUIDE_SIDES if x * _INWARD[side][0] + y * _INWARD[side][1] > limit), None)


def choose_guides(lines: tuple[DetectedLine, ...], config: SurveyConfig) -> dict[str, DetectedLine | None]:
    """The best line of every side, where one is good enough."""
    guides = no_guides()
    for line in sorted(lines, key=lambda entry: -entry.score):
        side = guide_side(line, config)
        if side is not None and guides[side] is None and line.borders_plane and line.score >= config.guide_score_min:
            guides[side] = line
    return guides


def same_edge(one: DetectedLine, two: DetectedLine, limit_px: float) -> bool:
    """Whether two lines run along one edge where they overlap."""
    run = two.pixels[1] - two.pixels[0]
    length = float(np.hypot(*run))
    normal = np.array([-run[1], run[0]]) / length
    if np.abs((one.pixels - two.pixels[0]) @ normal).max() > limit_px:
        return False
    along = np.sort((one.pixels - two.pixels[0]) @ run / length)
    return bool(along[1] > 0.0 and along[0] < length)
