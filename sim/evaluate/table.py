"""Tables for the terminal and in Markdown, and the figures of merit that they show with their units and digits."""

from __future__ import annotations

import math
from collections.abc import Collection, Container, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sim.flight.trace import law_name

if TYPE_CHECKING:
    import numpy as np
    import polars as pl
    from rich.table import Table


@dataclass(frozen=True)
class Figure:
    """A figure of merit: a column of a table of flights, and its form in figures and reports."""

    column: str  # name of the column
    words: str  # in words
    scale: float = 1.0  # factor from the column's unit to the reported one
    unit: str = ""  # reported unit
    more_is_better: bool = False  # whether larger values are better

    @property
    def label(self) -> str:
        """Words with unit."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words

    def values(self, table: pl.DataFrame) -> np.ndarray:
        """Figure of every row in the reported unit, NaN where there is none, (rows,)."""
        import polars as pl

        return self.scale * table[self.column].cast(pl.Float64).fill_null(math.nan).to_numpy()


@dataclass(frozen=True, kw_only=True)
class Line:
    """One line of the table: a figure of M in a readable unit."""

    key: str
    label: str
    unit: str = ""
    scale: float = 1.0
    digits: int = 2

    def show(self, metrics: dict[str, Any]) -> str:
        """The figure as text; a dash if it is missing."""
        value: Any = metrics
        for part in self.key.split("."):
            value = value.get(part) if isinstance(value, dict) else None
        if isinstance(value, bool):
            return "yes" if value else "no"
        if value is None or (isinstance(value, float) and not math.isfinite(value)):
            return "–"
        if isinstance(value, str):
            return value
        return f"{value * self.scale:.{self.digits}f}"


LINES = (
    Line(key="completed", label="completed"),
    Line(key="reason", label="ended because"),
    Line(key="duration_s", label="flight time", unit="s", digits=1),
    Line(key="real_time_factor", label="real-time factor", unit="×", digits=1),
    Line(key="stroke_m", label="shortest stroke", unit="m"),
    Line(key="coverage", label="coverage of the intended band", unit="%", scale=100, digits=1),
    Line(key="path_rms_straight_m", label="path error, straights, rms", unit="mm", scale=1e3),
    Line(key="path_rms_corner_m", label="path error, corners, rms", unit="mm", scale=1e3),
    Line(key="path_max_m", label="path error, largest", unit="mm", scale=1e3),
    Line(key="height_error_rms_m", label="height error, rms", unit="mm", scale=1e3),
    Line(key="force_rms_straight_n", label="push error, straights, rms", unit="N", digits=3),
    Line(key="force_rms_corner_n", label="push error, corners, rms", unit="N", digits=3),
    Line(key="force_peak_n", label="push, peak of the flight", unit="N"),
    Line(key="contact_share", label="contact while painting", unit="%", scale=100, digits=2),
    Line(key="first_touch_s", label="first touch at", unit="s"),
    Line(key="settle_s", label="push settled after", unit="s"),
    Line(key="bounces", label="bounces", digits=0),
    Line(key="tilt_rms_deg", label="tilt, rms", unit="deg"),
    Line(key="tilt_peak_deg", label="tilt, peak", unit="deg"),
    Line(key="yaw_rms_deg", label="yaw, rms", unit="deg"),
    Line(key="yaw_peak_deg", label="yaw, peak", unit="deg"),
    Line(key="velocity_rms_m_s", label="velocity estimate, error rms", unit="mm/s", scale=1e3, digits=1),
    Line(key="propeller_clearance_min_m", label="propeller clearance, smallest", unit="m", digits=3),
    Line(key="step_us.p50", label="controller step, median", unit="µs", digits=0),
    Line(key="step_us.p99", label="controller step, 99 %", unit="µs", digits=0),
    Line(key="vision_ms.p50", label="vision per picture, median", unit="ms"),
    Line(key="vision_ms.p99", label="vision per picture, 99 %", unit="ms"),
)


def figure_table(metrics: dict[str, dict[str, Any]]) -> Table:
    """Side-by-side table for the terminal."""
    headings = ("figure", *(law_name(law) for law in metrics), "unit")
    rows = [(line.label, *(line.show(figures) for figures in metrics.values()), line.unit) for line in LINES]
    return terminal_table(headings, rows, text=("figure", "unit"), wrap=headings[1:-1])


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]], left: Container[int] | None = None) -> str:
    """A Markdown table that ends with a line break.

    Args:
        heads: Headings of the columns.
        rows: Cells of every row.
        left: Indices of the left-aligned columns, the others are numbers; None leaves the alignment open.
    """
    rule = "".join("---|" if left is None else ":--|" if place in left else "--:|" for place in range(len(heads)))
    lines = ["|" + "|".join(f" {cell} " if cell else " " for cell in line) + "|" for line in (heads, *rows)]
    return "\n".join([lines[0], "|" + rule, *lines[1:]]) + "\n"


def plain(value: object) -> str:
    """A value from a file of unknown origin, without markup and without effect on the terminal."""
    from rich.markup import escape

    text = str(value)
    return escape(text if text.isprintable() else repr(text))


def terminal_table(
    headings: Sequence[str],
    rows: Iterable[Sequence[str]],
    title: str | None = None,
    *,
    text: Collection[str] | None = None,
    wrap: Collection[str] = (),
) -> Table:
    """A table for the terminal. It fits the width: text wraps, numbers stay whole, further columns follow below.

    Args:
        headings: Of the columns; those below each other repeat the first.
        rows: Cells of every row.
        title: Above the table.
        text: Headings of left-aligned columns; default: the first. All others are numbers.
        wrap: Headings of right-aligned columns that are text too.
    """
    from sim.evaluate.fitting_table import FittingTable

    table = FittingTable(title)
    left = headings[:1] if text is None else text
    for heading in headings:
        words = heading in left or heading in wrap
        table.add_column(heading, justify="left" if heading in left else "right", no_wrap=not words)
    for row in rows:
        table.add_row(*row)
    return table
