"""Limits of a recorded tick for a person: who bound and what it cost, and who contradicts whom."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ibvs_qp.qp.explain import Explanation, LimitValue

#: A bound farther away than this in its unit is none: rows that do not limit now are this wide.
_NO_BOUND = 9e3


def table_of(title: str, words: tuple[str, ...], numbers: tuple[str, ...], last: tuple[str, ...] = ()) -> Any:
    """An empty table: columns of words, numbers, and words again."""
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    for column in (*words, *numbers, *last):
        table.add_column(column, justify="right" if column in numbers else "left", no_wrap=True)
    return table


def limit_parts(explanation: Explanation) -> list[Any]:
    """Limits that bound, dearest first, and what was paid for slack."""
    if not explanation.active_limits:
        return ["No limit is active: the thrusts are the weighted least-squares law."]
    columns = ("limit", "side"), ("bound", "does", "slack"), ("unit",)
    table = table_of("Active limits, dearest first", *columns)
    table.add_column("price per unit", justify="right", no_wrap=True)
    table.add_column("cost of slack", justify="right", no_wrap=True)
    told = zip(explanation.active_limits, explanation.limit_rows, explanation.limit_cost, strict=True)
    for limit, row, share in told:
        bound = row.upper if limit.side == "upper" else row.lower
        paid = f"{share * explanation.total_cost:.3g} ({share_of(share)})" if limit.slack > 0.0 else "hard"
        slack = f"{limit.slack:.4g}" if limit.slack > 0.0 else ""
        table.add_row(
            limit.name, limit.side, _number(bound), _number(row.value), slack, limit.unit, _number(limit.price), paid
        )
    words = "Price: what the tick would cost less if the bound gave way by one unit. "
    if explanation.slack_cost > 0.0:
        words += f"Slack takes {share_of(explanation.slack_cost)} of the tick's cost of {explanation.total_cost:.3g}. "
    return [table, words + "Cost has no unit: weights, and prices of slack, are per squared unit of the row."]


def conflict_parts(rows: tuple[LimitValue, ...]) -> list[Any]:
    """The hard rows that no thrusts keep together, and what flew instead."""
    words = (
        f"[bold]No thrusts keep these {len(rows)} hard limits together[/]; without any one of them there are some. "
        "The analytic law answered, clipped to the rotors' limits."
    )
    table = table_of("Limits in conflict", ("limit",), ("from", "to", "flown", "missed by"), ("unit",))
    for row in rows:
        missed = max(row.lower - row.value, row.value - row.upper)
        told = f"{missed:.4g}" if missed > 1e-6 else "kept"
        table.add_row(row.name, _number(row.lower), _number(row.upper), _number(row.value), told, row.unit)
    advice = "With limits.hard_barriers = false the barriers give way at their prices, and there is always a solution."
    return [words, table, advice]


def share_of(value: float) -> str:
    """A share as a person reads it."""
    return "<1%" if 0.0 < value < 0.005 else f"{value:.0%}"


def _number(value: float) -> str:
    return "none" if abs(value) > _NO_BOUND else f"{value:.4g}"
