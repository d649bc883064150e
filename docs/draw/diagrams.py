"""Diagrams of boxes and arrows: a tick, its solvers, the supervisor."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

INK, PAPER, BLUE, ORANGE, GREEN = "#2b2b2b", "#f4f6f8", "#0b6f9e", "#d55e1a", "#3b7a57"


def canvas(width: float, height: float) -> tuple[Figure, Axes]:
    """Empty drawing in units of a tenth of an inch."""
    figure = Figure(figsize=(width / 10, height / 10))
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, width), ylim=(0, height))
    axes.axis("off")
    return figure, axes


def box(axes: Axes, x: float, y: float, text: str, width: float = 13.0, colour: str = INK, height: float = 6.0) -> None:
    """A box around a centre."""
    style = {"boxstyle": "round,pad=0,rounding_size=0.8", "facecolor": PAPER, "edgecolor": colour, "linewidth": 1.3}
    axes.add_patch(FancyBboxPatch((x - width / 2, y - height / 2), width, height, **style))
    axes.text(x, y, text, ha="center", va="center", fontsize=9, color=colour, linespacing=1.25)


def arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], text: str = "", bend: float = 0.0) -> None:
    """An arrow with words beside its middle."""
    arrows = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.1, "connectionstyle": f"arc3,rad={bend}"}
    axes.annotate("", end, start, arrowprops=arrows)
    middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2 + 1.0)
    axes.text(*middle, text, ha="center", va="bottom", fontsize=7.5, color=INK)


def tick() -> Figure:
    """From sensor frame to command."""
    figure, axes = canvas(76, 26)
    top = [("SensorFrame", INK), ("validation", BLUE), ("vision", BLUE), ("estimation", BLUE), ("painting", BLUE)]
    for number, (text, colour) in enumerate(top):
        box(axes, 8 + 15 * number, 21, text, 11, colour)
        if number:
            arrow(axes, (8 + 15 * number - 9.5, 21), (8 + 15 * number - 5.5, 21))
    bottom = [
        ("supervisor", ORANGE),
        ("model, tasks,\nlimits", BLUE),
        ("OSQP", BLUE),
        ("accepted?", BLUE),
        ("Command", INK),
    ]
    for number, (text, colour) in enumerate(bottom):
        x = 68 - 15 * number
        box(axes, x, 9, text, 11, colour)
        if number:
            arrow(axes, (x + 9.5, 9), (x + 5.5, 9))
    arrow(axes, (68, 18), (68, 12), "")
    axes.text(69, 15, "Reference", fontsize=7.5, va="center")
    arrow(axes, (48, 18), (64, 12.2))
    axes.text(47, 15.3, "monitors: inputs, push,\nrotors, wall, envelope", fontsize=7.5, va="center", ha="right")
    arrow(axes, (23, 6), (23, 2.2))
    axes.text(24, 3.2, "no: DAQP, analytic law, hover", fontsize=7.5, va="center")
    return figure


def solvers() -> Figure:
    """Who answers a tick."""
    figure, axes = canvas(76, 20)
    steps = [("OSQP", BLUE), ("DAQP", BLUE), ("analytic law", ORANGE), ("hold", ORANGE)]
    outcomes = ["solved\ninaccurate_accepted\ncapped_accepted", "exact_fallback", "analytic_fallback", "hold"]
    reasons = ["test fails", "no solution", "no input"]
    for number, ((text, colour), outcome) in enumerate(zip(steps, outcomes, strict=True)):
        x = 9 + 19 * number
        box(axes, x, 15, text, 12, colour)
        arrow(axes, (x, 12), (x, 7.2))
        axes.text(x, 3.8, outcome, fontsize=8, ha="center", va="center", family="monospace")
        if number:
            arrow(axes, (x - 13, 15), (x - 6.2, 15), reasons[number - 1])
    return figure


def supervisor() -> Figure:
    """States of the supervisor in the order of severity."""
    figure, axes = canvas(76, 17)
    states = [("nominal", GREEN), ("degraded", BLUE), ("retreat", ORANGE), ("hover", ORANGE), ("descend", ORANGE)]
    for number, (text, colour) in enumerate([*states, ("terminated", "#a02020")]):
        x = 7 + 12.4 * number
        box(axes, x, 9, text, 9.6, colour, 5)
        if number:
            arrow(axes, (x - 7.6, 9), (x - 4.8, 9))
    arrow(axes, (18.5, 11.6), (8, 11.6), "", bend=0.45)
    axes.text(13, 14.9, "no fault is present", fontsize=7.5, ha="center")
    axes.text(50, 14.9, "never left for a milder state", fontsize=7.5, ha="center")
    axes.plot((27, 74), (13.6, 13.6), color=INK, linewidth=0.8)
    axes.text(38, 3.2, "a fault may enter any state directly; the most severe one of all present faults holds",
              fontsize=7.5, ha="center")  # fmt: skip
    return figure
