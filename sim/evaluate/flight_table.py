"""The table of a flight: every shown figure under each law, and the warning of a false claim."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sim.evaluate.figures import FIGURES
from sim.evaluate.table import terminal_table
from sim.flight.trace import law_name

if TYPE_CHECKING:
    from rich.table import Table

#: Lines of the table.
LINES = tuple(figure for figure in FIGURES.values() if figure.shown and figure.of is not None)


def figure_table(metrics: dict[str, dict[str, Any]]) -> Table:
    """Side-by-side table for the terminal."""
    headings = ("figure", *(law_name(law) for law in metrics), "unit")
    rows = [(each.words, *(each.show(figures) for figures in metrics.values()), each.unit) for each in LINES]
    return terminal_table(headings, rows, text=("figure", "unit"), wrap=headings[1:-1])


def false_claims(metrics: dict[str, dict[str, Any]]) -> list[str]:
    """A line for every law whose pilot's claim and the truth differ."""
    return [
        f"{law_name(law)}: {claim_words(figures)}"
        for law, figures in metrics.items()
        if figures["claimed"] != figures["completed"]
    ]


def claim_words(figures: dict[str, Any]) -> str:
    """How claim and truth differ."""
    if figures["claimed"]:
        return f"claimed as completed, but {figures['not_completed']}"
    return f"completed, but not claimed by the pilot ({figures['reason']})"
