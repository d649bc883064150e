"""The table of docs/sensors.md is that of the channels."""

from __future__ import annotations

from pathlib import Path

from sim.report.sensor_page import put_into

PAGE = Path(__file__).parents[3] / "docs" / "sensors.md"


def test_the_table_of_the_page_is_that_of_the_channels() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert put_into(text) == text, "python -m sim.report.sensor_page docs/sensors.md"
