"""What may be changed about the first flight, with a button: a flight takes too long to follow a slider."""

from __future__ import annotations

from typing import Any


def settings_form() -> Any:
    """Seed, push and slope; the values are the arguments of `fly_first`, None before the button was pressed."""
    import marimo as mo

    fields = {
        "seed": mo.ui.slider(0, 9, 1, value=0, label="seed", show_value=True),
        "push_n": mo.ui.slider(2.0, 12.0, 0.5, value=5.0, label="push [N]", show_value=True),
        "slope_deg": mo.ui.slider(-4.0, 4.0, 0.5, value=0.0, label="slope of the board [°]", show_value=True),
    }
    text = "{seed} {push_n} {slope_deg}"
    return mo.md(text).batch(**fields).form(submit_button_label="fly", bordered=True)
