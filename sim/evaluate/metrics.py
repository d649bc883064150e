"""M of the contract: the figures of one flight and of its rows, from its trace alone, and their table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sim.evaluate.figures import FIGURES, Figure, figures_of
from sim.evaluate.part import Part
from sim.evaluate.table import terminal_table
from sim.flight.trace import Trace, law_name

if TYPE_CHECKING:
    from rich.table import Table


def compute_metrics(trace: Trace) -> dict[str, Any]:
    """Compute M of the contract.

    Args:
        trace: One flight, complete or not.

    Returns:
        The figures by name, and those of every row flown under ``rows``; a figure without data is NaN.
    """
    whole = Part.whole(trace)
    return figures_of(whole) | {"rows": [{"row": row.row, **figures_of(row)} for row in whole.rows()]}


#: Lines of the table.
LINES = tuple(figure for figure in FIGURES.values() if figure.shown and figure.of is not None)


def figure_table(metrics: dict[str, dict[str, Any]]) -> Table:
    """Side-by-side table for the terminal."""
    headings = ("figure", *(law_name(law) for law in metrics), "unit")
    rows = [(each.words, *(shown(each, figures) for figures in metrics.values()), each.unit) for each in LINES]
    return terminal_table(headings, rows, text=("figure", "unit"), wrap=headings[1:-1])


def shown(figure: Figure, metrics: dict[str, Any]) -> str:
    """A figure of M as text; a claim that differs from the truth is marked."""
    text = figure.show(metrics)
    return f"{text} (FALSE CLAIM)" if figure.name == "claimed" and metrics["claimed"] != metrics["completed"] else text


def false_claims(metrics: dict[str, dict[str, Any]]) -> list[str]:
    """A line for every law whose pilot's claim and the truth differ."""
    lines = []
    for law, figures in metrics.items():
        words = f"claimed as completed, but {figures['not_completed']}"
        if figures["completed"]:
            words = f"completed, but not claimed by the pilot ({figures['reason']})"
        if figures["claimed"] != figures["completed"]:
            lines.append(f"{law_name(law)}: {words}")
    return lines
