"""Rotors to body wrench and back: geometry, effectiveness, allocation within limits, attainable wrench sets.

The names load on first use: a controller that only needs the geometry need not wait for scipy's optimisers.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from allocation.contact_reach import (
        PushReach,
        PushReachTable,
        hover_wrench,
        push_direction,
        push_reach,
        worst_push_reach,
    )
    from allocation.effectiveness import control_effectiveness
    from allocation.geometry import TAROT_T960, Rotor, RotorGeometry
    from allocation.least_squares import DEFAULT_ROW_WEIGHTS, allocate_least_squares
    from allocation.level_flight import level_polygon, level_reach, worst_level_reach
    from allocation.pseudo_inverse import allocate_pseudo_inverse
    from allocation.sequential_desaturation import FULLY_ACTUATED_ORDER, allocate_px4, allocate_sequential
    from allocation.wrench_facets import WrenchFacets
    from allocation.wrench_set import Reach, WrenchSet

__all__ = [
    "DEFAULT_ROW_WEIGHTS",
    "FULLY_ACTUATED_ORDER",
    "TAROT_T960",
    "PushReach",
    "PushReachTable",
    "Reach",
    "Rotor",
    "RotorGeometry",
    "WrenchFacets",
    "WrenchSet",
    "allocate_least_squares",
    "allocate_pseudo_inverse",
    "allocate_px4",
    "allocate_sequential",
    "control_effectiveness",
    "hover_wrench",
    "level_polygon",
    "level_reach",
    "push_direction",
    "push_reach",
    "worst_level_reach",
    "worst_push_reach",
]

_HOMES = {
    "allocation.effectiveness": ("control_effectiveness",),
    "allocation.geometry": (
        "Rotor",
        "RotorGeometry",
        "TAROT_T960",
    ),
    "allocation.least_squares": (
        "DEFAULT_ROW_WEIGHTS",
        "allocate_least_squares",
    ),
    "allocation.level_flight": (
        "level_polygon",
        "level_reach",
        "worst_level_reach",
    ),
    "allocation.pseudo_inverse": ("allocate_pseudo_inverse",),
    "allocation.contact_reach": (
        "PushReach",
        "PushReachTable",
        "hover_wrench",
        "push_direction",
        "push_reach",
        "worst_push_reach",
    ),
    "allocation.sequential_desaturation": (
        "FULLY_ACTUATED_ORDER",
        "allocate_px4",
        "allocate_sequential",
    ),
    "allocation.wrench_facets": ("WrenchFacets",),
    "allocation.wrench_set": (
        "Reach",
        "WrenchSet",
    ),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name where it lives."""
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME_OF[name]), name)
