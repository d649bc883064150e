"""docs/metrics.md is the registry of figures, to the letter, and the registry is complete."""

from __future__ import annotations

from pathlib import Path

import pytest

from sim.evaluate.figures import FIGURES, MATTERS
from sim.report.metrics_page import metrics_page

PAGE = Path(__file__).parents[3] / "docs" / "metrics.md"


def test_the_page_is_the_registry():
    assert PAGE.read_text(encoding="utf-8") == metrics_page()


@pytest.mark.parametrize("figure", FIGURES.values(), ids=list(FIGURES))
def test_every_figure_is_complete(figure):
    assert figure.words and figure.better in (-1, 0, 1)
    assert figure.about.endswith(".") or figure.of is None
    assert figure.shown or figure.about or figure.of is None
    if figure.better and figure.unit and not figure.timing:
        assert figure.unit in MATTERS and figure.least[0] > 0.0 and figure.least[1]
