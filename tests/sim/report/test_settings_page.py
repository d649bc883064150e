"""The page of the settings is that of their declarations."""

from __future__ import annotations

from pathlib import Path

from sim.report.settings_page import settings_page

PAGE = Path(__file__).parents[3] / "docs" / "settings.md"


def test_the_page_is_that_of_the_declarations() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert settings_page() == text, "python -m sim.report.settings_page > docs/settings.md"
    assert "| `link_timeout_s` | `0.1` | s | from 0.02 to 0.45 |" in text and "nan" not in text
