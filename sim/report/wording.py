"""Meaning of the outcomes and limits of a report, in one plain sentence each."""

from __future__ import annotations

from typing import Any

#: Meaning of every outcome of a control tick.
OUTCOMES = {
    "solved": "The solver reached its accuracy: the normal case.",
    "inaccurate_accepted": "The solver ended with less accuracy, and the result passed the checks.",
    "capped_accepted": "The solver used up its iterations, and the result passed the checks.",
    "exact_fallback": "The solver's result failed the checks; the exact solver answered instead.",
    "analytic_fallback": "No solution passed the checks, now or shortly before; the analytic law controlled this tick.",
    "hold": "Inputs were missing or unusable: the vehicle carried its weight and kept level.",
}
#: Meaning of the limits by the beginning of their names.
LIMITS = {
    "thrust": "A rotor was at its least or greatest thrust, or changed it as fast as it may.",
    "tilt": "The vehicle was kept from leaning further.",
    "yaw": "The vehicle was kept from turning away from the wall.",
    "view": "The vehicle was kept from losing the guide line from the picture.",
    "push_ceiling": "The brush was kept from pushing harder.",
    "approach_speed": "The vehicle was slowed down in front of the wall.",
}


def limit_words(name: str) -> str:
    """Meaning of a limit; empty for one of a user's own."""
    return next((words for start, words in LIMITS.items() if name.startswith(start)), "")


def own_classes(summary: dict[str, Any]) -> str:
    """Classes of the user's that flew, for titles: the law's name then is that of its preset; empty without any."""
    words = {"controller": "control law", "rows": "tasks and limits", "strategy": "strategy"}
    found = ((name, summary.get(key)) for key, name in words.items())
    return "".join(f", {name} {' '.join([own] if isinstance(own, str) else own)}" for name, own in found if own)
