"""Sliders and switches of the knobs, and their panel."""

from __future__ import annotations

from typing import Any

from sim.notebook.tuning.knobs import GROUPS, KNOBS, Knob, knob_values
from sim.notebook.tuning.snippet import Setting


def make_controls(setting: Setting) -> Any:
    """Every knob as a slider or a switch, standing where the setting has it; values come by the knob's name."""
    import marimo as mo

    values = knob_values(setting)
    return mo.ui.dictionary({name: _widget(knob, values[name]) for name, knob in KNOBS.items()})


def _widget(knob: Knob, value: Any) -> Any:
    import marimo as mo

    if knob.low is None:
        return mo.ui.switch(value=bool(value), label=knob.label)
    # A slider tells its value when it is let go: a flight for every pixel of the way would queue up.
    steps = knob.stops(value)
    return mo.ui.slider(steps=steps, value=value, label=knob.label, show_value=True, debounce=True, full_width=True)


def control_panel(controls: Any, *further: Any) -> Any:
    """The knobs at the side of the page: the first group in full, the others to be opened.

    Args:
        controls: From `make_controls`.
        further: Elements below them.
    """
    import marimo as mo

    # The values written beside the sliders need room at the right.
    groups = {
        title: mo.vstack([controls[knob.name] for knob in knobs], gap=0.3).style({"padding-right": "1.2rem"})
        for title, knobs in GROUPS.items()
    }
    first, *others = groups
    folded = mo.accordion({title: groups[title] for title in others}, multiple=True)
    return mo.sidebar([mo.md(f"### {first}"), groups[first], folded, *further], width="22rem")
