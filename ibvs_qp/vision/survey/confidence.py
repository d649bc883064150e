"""From the evidence for a line to the share of such lines that are right."""

from __future__ import annotations

from ibvs_qp.vision.refined import RefinedLine
from ibvs_qp.vision.survey.border import Borders


def line_confidence(borders: Borders, index: int, fit: RefinedLine) -> float:
    """Placeholder."""
    return float(borders.score[index]) * fit.inlier_share
