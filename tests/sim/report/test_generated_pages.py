"""Generated pages of docs are current, and what they are made of is complete."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import pytest

from ibvs_qp.config import SafetySettings
from ibvs_qp.supervision.faults import POLICY, Fault
from sim.evaluate.figures import FIGURES, MATTERS, Figure
from sim.report import assurance_page, sensor_page
from sim.report.metrics_page import metrics_page
from sim.report.settings_page import settings_page

DOCS = Path(__file__).parents[3] / "docs"
#: Text of each page as its command writes it, from the page as it is.
WRITTEN: dict[str, Callable[[str], str]] = {
    "metrics": lambda _: metrics_page(),
    "safety": assurance_page.put_into,
    "sensors": sensor_page.put_into,
    "settings": lambda _: settings_page(),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_the_page_is_current(name: str) -> None:
    text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    assert WRITTEN[name](text) == text, "see docs/development.md, generated pages"


def test_the_settings_have_unit_and_range() -> None:
    assert "| `link_timeout_s` | `0.1` | s | from 0.02 to 0.45 |" in settings_page() and "nan" not in settings_page()


def test_every_fault_has_a_rule_and_every_bound_is_a_setting() -> None:
    assert set(POLICY) == set(Fault) and all(f"\n| {fault} | " in assurance_page.policy_table() for fault in Fault)
    names = {field.name for field in dataclasses.fields(SafetySettings)}
    assert {name for rule in POLICY.values() for name in rule.bounds} <= names


@pytest.mark.parametrize("figure", FIGURES.values(), ids=list(FIGURES))
def test_every_figure_is_complete(figure: Figure) -> None:
    assert figure.words and figure.better in (-1, 0, 1)
    assert figure.about.endswith(".")
    if figure.better and figure.unit and not figure.timing:
        assert figure.unit in MATTERS and figure.least[0] > 0.0 and figure.least[1]
