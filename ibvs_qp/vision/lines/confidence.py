"""From the evidence for a line to the share of such lines that are right."""

from __future__ import annotations

import math

from ibvs_qp.vision.lines.borders import Borders
from ibvs_qp.vision.lines.refined import RefinedLine

#: Logistic regression on candidates of truth frames (families hard, smeared depth, oblique, printed, flush wall; seeds
#: 100 and up): constant, weight of the score, weight of the share along which colour agrees. The constant is lower
#: than fitted by 1.5: a wrong line that is sure does more harm than a right one that is not.
_CONSTANT, _SCORE, _COLOR = -9.5, 11.0, 3.0


def line_confidence(borders: Borders, index: int, fit: RefinedLine) -> float:
    """Share of the lines with such evidence that are an end of the surface, 0..1.

    Args:
        borders: Judged lines.
        index: Which of them.
        fit: Its fit.
    """
    score = float(borders.score[index]) * fit.inlier_share
    return 1.0 / (1.0 + math.exp(-(_CONSTANT + _SCORE * score + _COLOR * float(borders.color[index]))))
